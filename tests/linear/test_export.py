"""What ``belt-sim export`` writes is the plant: read back by Matlab's format, and python-control (FMU: test_fmu.py)."""

import json

import numpy as np
import pytest
from scipy.io import loadmat

import belt_sim as bs
from belt_sim.commands.cli import run_command
from belt_sim.linear.plant import state_space


@pytest.fixture
def exported(tmp_path, monkeypatch, capsys):
    """Run ``belt-sim export`` and return its exit status, messages and folder."""

    def call(*asked: str):
        monkeypatch.setattr("sys.argv", ["belt-sim"])
        monkeypatch.setenv("HYDRA_FULL_ERROR", "1")
        status = run_command(["export", *asked, f"hydra.run.dir={tmp_path / 'plant'}"])
        return status, capsys.readouterr(), tmp_path / "plant"

    return call


def test_files_hold_the_same_plant(exported):
    status, said, folder = exported("tension=20", "speed=0.25", "order=3", "fmu=null")
    assert status == 0, said.err
    mat, told = loadmat(folder / "belt.mat"), json.loads((folder / "plant.json").read_text())
    plant = bs.linearise(tension=20, speed=0.25)  # the model that both choose
    assert mat["A"] == pytest.approx(state_space(plant, order=3).a)
    assert np.array(told["state_space"]["a"]) * 0.25 == pytest.approx(mat["A"])
    assert told["state_space"]["relative_error"] < 1e-4
    assert told["tension_n_per_mm2"] == 20.0
    assert (folder / "bode.png").stat().st_size > 10_000


def test_python_control_has_the_same_response():
    control = pytest.importorskip("control")
    plant = bs.linearise(model="strip", rig="test_rig", tension=10)
    space, system = state_space(plant, order=3), plant.to_control(order=3)
    assert isinstance(system, control.StateSpace)
    w = np.array([0.02, 0.1])
    answer = np.asarray(control.frequency_response(system, w).complex)  # (4, 2, k)
    assert np.moveaxis(answer, -1, 0) == pytest.approx(space.response(w))


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ("order=0", "order = 0"),
        ("fmu=belt.zip", "ending in .fmu"),
        ("mat=../belt.mat", "ending in .mat"),
        ("highest=-1", "highest = -1 rad/m"),
        ("model=ritzinger", "ritzinger"),
        ("delay=taylor", "pade, chain"),
        ("fmi=1", "fmi = 1"),
    ],
)
def test_bad_input_is_one_line(exported, asked, said):
    status, spoken, folder = exported(asked)
    assert status == 1
    assert said in spoken.err
    assert spoken.err.count("\n") == 1
    assert not folder.exists()  # a refused run leaves none
