"""Runs that are watched: a killed 3D run leaves what it had, and engines without instants are shown when they end."""

import io

import numpy as np
import pandas as pd
import pytest

import belt_sim as bs
from belt_sim.commands import outputs
from belt_sim.commands.outputs import observers_of, show
from belt_sim.errors import SimulationError
from belt_sim.show.geometry import frames


@pytest.fixture(scope="module")
def simulation():
    return bs.simulate(tension=40, travel=3)


def test_positions_so_far_are_on_disk_while_a_run_goes_on(simulation, tmp_path, monkeypatch):
    monkeypatch.setattr(outputs, "EVERY", 0.0)
    observer = outputs.CurvesSoFar(tmp_path)
    observer.start(simulation.case, simulation.travel)
    for frame in frames(simulation.case, simulation.curves):
        observer.frame(frame)
    table = pd.read_csv(tmp_path / outputs.PARTIAL)
    assert table["travel_m"].iloc[-1] == 3.0
    assert table["y1_mm"].iloc[-1] == pytest.approx(1e3 * float(np.asarray(simulation.curves.y)[0, -1]), rel=1e-6)


@pytest.mark.parametrize("end", [KeyboardInterrupt, SimulationError, None])
def test_a_stopped_run_leaves_its_curves_and_a_whole_one_none(simulation, tmp_path, end):
    observer = outputs.CurvesSoFar(tmp_path)

    def go_on():
        with outputs.partial_curves_kept(tmp_path, [observer]):
            for frame in frames(simulation.case, simulation.curves):
                observer.frame(frame)
            if end is SimulationError:
                failure = SimulationError("off the pulleys")
                failure.curves = simulation.curves
                raise failure
            if end:
                raise end

    if end is None:
        go_on()
    else:
        with pytest.raises(end):
            go_on()
    assert (tmp_path / outputs.PARTIAL).is_file() == (end is not None)


def test_a_run_without_instants_is_recorded_when_it_ends(simulation, tmp_path):
    pytest.importorskip("rerun")
    from belt_sim.space.model import SpaceModel

    model = SpaceModel(engine="quasi_static")
    assert observers_of(model, "rrd", "title", tmp_path) == []
    show(simulation, model, "rrd", tmp_path)
    assert (tmp_path / "belt.rrd").stat().st_size > 0


def test_nobody_at_the_terminal_is_told_where_the_recording_lies(simulation, tmp_path, monkeypatch, capsys):
    pytest.importorskip("rerun")
    from belt_sim.show import rerun

    class Viewer:
        def start(self, case, travel):
            pass

        frame = finish = lambda self, shown: None

    monkeypatch.setattr(rerun, "RerunObserver", Viewer)
    monkeypatch.setattr("sys.stdin", io.StringIO())
    from belt_sim.model import MODELS

    show(simulation, MODELS["strip"], "rerun", tmp_path)
    assert str(tmp_path / "belt.rrd") in capsys.readouterr().out
    assert (tmp_path / "belt.rrd").is_file()
