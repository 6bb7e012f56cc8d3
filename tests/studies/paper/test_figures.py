"""Figures of the paper: their numbers against closed forms, and the command that leaves them."""

import numpy as np
import pytest

from belt_sim.errors import InputError
from belt_sim.line.spans import RitzingerFormula, edge_tensions
from belt_sim.model import analytic_model
from studies.paper import by_laws
from studies.paper.case import ROPE_EXAMPLE, YAW
from studies.paper.drawing import FIGURES, NOT_COMPUTED, compute, select_figures
from studies.paper.models import case_at, moving, span_shape


def test_every_figure_of_the_paper_is_computed_or_named_with_a_reason():
    assert sorted({*FIGURES, *NOT_COMPUTED}) == list(range(1, 21))
    assert not {*FIGURES} & {*NOT_COMPUTED}
    assert compute(2, in_space=False).number == 2


def test_choosing():
    assert select_figures(None) == list(FIGURES)
    assert select_figures([13, 12]) == [12, 13]
    assert select_figures(6) == [6]
    for wrong in (11, 18, 99, "x", True):
        with pytest.raises(InputError):
            select_figures([wrong])


def test_figure_2_ends_with_the_offset_and_the_slope_that_it_names():
    n = compute(2, in_space=False).numbers
    s, y1, y4 = (np.array(n[k]) for k in ("travel_m", "y1_mm", "y4_mm"))
    late = s > 40.0
    assert np.polyfit(s[late], y1[late], 1)[0] == pytest.approx(n["steady_rate_mm_per_m"], rel=0.02)
    assert (y1 - y4)[-1] == pytest.approx(n["steady_offset_mm"], rel=0.01)


def test_figure_6_points_begin_when_the_paper_says_so():
    n = compute(6, in_space=False).numbers
    s, half = np.array(n["travel_m"]), np.pi * ROPE_EXAMPLE.tail_radius
    begins = {k: s[np.argmax(np.array(n[f"y{k}_mm"]) > 1e-6)] for k in (1, 2, 3, 4)}
    assert begins[1] < 0.05
    assert begins[2] == pytest.approx(half, abs=0.05)
    assert begins[3] == pytest.approx(half, abs=0.1)  # as the lower span begins to turn
    assert begins[4] == pytest.approx(2.0 * half, abs=0.1)
    assert all(n["y1_mm"][-1] > 0.0 for _ in "+")  # a yaw of -0.042 degrees drives towards the paper's +y


def test_figure_9_the_bounds_bound():
    n = compute(9, in_space=False).numbers
    rope, first = np.array(n["rope_y1_mm"]), np.array(n["beam_th1_y1_mm"])
    for tension in by_laws.BOUNDED:
        y = np.array(n[f"beam_th2_{tension:g}_N_per_mm2_y1_mm"])
        assert np.all(y <= rope + 0.03)
        assert np.all(y >= first - 0.01)


def test_figure_14_the_shape_has_the_tilt_of_the_march_at_mid_span():
    curves = moving("strip", by_laws.TILTED)
    k = int(np.argmin(np.abs(np.asarray(curves.travel) - by_laws.TILTED_AT)))
    for row, name in enumerate(by_laws.SPANS):
        shape = by_laws.tilted_span(name)
        assert shape.tilt[len(shape.tilt) // 2] == pytest.approx(float(np.asarray(curves.tilt)[row, k]), rel=1e-6)


def test_figure_14_the_stored_belt_tilts_like_the_strip():
    n = compute(14, in_space=True).numbers
    for name in by_laws.SPANS:
        law, space = n[name], n["mujoco_flex"][name]
        order = np.argsort(law["x_m"])
        beside = np.interp(space["x_m"], np.array(law["x_m"])[order], np.array(law["tilt_mrad"])[order])
        assert np.abs(np.array(space["tilt_mrad"]) - beside).max() < 0.05 * n["greatest_tilt_mrad"]


def test_a_span_without_moments_is_a_straight_line_between_its_ends():
    shape = span_shape(case_at(10.0), analytic_model("strip"), (0.0, 1e-3), (1e-3 / 11.28, 1e-3 / 11.28))
    np.testing.assert_allclose(shape.y, 1e-3 * shape.x / shape.x[-1], atol=1e-12)
    assert np.abs(shape.tilt).max() < 1e-9


def test_ritzingers_edges_differ_by_what_the_moment_needs():
    tight, slack = edge_tensions(case_at(10.0), abs(YAW))
    assert tight > slack
    case = case_at(10.0)
    w1, needed = case.rig.span_length * YAW / 3 / case.rig.belt_length, 0.1 * (tight - slack)  # eq. 16 to 18
    share = needed * case.rig.span_length / (4 * case.belt.bending_stiffness * abs(YAW))
    assert abs(RitzingerFormula().steady_rate(case)) == pytest.approx(abs(w1) * share)
    assert tight + slack == pytest.approx(1200.0, rel=0.01)  # the full force in each rope
