"""A machine turned round is the same machine: every effect, in the place where the turn puts it."""

from dataclasses import replace

import numpy as np
import pytest
from paper_cases import RIG, YAW, affected, paper_case

from belt_sim.case import Schedule

EXACT = 1e-9  # of the largest value: marches that must be one
TENSION, HEAD_YAW = 10, 0.6 * YAW
TO_POINT_3 = 2 * RIG.span_length + RIG.wrap_tail
HALF = RIG.span_length + RIG.wrap_tail  # from point 4 to point 2 along the belt
BOTH_ENDS = {
    "taper": {"kappa_t": 1e-5, "kappa_t_head": -4e-6},
    "crown": {"c": 5e-3, "c_head": 2e-3},
    "edge_guide": {"stiffness": 1e5, "stiffness_lower": 3e4, "gap": 2e-4, "at": 4.0},
    "weld": {"angle": 3e-4, "at": 3.0, "length": 0.6},
    "camber": {"kappa_c": 2e-5},
    "slip": {"inverse_friction": 1 / 0.15},
    "soft_cover": {"c": 5e-6},
    "machine_tilt": {"angle": 1e-3},
    "pulley_deflection": {"compliance": 5e-6},
    "traction_loss": {"loss": 0.2, "onset": 0.1},
    "idler_skew": {"force": 0.2, "place": 0.35},
    "idler_skew_lower": {"force": -0.07, "place": 0.25},
    "side_drag": {"moment": 0.3, "place": 0.7},
    "side_drag_lower": {"moment": 0.1, "place": 0.55},
    "thickness_wedge": {"slope": 4e-6},
    "temperature_difference": {"difference": 0.2},
}
ONE_END = {
    "yaw_compliance": {"c_m": 2e-6},
    "yaw_offset_tail": {"beta_0": 5e-5},
    "unequal_tension": {"yaw_per_force": 5e-8},
    "yaw_drift": {"rate": 1e-6, "time_constant": 30.0},
    "taper_drift": {"rate": 2e-7, "time_constant": 60.0},
    "build_up": {"rate": 4e-7},
}
SPANS = {
    "hanging": {
        "sag_roll": {"strength": 1.0},
        "run_up_points": {"share": 1.0},
        "off_centre_load": {"moment": 4e-3},
        "off_centre_load_lower": {"moment": -1.5e-3},
    },
    # hanging spans lift off unlike, the upper from below and the lower above; nor does the roll of a pulley askew turn
    # round with the sag
    "flat": {
        "lift_off": {"strength": 1.0},
        "wobble": {"beta_cos": 1e-4, "beta_sin_head": 7e-5, "radius_error": 3e-3},
    },
}
ASKEW_ELSEWHERE = {"beta_cos": 0.0, "beta_sin_head": 0.0, "radius_error": 0.0} | {
    "beta_cos_head": -1e-4, "beta_sin": -7e-5, "radius_error_head": 3e-3,
}  # fmt: skip

TILTS = {"hanging": 1.0, "flat": -1.0}  # a turned tilt changes sign, and so does what then hangs upwards


def changed(effects, **numbers):
    return effects | {name: effects.get(name, {}) | new for name, new in numbers.items()}


@pytest.fixture(scope="module", params=SPANS)
def turned(request):
    """The same belt run forward; reversed, with what the turn about its long axis exchanges; and with its pulleys
    exchanged."""
    forward = paper_case(TENSION, yaw_head=Schedule.step(HEAD_YAW))
    backward = replace(forward, settings=replace(forward.settings, direction=-1.0))
    exchanged = paper_case(TENSION, -HEAD_YAW, yaw_head=Schedule.step(-YAW))
    both = BOTH_ENDS | SPANS[request.param]
    own = both | ONE_END
    upside_down = changed(
        own,
        edge_guide={"stiffness": 3e4, "stiffness_lower": 1e5},
        weld={"at": TO_POINT_3 - 3.0},
        idler_skew={"force": 0.07, "place": 0.25},
        idler_skew_lower={"force": -0.2, "place": 0.35},
        side_drag={"moment": 0.1, "place": 0.55},
        side_drag_lower={"moment": 0.3, "place": 0.7},
    )
    other_way = changed(
        both,
        taper={"kappa_t": -4e-6, "kappa_t_head": 1e-5},
        crown={"c": 2e-3, "c_head": 5e-3},
        edge_guide={"stiffness": 3e4, "stiffness_lower": 1e5, "at": RIG.span_length - 4.0},
        weld={"at": 3.0 + HALF},
        idler_skew={"force": -0.07, "place": 0.75},
        idler_skew_lower={"force": 0.2, "place": 0.65},
        side_drag={"moment": 0.1, "place": 0.45},
        side_drag_lower={"moment": 0.3, "place": 0.3},
    )
    if "off_centre_load" in both:
        exchanged_loads = {"off_centre_load": {"moment": -1.5e-3}, "off_centre_load_lower": {"moment": 4e-3}}
        upside_down, other_way = (changed(one, **exchanged_loads) for one in (upside_down, other_way))
    if "wobble" in both:
        other_way = changed(other_way, wobble=ASKEW_ELSEWHERE)
    pairs = [(forward, own), (backward, upside_down), (forward, both), (exchanged, other_way)]
    return request.param, affected(pairs, 20.0)


def alike(found, wanted):
    np.testing.assert_allclose(found, wanted, atol=EXACT * np.abs(wanted).max())


@pytest.mark.evidence(
    "camber", "idler_skew_lower", "off_centre_load_lower", "side_drag_lower", "taper", "thickness_wedge",
    route="symmetry", what="turned machines, {EXACT}",
)  # fmt: skip
def test_a_reversed_machine_is_the_forward_one_upside_down(turned):
    """Turned about its long axis: upper and lower, points 1-2 and 3-4 change places, and so do a weld's place and
    the rollers; a yaw, a taper and a bend of the belt change sign together with y."""
    spans, (forward, backward, *_) = turned
    alike(backward.y, forward.y[[1, 0, 3, 2]])
    alike(backward.angle, forward.angle[[1, 0, 3, 2]])
    for name in ("moment", "edge_stress"):
        alike(getattr(backward, name), getattr(forward, name)[::-1])
    alike(backward.tilt, TILTS[spans] * forward.tilt[::-1])


@pytest.mark.evidence("crown", route="symmetry", what="turned machines, {EXACT}")
def test_with_its_pulleys_exchanged_the_machine_is_turned_about_their_axes(turned):
    """Head and tail, upper and lower change places; y stays, and a yaw about +z becomes one about -z."""
    spans, (*_, forward, exchanged) = turned
    alike(exchanged.y, forward.y[[2, 3, 0, 1]])
    alike(exchanged.moment, forward.moment[::-1])
    alike(exchanged.tilt, TILTS[spans] * forward.tilt[::-1])
