"""Importing the package, or any of its modules, changes nothing that others can see."""

import json
import subprocess
import sys

import pytest

from belt_sim.paths import ROOT

STATE = """
import json, logging, os, sys, warnings
def state():
    jax = sys.modules.get("jax")
    return [dict(os.environ), [str(f) for f in warnings.filters],
            {k: str(v) for k, v in jax.config.values.items()} if jax else None,
            {n: logging.getLogger(n).level for n in ("", "jax", "matplotlib", "hydra")}]
"""
#: third parties first: what they set is theirs
PARTIES = (
    "jax",
    "numpy",
    "scipy.optimize",
    "pandas",
    "matplotlib",
    "pydantic",
    "rerun",
    "mujoco",
    "hydra",
    "omegaconf",
)
#: run on import by design, or in need of what is not installed here
PROGRAMS = ("__main__", "bench", "studies", "mjx")


def printed(program: str) -> object:
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def modules() -> list[str]:
    paths = sorted((ROOT / "belt_sim").rglob("*.py"))
    names = [".".join(p.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for p in paths]
    return [n for n in names if not any(p in n for p in PROGRAMS)]


def test_importing_the_package_loads_nothing():
    program = "import sys; old = set(sys.modules); import belt_sim as bs; import json; dir(bs)\n"
    loaded = printed(program + "print(json.dumps(sorted(set(sys.modules) - old)))")
    assert [m for m in loaded if m.split(".")[0] not in sys.stdlib_module_names] == ["belt_sim"]


def test_importing_every_module_sets_nothing():
    program = (
        f"{STATE}\nimport importlib\nfor m in {PARTIES!r}: importlib.import_module(m)\nbefore = state()\nchanged = {{}}\n"
        f"for m in {modules()!r}:\n"
        "    importlib.import_module(m)\n"
        "    now = state()\n"
        "    if now != before: changed[m] = [b for a, b in zip(before, now) if a != b]\n"
        "    before = now\n"
        "print(json.dumps(changed))"
    )
    assert printed(program) == {}


@pytest.mark.parametrize(
    "setting", ["os.environ['X'] = '1'", "warnings.simplefilter('ignore')", "logging.getLogger('jax').setLevel(10)"]
)
def test_what_is_set_would_be_seen(setting):
    """The state looked at is one that a module could change."""
    assert printed(f"{STATE}\nbefore = state()\n{setting}\nprint(json.dumps(state() != before))") is True
