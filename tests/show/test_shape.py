"""Geometry of what is drawn."""

from dataclasses import replace

import numpy as np
import pytest
from moving_belt import case, frames

from belt_sim.case import Schedule
from belt_sim.line.runup import angle_at
from belt_sim.show import geometry


def test_tilt_is_the_roll_of_the_section():
    roll = np.array([0.0, 8e-3, -0.3])
    half = 0.1 * np.column_stack([np.zeros(3), np.cos(roll), np.sin(roll)])
    np.testing.assert_allclose(geometry.tilt(half, -half), roll, atol=1e-15)


def test_a_rope_has_no_tilt():
    line = np.random.default_rng(1).normal(size=(5, 3))
    np.testing.assert_array_equal(geometry.tilt(line, line), 0.0)


def test_scale_one_changes_nothing():
    frame = list(frames(2.0))[-1]
    same = geometry.enlarge(frame, geometry.TRUE)
    for name in ("left", "right", "points"):
        np.testing.assert_allclose(getattr(same, name), getattr(frame, name), atol=1e-15)


def test_the_enlarged_belt_still_lies_along_the_enlarged_pulley():
    """On the tail wrap the section stands along the pulley's axis, whose yaw grows by the same factor."""
    frame = list(frames(2.0))[-1]
    drawn = geometry.enlarge(frame, geometry.ViewScale(lateral=50, tilt=10, shortened=4))
    on_tail = frame.left[:, 0] > frame.tail_x + 0.01
    assert drawn.yaw_tail == pytest.approx(200 * frame.yaw_tail)
    across = (drawn.left - drawn.right)[on_tail]
    np.testing.assert_allclose(-across[:, 0] / across[:, 1], drawn.yaw_tail, rtol=1e-9)


def test_every_side_of_the_ribbon_is_shared_by_two_triangles_or_is_an_edge():
    n = 7
    triangles = geometry.ribbon_triangles(n)
    sides = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    _, counts = np.unique(sides, axis=0, return_counts=True)
    assert len(triangles) == 2 * n
    assert (counts == 1).sum() == 2 * n  # the two edges of the belt
    assert (counts == 2).sum() == 2 * n  # one across and one diagonal a station


@pytest.mark.parametrize(("travel", "lateral"), [(60.0, 10), (3.0, 50)])
def test_the_look_keeps_the_drift_on_the_pulley_and_the_yaw_small(travel, lateral):
    chosen = geometry.view_scale_of(case(), travel)
    assert chosen == geometry.ViewScale(lateral=lateral, tilt=10, shortened=4)
    assert chosen.words(case()).startswith(f"y x {lateral}, tilt x 10, yaw x {4 * lateral}, length / 4; colour: tilt")
    assert geometry.view_scale_of(case(2.0), travel).shortened == 1


def test_a_short_machine_is_drawn_short_and_its_pulleys_round():
    frame = list(frames(2.0))[-1]
    drawn = geometry.enlarge(frame, geometry.ViewScale(shortened=4))
    assert drawn.tail_x == pytest.approx(frame.tail_x / 4)
    on_tail = frame.left[:, 0] > frame.tail_x + 0.01
    middle = 0.5 * (drawn.left + drawn.right)[on_tail]
    radius = np.hypot(middle[:, 0] - drawn.tail_x, middle[:, 2])
    np.testing.assert_allclose(radius, float(case().rig.tail_radius), rtol=1e-9)


def test_thinning_keeps_the_shape():
    """900 stations become 160; what lies between those is not moved by more than the eye sees."""
    frame, radius = list(frames(2.0))[-1], float(case().rig.tail_radius)
    share = np.linspace(0.0, len(frame.left), 900, endpoint=False)
    fine = [
        np.column_stack([np.interp(share, np.arange(len(e) + 1), np.append(c, c[0])) for c in e.T])
        for e in (frame.left, frame.right)
    ]
    thin = geometry.thin_stations(replace(frame, left=fine[0], right=fine[1]), radius)
    assert len(thin.left) == 2 * (geometry.ON_SPAN + geometry.ON_WRAP)
    at = 0.5 * (thin.left + thin.right)
    on_wrap = (at[:, 0] > frame.tail_x) | (at[:, 0] < 0.0)
    assert abs(on_wrap.sum() - 2 * geometry.ON_WRAP) <= 2
    for edge, whole in zip((thin.left, thin.right), fine, strict=True):
        nearest = np.linalg.norm(edge[:, None] - whole[None], axis=-1).min(axis=1)
        spacing = np.linalg.norm(np.diff(whole, axis=0), axis=1).max()
        assert nearest.max() < 0.51 * spacing
    assert np.ptp(geometry.tilt(thin.left, thin.right)) == pytest.approx(
        np.ptp(geometry.tilt(frame.left, frame.right)), rel=0.02
    )


def test_colours_are_white_without_tilt_and_red_or_blue_with():
    blue, white, red = geometry.tilt_colours(np.array([-1e-2, 0.0, 1e-2]), 5e-3).astype(int)
    assert white.min() > 235
    assert blue[2] > blue[0] + 50
    assert red[0] > red[2] + 50


def test_yaw_steps_and_ramps():
    schedule = Schedule.step(1e-3, 1.0).then(Schedule.ramp(2e-3, 4.0, 2.0))
    assert [angle_at(schedule, s) for s in (0.0, 1.0, 3.0, 5.0, 9.0)] == pytest.approx([0, 1e-3, 1e-3, 2e-3, 3e-3])
