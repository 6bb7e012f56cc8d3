"""Runs that are watched: a killed 3D run leaves what it had, and engines without instants are shown when they end."""

import io

import pandas as pd
import pytest

import belt_sim as bs
from belt_sim.commands import cases
from belt_sim.commands.cases import observers_of, stay
from belt_sim.commands.cli import run_command
from belt_sim.errors import SimulationError


@pytest.fixture(scope="module")
def simulation():
    return bs.simulate(tension=40, travel=3)


@pytest.mark.parametrize("end", [KeyboardInterrupt, SimulationError, None])
def test_a_stopped_run_leaves_its_curves_and_a_whole_one_none(tmp_path, monkeypatch, end):
    from belt_sim.show.terminal import ProgressObserver

    def frame(self, frame):
        if frame.travel > 0.05 and end:
            raise end("stopped")

    monkeypatch.setattr(ProgressObserver, "frame", frame)
    settings = ("rig=rope_example", "model=mujoco_flex", "tension=40", "travel=0.1", "pictures=false")
    brief = {"dx": 0.04, "dt": 1.5e-3, "run_in": 0.1, "settle": 0.1, "yaw_time": 0.1, "acceleration": 3}  # SI
    short = [f"model.{name}={value}" for name, value in brief.items()]
    run_command(["simulate", *settings, *short, f"hydra.run.dir={tmp_path}"])
    assert (tmp_path / cases.PARTIAL).is_file() == (end is not None)
    if end:
        assert 0.0 < pd.read_csv(tmp_path / cases.PARTIAL)["travel_m"].iloc[-1] < 0.1


def test_a_run_without_instants_is_recorded_when_it_ends(simulation, tmp_path, monkeypatch):
    pytest.importorskip("rerun")
    from belt_sim.space.model import SpaceModel

    model = SpaceModel(engine="quasi_static")
    assert observers_of(model, "rrd", "title", tmp_path) == []
    monkeypatch.setattr(cases, "simulate", lambda *asked, **options: simulation)
    monkeypatch.setattr(cases, "model_of", lambda *asked: model)
    assert (
        run_command(["simulate", "model=mujoco_flex", "watch=rrd", "pictures=false", f"hydra.run.dir={tmp_path}"]) == 0
    )
    assert (tmp_path / "belt.rrd").stat().st_size > 0


@pytest.mark.parametrize("model", ["strip", "mujoco_flex"])
def test_without_a_display_the_page_is_served_until_ctrl_c(simulation, monkeypatch, capsys, model):
    pytest.importorskip("rerun")
    from belt_sim.model import MODELS
    from belt_sim.show import rerun, terminal
    from belt_sim.space.model import SpaceModel

    served = []

    class Viewer:
        def __init__(self, model):
            served.append(model)

        def start(self, case, travel):
            pass

        frame = finish = lambda self, shown: None

    def sleep(seconds):
        served.append("waits")
        raise KeyboardInterrupt

    monkeypatch.setattr(rerun, "RerunObserver", Viewer)
    monkeypatch.setattr(terminal, "has_display", lambda: False)
    monkeypatch.setattr("time.sleep", sleep)
    monkeypatch.setattr("sys.stdin", io.StringIO())  # nobody at the terminal: it is served all the same
    stay(simulation, MODELS["strip"] if model == "strip" else SpaceModel(), [], "rerun")
    assert served == (["strip", "waits"] if model == "strip" else ["waits"])
    assert "served until Ctrl-C" in capsys.readouterr().out


def test_mujocos_window_is_waited_for_when_results_are_written():
    from belt_sim.show.terminal import ViewerObserver

    viewer, steps = ViewerObserver(), []

    class Window:
        def is_running(self):
            return len(steps) < 3

        def sync(self):
            steps.append("sync")

    viewer.window = Window()
    viewer.finish(None)
    assert steps == ["sync"]  # and the run goes on to its files
    viewer.wait()
    assert len(steps) == 3
