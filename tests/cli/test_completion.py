"""Completion is Hydra's: ``belt-sim -sc install=bash`` installs it, ``belt-sim -sc query=bash`` gives the words."""

import pytest

from belt_sim.commands.cli import run_command


def replies(line: str, monkeypatch, capsys) -> list[str]:
    """What bash is offered after ``line``."""
    monkeypatch.setenv("COMP_LINE", line)
    assert run_command(["-sc", "query=bash"]) == 0
    return capsys.readouterr().out.split()


@pytest.mark.parametrize(
    ("line", "offered", "more"),
    [
        ("belt-sim ", ["simulate", "new-effect"], True),
        ("belt-sim sim", ["simulate", "export", "map"], True),  # bash itself picks those that fit
        ("belt-sim simulate ten", ["tension="], False),
        ("belt-sim simulate tension=10 rig.centre", ["rig.centre_distance="], False),
        ("belt-sim simulate model=strip", ["model=strip", "model=strip_lift_off"], False),
        ("belt-sim diagnose campaign=slack", ["campaign=slack_belt"], True),
        ("belt-sim nonsense ten", [], False),
    ],
)
def test_bash_is_offered(line, offered, more, monkeypatch, capsys):
    words = replies(line, monkeypatch, capsys)
    assert set(offered) <= set(words)
    assert more or words == offered


def test_files_complete(tmp_path, monkeypatch, capsys):
    (tmp_path / "my_effects.yaml").touch()
    monkeypatch.chdir(tmp_path)
    assert replies("belt-sim compare effects=./my", monkeypatch, capsys) == ["effects=./my_effects.yaml"]


@pytest.mark.parametrize("asked", [["-sc", "install=bash"], ["completion"]])
def test_the_script_is_hydras_and_calls_belt_sim(asked, capsys):
    assert run_command(asked) == 0
    out = capsys.readouterr().out
    assert "hydra_bash_completion" in out
    assert out.rstrip().endswith("hydra_bash_completion belt-sim")
