"""What is in a recording is what was handed over."""

import socket
from dataclasses import replace

import numpy as np
import pytest
from moving_belt import case, curves, frames
from read_back import read_back
from rerun.chunk import RrdReader

from belt_sim.errors import BeltError
from belt_sim.show.geometry import tilt, view_scale_of
from belt_sim.show.rerun import (
    PICTURES,
    Overlay,
    RerunObserver,
    Scene,
    _free_port,
    record_runs,
    recording_named,
    root_of,
    save_recording,
)
from belt_sim.show.style import POINT_COLOURS, rgb
from belt_sim.units import MM
from studies.paper.case import YAW

SINGLE = 1e-6  # [m] Rerun keeps positions in single precision: half a unit in the last place at 11 m is 5e-7 m
TRAVEL = 3.0
ROOT = "runs/10_N_mm2/yaw_-0.042_deg/belt"  # of a run of no named model
RUN = "10 N/mm2, yaw -0.042 deg"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A short run in a file, and its frames."""
    path = tmp_path_factory.mktemp("watch") / "run.rrd"
    shown, observer = list(frames(TRAVEL)), RerunObserver(path)
    observer.start(case(), TRAVEL)
    for frame in shown:
        observer.frame(frame)
    assert not path.exists()  # it gets its name when it is whole
    observer.finish(curves(TRAVEL))
    assert [p.name for p in path.parent.iterdir()] == ["run.rrd"]
    return read_back(path, ROOT), shown


def test_true_edges_come_back_from_the_file(recorded):
    logged, shown = recorded
    strips = logged["machine/true/belt/edges:LineStrips3D:strips"]
    np.testing.assert_allclose(strips.travel_mm, [f.travel / MM for f in shown], atol=1e-5)
    for (left, right), frame in zip(strips.values, shown, strict=True):
        np.testing.assert_allclose(left[:-1], frame.left, atol=SINGLE)
        np.testing.assert_allclose(right[:-1], frame.right, atol=SINGLE)
        np.testing.assert_array_equal(left[0], left[-1])  # closed


def test_drawn_movement_is_the_true_one_times_the_scale(recorded):
    logged, shown = recorded
    scale = view_scale_of(case(), TRAVEL).lateral
    assert scale > 1
    for (left, right), frame in zip(logged["machine/drawn/belt/edges:LineStrips3D:strips"].values, shown, strict=True):
        middle = 0.5 * (left + right)[:-1]
        np.testing.assert_allclose(middle[:, 1], scale * 0.5 * (frame.left + frame.right)[:, 1], atol=scale * SINGLE)
        width = np.abs(left - right)[:-1, 1]
        np.testing.assert_allclose(width, 0.2, rtol=1e-4)  # cos(tilt) of 8 mrad is 3e-5 from 1


def test_time_series_come_back_in_the_units_shown(recorded):
    logged, shown = recorded
    for k in range(4):
        y = logged[f"series/y/y{k + 1}:Scalars:scalars"].values
        np.testing.assert_allclose(np.ravel(y), [f.points[k, 1] / MM for f in shown], rtol=1e-12)
    roll = np.ravel(logged["series/tilt/tilt_upper:Scalars:scalars"].values)
    expected = np.interp([f.travel for f in shown], curves(TRAVEL).travel, curves(TRAVEL).tilt[0])
    np.testing.assert_allclose(roll, expected / 1e-3, rtol=1e-12)
    np.testing.assert_allclose(np.ravel(logged["series/tension/tension:Scalars:scalars"].values), 10.0)


def test_the_tilt_seen_in_the_edges_is_that_of_the_curves(recorded):
    logged, _ = recorded
    left, right = logged["machine/true/belt/edges:LineStrips3D:strips"].values[-1]
    seen = tilt(left, right)
    known = curves(TRAVEL).tilt[:, -1]
    np.testing.assert_allclose([seen.max(), seen.min()], known, atol=2 * SINGLE / 0.2)


def test_the_tail_pulley_is_shown_yawed(recorded):
    logged, _ = recorded
    turn = logged["machine/true/tail/turned:Transform3D:rotation_axis_angle"].values[-1]
    assert float(turn.item()["angle"]) == pytest.approx(YAW, rel=1e-6)


def test_instants_as_columns_say_what_they_say_one_by_one(tmp_path):
    shown, logged = list(frames(TRAVEL)), []
    for name in ("one", "all"):
        recording = recording_named("test")
        scene = Scene(recording, "belt", case(), view_scale_of(case(), TRAVEL))
        if name == "all":
            scene.frames(shown)
        else:
            for frame in shown:
                scene.frames([frame])
        save_recording(tmp_path / f"{name}.rrd", recording)
        logged.append(read_back(tmp_path / f"{name}.rrd"))
    one, columns = logged
    assert one.keys() == columns.keys()
    assert "belt/belt/ribbon:Mesh3D:vertex_colors" in one
    for key in one:
        np.testing.assert_array_equal(one[key].travel_mm, columns[key].travel_mm)
        np.testing.assert_equal(list(one[key].values), list(columns[key].values))


def test_frames_closer_than_asked_for_are_left_out(tmp_path):
    observer = RerunObserver(tmp_path / "thin.rrd", every=0.5)
    observer.start(case(), TRAVEL)
    for frame in frames(TRAVEL, every=0.1):
        observer.frame(frame)
    observer.finish(curves(TRAVEL))
    seen = read_back(tmp_path / "thin.rrd", ROOT)["series/y/y1:Scalars:scalars"].travel_mm
    np.testing.assert_allclose(seen, np.arange(0, 3001, 500), atol=1e-5)


def test_the_last_row_and_picture_are_there_and_rows_come_every_25_mm(tmp_path):
    observer = RerunObserver(tmp_path / "fine.rrd", model="mujoco_flex")
    observer.start(case(), 0.99)
    for frame in frames(1.0, every=0.005):
        if frame.travel < 0.9901:
            observer.frame(frame)
    observer.finish(curves(0.99))
    logged = read_back(tmp_path / "fine.rrd", ROOT.replace("belt", "mujoco_flex"))
    rows = logged["series/y/y1:Scalars:scalars"].travel_mm
    np.testing.assert_allclose(rows, [*np.arange(0.0, 990.0, 25.0), 990.0], atol=1e-5)
    for drawing in ("true", "drawn"):
        assert logged[f"machine/{drawing}/belt/edges:LineStrips3D:strips"].travel_mm[-1] == pytest.approx(990.0)


def test_curves_measurement_and_residual_come_back(tmp_path):
    model = curves(20.0)
    half = replace(curves(20.0, step=0.3), tilt=None)
    half.y[1:3] = np.nan
    measured = replace(half, y=half.y + 1e-3)
    overlay = Overlay(modelled={"strip + taper": model}, measured=measured, case=case())
    record_runs(tmp_path / "c.rrd", {f"r01, {RUN}": overlay})
    logged = read_back(tmp_path / "c.rrd", "runs/r01/10_N_mm2/yaw_-0.042_deg")
    shown = logged["y/strip_taper:Scalars:scalars"]
    rows = np.rint(shown.travel_mm * MM / 0.1).astype(int)
    assert len(rows) <= 200
    assert rows[[0, -1]].tolist() == [0, 200]
    np.testing.assert_allclose(np.array(shown.values), model.y[[0, 3]][:, rows].T / MM, rtol=1e-12)
    residual = np.array(logged["residual/strip_taper:Scalars:scalars"].values)
    assert residual.shape == (67, 2)  # points 1 and 4 were measured; the last sample lies beyond the model's travel
    np.testing.assert_allclose(residual, -1.0, atol=1e-9)
    tilt_rows = np.array(logged["tilt/strip_taper:Scalars:scalars"].values)
    np.testing.assert_allclose(tilt_rows, model.tilt[:, rows].T / 1e-3, rtol=1e-12)
    assert "belt/belt/edges:LineStrips3D:strips" in logged


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    observer = RerunObserver(tmp_path / "file" / "run.rrd")
    observer.start(case(), TRAVEL)
    with pytest.raises(BeltError, match="cannot be written") as error:
        observer.finish(curves(TRAVEL))
    assert "\n" not in str(error.value)


def test_no_viewer_is_one_line(monkeypatch):
    monkeypatch.setenv("DISPLAY", ":77")
    monkeypatch.setattr("rerun.RecordingStream.spawn", lambda self: (_ for _ in ()).throw(RuntimeError("no\nviewer")))
    with pytest.raises(BeltError, match="use watch=rrd") as error:
        RerunObserver().start(case(), TRAVEL)
    assert "\n" not in str(error.value)


def test_two_runs_may_be_watched_at_once():
    with socket.socket() as taken:
        taken.bind(("0.0.0.0", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert _free_port(port) != port
    assert _free_port(port) == port


def test_slip_and_sag_have_their_own_plots(tmp_path):
    observer = RerunObserver(tmp_path / "slip.rrd")
    observer.start(case(), TRAVEL)
    numbers = {"slip_head": 3e-6, "sag_upper": 0.122, "something_new": 7.0}
    observer.frame(replace(next(frames(TRAVEL)), scalars=numbers))
    observer.finish(curves(TRAVEL))
    logged = read_back(tmp_path / "slip.rrd", ROOT)
    seen = [
        logged[f"series/{k}:Scalars:scalars"].values[0].item()
        for k in ("slip/slip_head", "sag/sag_upper", "further/something_new")
    ]
    assert seen == pytest.approx([3.0, 122.0, 7.0])  # um, mm, as it came


def test_no_recording_is_one_line(tmp_path):
    (tmp_path / "no.rrd").write_text("nonsense")
    with pytest.raises(BeltError, match="cannot be read"):
        read_back(tmp_path / "no.rrd")


def test_an_observer_never_started_ignores_frames():
    observer = RerunObserver()
    observer.frame(next(frames(1.0)))
    observer.finish(curves(1.0))


def test_a_recording_of_a_long_run_and_of_a_campaign_stays_small(tmp_path):
    """60 m in space; ten runs of a campaign, as a diagnosis leaves it."""
    observer = RerunObserver(tmp_path / "long.rrd")
    observer.start(case(), 60.0)
    for frame in frames(60.0):
        observer.frame(frame)
    observer.finish(curves(60.0))
    logged = read_back(tmp_path / "long.rrd", ROOT)
    assert len(logged["series/y/y1:Scalars:scalars"].travel_mm) == 601  # one a frame: they come every 0.1 m
    assert len(logged["machine/drawn/points:Points3D:positions"].travel_mm) <= PICTURES + 1
    measured = replace(curves(60.0, step=0.5), tilt=None)
    overlay = Overlay(modelled={"a": curves(60.0), "b": curves(60.0)}, measured=measured, case=case())
    record_runs(tmp_path / "campaign.rrd", {f"r{k:02d}": overlay for k in range(10)})
    assert (tmp_path / "long.rrd").stat().st_size < 3e6
    assert (tmp_path / "campaign.rrd").stat().st_size < 3.5e6


def styled(path):
    """Colours of the curves of an .rrd, by path."""
    found = {}
    for chunk in RrdReader(str(path)).stream():
        batch = chunk.to_record_batch()
        for name in ("SeriesLines:colors", "SeriesPoints:colors"):
            if name in batch.schema.names:
                found[chunk.entity_path.lstrip("/")] = batch.column(name).to_pylist()[0]
    return found


def whole(colour: str) -> int:
    """A colour as Rerun keeps it."""
    red, green, blue = rgb(colour)
    return red << 24 | green << 16 | blue << 8 | 255


def test_points_have_their_four_colours_and_models_before_the_last_are_pale(tmp_path):
    overlay = Overlay(modelled={"a": curves(5.0), "b": curves(5.0)}, measured=curves(5.0), case=case())
    record_runs(tmp_path / "c.rrd", {"r01": overlay})
    colours = styled(tmp_path / "c.rrd")
    points = [whole(c) for c in POINT_COLOURS]
    assert colours["runs/r01/y/b"] == colours["runs/r01/y/measured"] == colours["runs/r01/residual/b"] == points
    pale = colours["runs/r01/y/a"]
    assert len({*pale, *points}) == 8
    observer = RerunObserver(tmp_path / "run.rrd")
    observer.start(case(), TRAVEL)
    observer.frame(next(frames(TRAVEL)))
    observer.finish(curves(TRAVEL))
    assert [styled(tmp_path / "run.rrd")[f"{ROOT}/series/y/y{k}"] for k in (1, 2, 3, 4)] == [[p] for p in points]


def test_a_sweep_is_one_recording_whose_paths_say_tension_yaw_and_model(tmp_path):
    titles = [f"{t} N/mm2, yaw -0.042 deg" for t in (7, 10, 20, 40)]
    runs = {title: Overlay(modelled={"strip": curves(5.0), "rope": curves(5.0)}, case=case()) for title in titles}
    assert record_runs(tmp_path / "sweep.rrd", runs, name="four tensions") == tmp_path / "sweep.rrd"
    logged = read_back(tmp_path / "sweep.rrd")
    for title in titles:
        assert f"{root_of(title)}/y/strip:Scalars:scalars" in logged
        assert f"{root_of(title)}/belt/points:Points3D:positions" in logged
    assert root_of(titles[0]) == "runs/7_N_mm2/yaw_-0.042_deg"
    named = [chunk.to_record_batch() for chunk in RrdReader(str(tmp_path / "sweep.rrd")).stream()]
    names = [b.column("RecordingInfo:name").to_pylist() for b in named if "RecordingInfo:name" in b.schema.names]
    assert names == [[["four tensions"]]]


def test_pulleys_are_round():
    from belt_sim.show.rerun import drum

    corners = np.array(drum(0.3, 0.17).vertex_positions.pa_array.flatten()).reshape(-1, 3)
    radius = np.hypot(corners[:, 0], corners[:, 2])
    np.testing.assert_allclose(radius, 0.17, rtol=1e-6)
    assert len(np.unique(np.round(np.arctan2(corners[:, 0], corners[:, 2]), 4))) >= 90
    assert sorted(set(np.round(corners[:, 1], 6))) == [-0.15, 0.15]
