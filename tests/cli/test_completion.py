"""Completion in bash: the script that ``belt-sim completion`` prints, asked as readline asks it."""

import shutil
import subprocess

import pytest

from belt_sim.cli import COMMANDS, script, words

ASK = """
complete() {{ :; }}
{script}
COMP_LINE='{line}'; COMP_POINT=${{#COMP_LINE}}
_belt_sim
printf '%s\\n' "${{COMPREPLY[@]}}"
"""


def replies(line: str, cwd) -> list[str]:
    """What bash would offer after ``line``."""
    ask = ASK.format(script=script(COMMANDS), line=line)
    done = subprocess.run(["bash", "-c", ask], capture_output=True, text=True, check=True, cwd=cwd)
    return done.stdout.split()


@pytest.mark.skipif(not shutil.which("bash"), reason="needs bash")
@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("belt-sim sim", ["simulate"]),
        ("belt-sim simulate ten", ["tension="]),
        ("belt-sim simulate tension=10 rig.centre", ["rig.centre_distance="]),
        ("belt-sim simulate model=strip", ["strip", "strip_lift_off"]),  # readline replaces what follows "="
        ("belt-sim diagnose campaign=slack", ["slack_belt"]),
        ("belt-sim diagnose nonsense", []),
    ],
)
def test_bash_completes(line, offered, tmp_path):
    assert replies(line, tmp_path) == offered


@pytest.mark.skipif(not shutil.which("bash"), reason="needs bash")
def test_a_value_may_be_a_file(tmp_path):
    (tmp_path / "my_effects.yaml").touch()
    assert replies("belt-sim compare effects=my", tmp_path) == ["my_effects.yaml"]


def test_every_command_is_offered_and_has_help():
    assert all(
        f"\n  {name})" in script(COMMANDS) for name in COMMANDS if name not in ("demo", "completion", "new-effect")
    )
    assert "--help" in words("export")
