"""What an editor and a type checker know of ``import belt_sim as bs``."""

import subprocess
import sys

import pytest

import belt_sim as bs
from belt_sim.io import ROOT

SCRIPT = """
import belt_sim as bs
run = bs.simulate(model="strip", tension=10, yaw=0.04, rig={"centre_distance": 8.0}, travel=5.0)
print(run.rates[0], bs.plot(run).axes, bs.load_campaign("slack_belt").title, bs.__version__)
bs.nonsense()
bs.simulate(tensoin=10)
"""
#: what the package stands on is looked at as far as its stubs, which takes a tenth of the time
SETTINGS = """
[mypy]
ignore_missing_imports = True
follow_imports = silent
[mypy-jax.*,numpy.*,scipy.*,pandas.*,matplotlib.*,mujoco.*,pydantic.*]
follow_imports = skip
"""
WRONG = {5: "nonsense", 6: "tensoin"}  # by line


@pytest.mark.long
def test_a_type_checker_finds_names_and_settings_that_are_not_there(tmp_path):
    script = tmp_path / "mine.py"
    script.write_text(SCRIPT)
    (tmp_path / "mypy.ini").write_text(SETTINGS)
    options = ["--config-file", str(tmp_path / "mypy.ini"), "--cache-dir", str(tmp_path / "cache")]
    command = [sys.executable, "-m", "mypy", *options, str(script)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    found = {
        int(line.split(":")[1]): line for line in done.stdout.splitlines() if "mine.py:" in line and ": error:" in line
    }
    assert found.keys() == WRONG.keys(), done.stdout
    assert all(word in found[number] for number, word in WRONG.items())


def test_every_name_of_the_stub_is_there():
    for name in bs.__all__:
        assert getattr(bs, name) is not None
    assert {"load_campaign", "simulate", "mjx", "Diagnosis"} <= {*bs.__all__}
