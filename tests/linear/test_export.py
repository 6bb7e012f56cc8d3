"""What ``belt-sim export`` writes is the plant: read back by Matlab's format, python-control and an FMI importer."""

import json

import numpy as np
import pytest
from hydra.core.global_hydra import GlobalHydra
from scipy.io import loadmat

import belt_sim as bs
from belt_sim.cli import run
from belt_sim.linear.state_space import state_space

YAW = np.deg2rad(-0.042)


@pytest.fixture
def exported(tmp_path, monkeypatch, capsys):
    """Run ``belt-sim export`` and return its exit status, messages and folder."""

    def call(*asked: str):
        monkeypatch.setattr("sys.argv", ["belt-sim"])
        monkeypatch.setenv("HYDRA_FULL_ERROR", "1")
        GlobalHydra.instance().clear()
        status = run(["export", *asked, f"hydra.run.dir={tmp_path / 'plant'}"])
        return status, capsys.readouterr(), tmp_path / "plant"

    return call


@pytest.mark.parametrize("model", ["rope", "beam_th2", "strip"])
def test_the_fmu_moves_as_the_march_does(exported, model):
    fmpy = pytest.importorskip("fmpy")
    status, said, folder = exported(f"model={model}", "tension=10", "mat=null")
    assert status == 0, said.err
    kept = np.array([(0.0, YAW, 0.0, 0.5), (20.0, YAW, 0.0, 0.5)])
    names = ("time", "yaw", "yaw_head", "speed")
    steered = np.rec.fromarrays(kept.T, names=",".join(names))
    made = fmpy.simulate_fmu(
        str(folder / "belt.fmu"),
        fmi_type="CoSimulation",
        stop_time=20.0,
        step_size=0.1,
        output_interval=0.1,
        input=steered,
        output=["y1", "y2", "y3", "y4", "travel"],
    )
    curves = bs.simulate(model=model, rig="test_rig", tension=10, yaw=-0.042, travel=10).curves
    assert made["travel"][-1] == pytest.approx(10.0)
    for k in range(4):
        assert made[f"y{k + 1}"][-1] == pytest.approx(curves.y[k][-1], rel=3e-4)


def test_files_hold_the_same_plant(exported):
    status, said, folder = exported("tension=20", "speed=0.25", "order=3", "fmu=null")
    assert status == 0, said.err
    mat, told = loadmat(folder / "belt.mat"), json.loads((folder / "plant.json").read_text())
    plant = bs.linearise(model="strip", rig="test_rig", tension=20, speed=0.25)
    assert mat["A"] == pytest.approx(state_space(plant, order=3).a)
    assert np.array(told["state_space"]["a"]) * 0.25 == pytest.approx(mat["A"])
    assert told["state_space"]["relative_error"] < 1e-4
    assert told["tension_n_per_mm2"] == 20.0
    assert (folder / "bode.png").stat().st_size > 10_000


def test_python_control_has_the_same_response():
    control = pytest.importorskip("control")
    space = state_space(bs.linearise(model="strip", rig="test_rig", tension=10), order=3)
    system = space.to_control()
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
    ],
)
def test_bad_input_is_one_line(exported, asked, said):
    status, spoken, folder = exported(asked)
    assert status == 1
    assert said in spoken.err
    assert spoken.err.count("\n") == 1
    assert not folder.exists()  # a refused run leaves none
