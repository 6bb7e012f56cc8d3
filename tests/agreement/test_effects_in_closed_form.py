"""Sizes and signs of effects against formulas derived by other ways than the march."""

from dataclasses import replace

import numpy as np
import pytest
from paper_cases import BELT, RIG, YAW, affected, indicated, marched, paper_case, response, steered

from belt_sim.case import Schedule
from belt_sim.curves import late_rates
from belt_sim.effects.pulley import PulleyDeflection
from belt_sim.effects.sensors import EncoderScale
from belt_sim.effects.span import Shear
from belt_sim.effects.yaw import UnequalTension
from belt_sim.line.march import march_case
from belt_sim.line.runup import FRICTION, sag_angle
from belt_sim.line.span import beam_second_order
from belt_sim.model import analytic_model
from belt_sim.scene_parts import SceneParts
from studies.closed_forms import shelton_factor, taper_gain
from studies.paper.case import ROPE_EXAMPLE

MODEL = analytic_model("beam_th2")
LATE = 2e-3  # a march of some hundred metres against a closed form, at 20 N/mm2 and more
EARLY = 0.03  # a formula for the very start, read at 0.1-0.2 m
TURNED = 5e-3  # a pulley that leans and one that is canted, to second order in the angle of the sag
EXACT = 1e-9  # two marches that must be one
STILL = paper_case(40, 0.0)
HANGING = {"sag_roll": {"strength": 1.0}}  # as in the strip law
HALF = RIG.span_length + RIG.wrap_tail  # half of the belt [m]


def kl(case) -> float:
    return float(np.sqrt(case.tension_force / case.belt.bending_stiffness) * case.rig.span_length)


@pytest.mark.evidence("taper", route="formula", what="late rate of a flat belt, either pulley, both directions, {LATE}")
@pytest.mark.parametrize("where", ["kappa_t", "kappa_t_head"])
def test_taper_moves_the_belt_towards_the_larger_radius(where):
    """w = kappa_t g L^2/(2 (L + pi R)) on either pulley, whatever the direction of travel."""
    size = 2e-5
    cases = [
        replace(c, settings=replace(c.settings, direction=d)) for d in (1.0, -1.0) for c in (STILL, paper_case(20, 0.0))
    ]
    for case, c in zip(cases, affected([(c, {"taper": {where: size}}) for c in cases], 400.0), strict=True):
        wanted = size * float(taper_gain(kl(case))) * RIG.span_length**2 / (2 * HALF)
        np.testing.assert_allclose(late_rates(c), wanted, rtol=LATE)


def test_taper_gain_tends_to_one_sixth():
    assert float(taper_gain(0.05)) == pytest.approx(1 / 6, rel=1e-3)
    assert float(taper_gain(3.0)) < 1 / 6


@pytest.mark.evidence("cant", route="formula", what="late rate by the wrap, {LATE}, both directions")
@pytest.mark.parametrize(("where", "side"), [("gamma", 1.0), ("gamma_head", -1.0)])
def test_cant_lifts_the_belt_along_the_wrap(where, side):
    """On a canted axis y + gamma z is kept: + 2 R gamma from top to bottom, a turn of the belt 2 (L + pi R) long, so
    w = R gamma/(L + pi R); it changes sign with the travel and knows no tension."""
    gamma = 2e-4
    cases = [paper_case(tension, 0.0, direction=direction) for tension in (20, 40) for direction in (1.0, -1.0)]
    for case, c in zip(cases, affected([(case, {"cant": {where: gamma}}) for case in cases], 400.0), strict=True):
        wanted = side * float(case.settings.direction) * gamma * RIG.tail_radius / HALF
        np.testing.assert_allclose(late_rates(c), wanted, rtol=LATE)


@pytest.mark.evidence("cant", route="symmetry", what="late rate of a hanging belt that leans, {LATE}")
def test_a_machine_with_both_axes_canted_leans_the_other_way():
    """Turned about its long axis until both pulleys are level, such a machine is one that leans."""
    lean = 1e-3
    both = {"cant": {"gamma": -lean, "gamma_head": -lean}}, {"machine_tilt": {"angle": lean}}
    cases = [paper_case(tension, 0.0, direction=d) for tension in (7, 40) for d in (1.0, -1.0)]
    curves = affected([(case, HANGING | numbers) for numbers in both for case in cases], 400.0)
    for canted, leaning in zip(curves[:4], curves[4:], strict=True):
        np.testing.assert_allclose(late_rates(canted), late_rates(leaning).mean(), rtol=LATE)
        assert canted.tilt[:, -1].mean() + lean == pytest.approx(leaning.tilt[:, -1].mean(), rel=TURNED)


@pytest.mark.evidence("yaw_offset_tail", route="definition", what="it is a yaw, {EXACT}")
def test_yaw_offsets_are_yaws():
    offset = 3e-4
    tail, head, as_tail, as_head = affected(
        [
            (paper_case(40), {"yaw_offset_tail": {"beta_0": offset}}),
            (paper_case(40), {"yaw_offset_head": {"beta_0": offset}}),
            (paper_case(40, YAW + offset), {}),
            (paper_case(40, YAW, yaw_head=Schedule.step(offset)), {}),
        ],
        50.0,
    )
    np.testing.assert_allclose(tail.y, as_tail.y, atol=EXACT * np.abs(tail.y).max())
    np.testing.assert_allclose(head.y, as_head.y, atol=EXACT * np.abs(head.y).max())


@pytest.mark.evidence("soft_cover", route="definition", what="start faster by 1 + c EI, {EARLY}")
def test_soft_cover_starts_faster_by_its_own_moment():
    """dtheta/ds = -(1 + c EI) kappa: at the start y_1 = (1 + c EI) kappa_0 s^2/2."""
    c = 5e-6
    soft, hard = affected([(paper_case(40), {"soft_cover": {"c": c}}), (paper_case(40), {})], 20.0)
    assert soft.y[0, 1] / hard.y[0, 1] == pytest.approx(1 + c * BELT.bending_stiffness, rel=EARLY)
    assert MODEL.steady_rate(paper_case(40)) == pytest.approx(0.16140e-3, rel=1e-4)


@pytest.mark.evidence("yaw_compliance", route="formula", what="first stand of the pulley, two springs in series")
def test_yaw_compliance_gives_way_to_the_entry_moment():
    """Both spans of a stuck belt hold the tail back by EI k beta each, k = dkappa/dtheta_u: it stands at
    beta/(1 + 2 C EI k) at first, and nearly at beta when the belt has swung in."""
    c_m, case = 2e-5, paper_case(40)
    k = float(response(beam_second_order(case)).runup[2])
    soft, stiff = affected([(case, {"yaw_compliance": {"c_m": c_m}}), (case, {})], 20.0)
    stands = YAW / (1 + 2 * c_m * BELT.bending_stiffness * k)
    assert soft.angle[0, 0] == pytest.approx(stands, rel=1e-9)
    assert soft.y[0, 1] / stiff.y[0, 1] == pytest.approx(stands / YAW, rel=EARLY)


@pytest.mark.evidence("crown", route="formula", what="where the belt comes to rest, {LATE}")
def test_crown_holds_the_belt_where_its_taper_balances_the_yaw():
    """At rest kappa_1 = c y_1 and kappa_3 = 0, no angle against either pulley: y_1 = beta (k_u - k_o)/c."""
    crown, case = 0.05, paper_case(40)
    k = np.asarray(response(beam_second_order(case)).runup)
    held, loose = affected([(case, {"crown": {"c": crown}}), (case, {"crown": {"c": -crown}})], 400.0)
    assert held.y[0, -1] == pytest.approx(YAW * (k[2] - k[1]) / crown, rel=LATE)
    assert abs(loose.y[0, -1]) > 10 * abs(held.y[0, -1])  # a hollow pulley throws the belt off


@pytest.mark.evidence("wobble", route="formula", what="period 2 pi R, no drift")
def test_wobble_repeats_every_turn_and_does_not_drift():
    turns, size = 20, 1e-4
    constant = abs(MODEL.steady_rate(paper_case(40, size)))
    pairs = [(STILL, {"wobble": {name: size}}) for name in ("beta_cos", "beta_sin_head")]
    for c in affected(pairs, turns * 2 * np.pi * RIG.tail_radius):
        waves = np.abs(np.fft.rfft(np.diff(c.y[0])))
        assert 3 + np.argmax(waves[3:]) == turns  # beside the slow swing of the start
    for c in affected(pairs, 400.0):
        assert np.abs(late_rates(c)).max() < 0.02 * constant


@pytest.mark.evidence("tension_bias", route="definition", what="another tension, {EXACT}")
@pytest.mark.evidence(
    "speed_tension",
    route="definition",
    what="another tension, {EXACT}; that rho v^2 does not count is taken from the literature",
)
def test_tension_errors_are_tensions():
    gain, bias, fast, as_gain, as_bias, as_fast = affected(
        [
            (paper_case(20), {"tension_bias": {"gain": 0.1}}),
            (paper_case(20), {"tension_bias": {"bias": 2e6}}),
            (paper_case(20, speed=20.0), {"speed_tension": {"share": 1.0}}),
            (paper_case(22), {}),
            (paper_case(22), {}),
            (paper_case(20 - 7850 * 20.0**2 * 1e-6), {}),
        ],
        50.0,
    )
    for mine, plain in ((gain, as_gain), (bias, as_bias), (fast, as_fast)):
        np.testing.assert_allclose(mine.y, plain.y, atol=EXACT * np.abs(plain.y).max())


def test_sag_roll_on_a_beam_is_the_strip():
    with_effect = affected([(paper_case(7), {"sag_roll": {"strength": 1.0}})], 50.0)[0]
    strip = marched([paper_case(7)], "strip", travel=50.0)[0]
    np.testing.assert_allclose(with_effect.y, strip.y, atol=EXACT * np.abs(strip.y).max())


@pytest.mark.evidence(
    "shear", route="formula", what="first slope after a yaw, {EARLY}; change of the late rate, {EARLY}"
)
@pytest.mark.parametrize("width", [0.2, 0.4])
def test_a_sheared_belt_lands_along_its_middle_line(width):
    """Timoshenko's clamped beam has Q = 6 EI yaw/(L^2 (1 + P)), P = 12 c/L^2, c = n EI/(G A), and lands at P/(2 + 2 P)
    of the yaw at once. Late the moment at the run-up is 0: the middle line gives way by c kappa_o and the landing takes
    that back, so that only the tension counts: w changes by 2 c K^2 (1 - w1)/(2 w1 - 1), K^2 lower by 1 + c K^2.
    """
    case = paper_case(40, rig=ROPE_EXAMPLE)
    case = replace(case, belt=replace(case.belt, width=width))
    length, force, bending = case.rig.span_length, case.tension_force, case.belt.bending_stiffness
    soft = 1.177 * bending / (case.belt.shear_modulus * case.belt.area)
    ratio = 12 * soft / length**2
    effect = (Shear(coefficient=1.177),)
    sheared, plain = (march_case(case, MODEL, e, travel=80.0, step=0.01, keep=0.01) for e in (effect, ()))
    slope = float(sheared.y[0, 1] - plain.y[0, 1]) / float(plain.travel[1])
    assert slope / YAW == pytest.approx(ratio / 2 / (1 + ratio), rel=EARLY)

    def weight(square):
        return float(shelton_factor(np.sqrt(square) * length))

    square = force / bending
    slower = weight(square / (1 + soft * square))
    wanted = (2 * slower - 1 + 2 * soft * square * (1 - slower)) / (2 * weight(square) - 1) - 1
    assert late_rates(sheared)[0] / late_rates(plain)[0] - 1 == pytest.approx(wanted, rel=EARLY)


@pytest.mark.evidence("yaw_backlash", route="definition", what="the yaws that are left, {EXACT}")
def test_play_is_lost_on_the_way_and_again_on_the_way_back():
    half = 1e-4
    there_and_back = Schedule.step(YAW).then(Schedule.step(-YAW, at=10.0))
    as_left = Schedule.step(YAW - half).then(Schedule.step(-(YAW - 2 * half), at=10.0))
    slack, plain = affected(
        [
            (steered(paper_case(40), there_and_back), {"yaw_backlash": {"half": half}}),
            (steered(paper_case(40), as_left), {}),
        ],
        20.0,
    )
    np.testing.assert_allclose(slack.y, plain.y, atol=EXACT * np.abs(plain.y).max())


@pytest.mark.evidence(
    "run_up_points",
    route="definition",
    what="the yaw times cos psi, {EXACT}; psi as in the literature",
)
def test_run_up_points_turn_with_the_cosine_of_the_sag_angle():
    case = paper_case(7)
    psi = float(sag_angle(case))
    assert psi == pytest.approx(62e-3, rel=0.01)
    moved, plain = affected([(case, {"run_up_points": {"share": 1.0}}), (case, {})], 50.0)
    np.testing.assert_allclose(moved.y, plain.y * np.cos(psi), atol=EXACT * np.abs(plain.y).max())


@pytest.mark.evidence("encoder_scale", route="definition", what="rates over 1 + e")
@pytest.mark.parametrize("e", [0.02, -0.02])
def test_encoder_that_shows_more_makes_rates_smaller(e):
    plain = marched([STILL, paper_case(40)], "beam_th2", travel=100.0)[1]
    shown = indicated(plain, paper_case(40), np.arange(91.0), encoder_scale={"e": e})
    np.testing.assert_allclose(late_rates(shown), late_rates(plain) / (1 + e), rtol=0.02)
    assert np.sign(shown.y[0, 45] - plain.y[0, 45]) == -np.sign(e)


def test_a_yaw_is_applied_when_the_encoder_shows_its_travel():
    """What is shown is the record of a belt that was yawed a little earlier or later, over a stretched travel."""
    e, at = 0.03, 6.0
    turned, shown = (steered(paper_case(40), Schedule.ramp(YAW, a, a / 3)) for a in (at / (1 + e), at))
    right, seen = (
        MODEL.run(case, effects, travel=20.0) for case, effects in ((turned, ()), (shown, (EncoderScale(e=e),)))
    )
    for read, belt in zip(seen.y, right.y, strict=True):
        read_where_it_was = np.interp(right.travel[:-10], seen.travel / (1 + e), read)
        np.testing.assert_allclose(read_where_it_was, belt[:-10], atol=2e-3 * np.max(np.abs(belt)))


@pytest.mark.evidence("sensor_gain", route="definition", what="the reading times 1 + g")
@pytest.mark.evidence("sensor_offset", route="definition", what="the reading plus c")
@pytest.mark.evidence("sensor_drift", route="definition", what="the reading plus d t")
def test_sensors_show_gain_offset_and_drift_in_time():
    plain = marched([STILL, paper_case(40)], "beam_th2", travel=100.0)[1]
    numbers = {"sensor_gain": {"g1": 0.1}, "sensor_offset": {"c2": 1e-3}, "sensor_drift": {"d4": 1e-6}}
    shown = indicated(plain, paper_case(40), plain.travel, **numbers)
    np.testing.assert_allclose(shown.y[2], plain.y[2], atol=1e-15)
    np.testing.assert_allclose(shown.y[0], 1.1 * plain.y[0], rtol=1e-12)
    np.testing.assert_allclose(shown.y[1], plain.y[1] + 1e-3, rtol=1e-12)
    np.testing.assert_allclose(shown.y[3], plain.y[3] + 1e-6 * plain.travel / 0.5, atol=1e-15)


@pytest.mark.evidence(
    "edge_profile",
    route="formula",
    what="the order in which a mark passes the points, from the machine's lengths",
)
def test_edge_profile_passes_the_points_in_the_order_of_travel():
    """A mark on the belt that is at point 4 comes to 1, 2 and 3 after a span, a wrap and a span more."""
    for direction in (1.0, -1.0):
        case = paper_case(40, 0.0, direction=direction)
        plain = marched([case], "beam_th2", travel=100.0)[0]
        y = indicated(plain, case, np.arange(10001) * 0.01, edge_profile={"cos1": 1e-3}).y
        at = [np.argmax(row[: int(RIG.belt_length / 0.01)]) * 0.01 for row in y]
        steps = np.array([at[0] - at[3], at[1] - at[0], at[2] - at[1]]) * direction
        np.testing.assert_allclose(
            steps % RIG.belt_length, [RIG.span_length, RIG.wrap_tail, RIG.span_length], atol=0.03
        )


@pytest.mark.evidence("yaw_drift", route="definition", what="a ramp of the yaw")
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_what_grows_with_time_is_followed_by_the_tail_pulley(direction):
    """tau = infinity: a ramp of the yaw; a pulley that has crept to its end stands there for good. 20 m take 40 s."""
    rate, end = 4e-6, 2e-4
    still = paper_case(40, 0.0, direction=direction)
    ramp = steered(still, Schedule.ramp(rate * 40.0, at=0.0, over=20.0))
    linear, ramped, crept, stands = affected(
        [
            (still, {"yaw_drift": {"rate": rate}}),
            (ramp, {}),
            (still, {"yaw_drift": {"rate": end / 0.05, "time_constant": 0.05}}),
            (steered(still, Schedule.step(end)), {}),
        ],
        20.0,
    )
    np.testing.assert_allclose(linear.y, ramped.y, atol=2e-3 * np.abs(ramped.y).max())
    np.testing.assert_allclose(crept.y, stands.y, atol=5e-3 * np.abs(stands.y).max())


@pytest.mark.evidence("taper_drift", route="definition", what="it ends as a taper")
def test_tapers_that_grow_with_time_or_travel_are_tapers_in_the_end():
    """A taper that stands at once is the plain one; a growing one lags it, by time or by travel alike at one speed."""
    still, end, rate = paper_case(20, 0.0), 2e-5, 5e-7
    at_once, taper, with_travel, with_time, fast = affected(
        [
            (still, {"taper_drift": {"rate": end / 0.05, "time_constant": 0.05}}),
            (still, {"taper": {"kappa_t": end}}),
            (still, {"build_up": {"rate": rate}}),
            (still, {"taper_drift": {"rate": 0.5 * rate}}),
            (paper_case(20, 0.0, speed=1.0), {"taper_drift": {"rate": rate}}),
        ],
        20.0,
    )
    size = np.abs(taper.y).max()
    np.testing.assert_allclose(at_once.y, taper.y, atol=5e-3 * size)
    np.testing.assert_allclose(with_travel.y, with_time.y, atol=2e-3 * np.abs(with_travel.y).max())
    np.testing.assert_allclose(fast.y, with_time.y, atol=2e-3 * np.abs(with_time.y).max())
    assert 0 < with_travel.y[0, -1] < taper.y[0, -1]  # towards the larger radius


@pytest.mark.evidence("pulley_deflection", route="formula", what="where the belt comes to rest, {LATE}")
def test_on_bent_pulleys_the_belt_rests_where_their_axes_are_parallel():
    """Axes of curvature k are yawed by beta - k y at the tail and +k y at the head: parallel at y = beta/2k.

    The straight span between stands square to both: its ends lie (beta/2)/(k + 2/L) to either side of that.
    """
    bow, case = 0.12, paper_case(40)
    (bent,) = affected([(case, {"pulley_deflection": {"compliance": bow / float(case.tension_force)}})], 400.0)
    assert bent.y[[0, 2], -1].mean() == pytest.approx(YAW / (2 * bow), rel=LATE)
    aside = YAW / 2 / (bow + 2 / case.rig.span_length) * np.array([1.0, 1.0, -1.0, -1.0])
    np.testing.assert_allclose(bent.y[:, -1] - YAW / (2 * bow), aside, rtol=LATE)
    assert np.abs(late_rates(bent)).max() < 1e-3 * MODEL.steady_rate(case)


@pytest.mark.evidence("pulley_deflection", route="symmetry", what="far off the middle a yaw of both pulleys, {EXACT}")
def test_far_off_the_middle_a_bent_pulley_is_a_yawed_one():
    """What keeps its radius is only yawed: at y0 >> y by -k y0 the tail, by +k y0 the head pulley."""
    y0, turned, case = 1e7, 2e-4, paper_case(40)
    off = replace(case, settings=replace(case.settings, y0=y0))
    bow = turned / y0 / float(case.tension_force)
    yawed = {"yaw_offset_tail": {"beta_0": -turned}, "yaw_offset_head": {"beta_0": turned}}
    bent, as_yawed = affected([(off, {"pulley_deflection": {"compliance": bow}}), (case, yawed)], 50.0)
    np.testing.assert_allclose(bent.y, as_yawed.y, atol=EXACT * np.abs(as_yawed.y).max())
    parts = PulleyDeflection(compliance=bow).scene(SceneParts.from_case(off), off)
    assert (parts.tail.yaw_offset, parts.head.yaw_offset) == pytest.approx((-turned, turned))


def test_where_the_belt_lay_at_first_counts_on_a_crown_and_between_guides():
    """A crown at y0 is a taper -c y0 besides; guides are y0 nearer on one side; what does not ask for it feels none."""
    y0, c, case = 4e-3, 0.02, paper_case(40)
    off = replace(case, settings=replace(case.settings, y0=y0))
    guide = {"stiffness": 1e6, "gap": 5e-3, "at": 2.0}
    crowned, tapered, guided, moved, plain = affected(
        [
            (off, {"crown": {"c": c}}),
            (case, {"crown": {"c": c}, "taper": {"kappa_t": -c * y0}}),
            (off, {"edge_guide": guide}),
            (case, {"edge_guide": guide}),
            (off, {"taper": {"kappa_t": 1e-5}}),
        ],
        50.0,
    )
    np.testing.assert_allclose(crowned.y, tapered.y, atol=EXACT * np.abs(tapered.y).max())
    assert guided.y[0].max() < 0.5 * moved.y[0].max()
    taper = affected([(case, {"taper": {"kappa_t": 1e-5}})], 50.0)[0]
    np.testing.assert_array_equal(plain.y, taper.y)


@pytest.mark.evidence("thickness_wedge", route="formula", what="late rate of a flat belt, both directions, {LATE}")
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_belt_that_is_thicker_at_one_edge_climbs_to_that_side(direction):
    """Its middle surface is half its thickness out, a cone (dh/dy)/2R on either pulley: twice a taper's late rate."""
    slope, case = 1e-5, paper_case(40, 0.0, direction=direction)
    own, over = affected([(case, {"thickness_wedge": {"slope": s}}) for s in (slope, -slope)], 400.0)
    gain = float(taper_gain(kl(case))) * RIG.span_length**2 / (2 * HALF)
    np.testing.assert_allclose(late_rates(own), 2 * slope / (2 * RIG.tail_radius) * gain, rtol=LATE)
    np.testing.assert_array_equal(over.y, -own.y)  # the belt turned over


@pytest.mark.evidence("thickness_wedge", route="definition", what="a taper of each pulley by its own radius, {EXACT}")
@pytest.mark.evidence("temperature_difference", route="definition", what="a camber alpha dT/b, {EXACT}")
def test_what_the_belt_carries_acts_as_a_taper_or_a_camber():
    rig = replace(RIG, tail_radius=0.12)
    case, slope = paper_case(10, 0.0, rig), 1e-5
    taper = {"kappa_t": slope / 0.24, "kappa_t_head": slope / 0.34}
    several = (
        {"thickness_wedge": {"slope": slope}},
        {"taper": taper},
        {"temperature_difference": {"difference": -2.0}},
        {"camber": {"kappa_c": 1.2e-5 * 2.0 / BELT.width}},
    )
    wedge, tapered, warm, bent = affected([(case, HANGING | numbers) for numbers in several], 20.0)
    np.testing.assert_allclose(wedge.y, tapered.y, atol=EXACT * np.abs(tapered.y).max())
    np.testing.assert_allclose(warm.y, bent.y, atol=EXACT * np.abs(bent.y).max())
    assert np.abs(bent.y).max() > 1e-5


def test_a_guide_pushes_no_harder_than_friction_on_the_pulleys_bears():
    """Close behind a run-off a hard roller meets belt that the pulley holds: at most pi mu F, and no run-away."""
    case = paper_case(10)
    (behind,) = affected([(case, {"edge_guide": {"stiffness_lower": 1e7, "gap": 1e-3, "at": 0.25}})], 100.0)
    assert np.abs(behind.y).max() < 0.02  # [m]
    grip = FRICTION * np.pi * float(case.tension_force)
    assert np.abs(behind.moment[1]).max() < grip * 0.25  # [N m], an arm as long as the guide is away


@pytest.mark.evidence(
    "traction_loss",
    route="definition",
    what="rate of a rope that follows a share of its angle, 2 %; that a film acts so is assumed",
)
def test_a_film_slows_a_tight_belt_as_a_rope_says():
    """A share f of the contact angle: w = f (beta - (y_1 - y_4)/L), so w = beta/(2 (1/f + pi R/L)) of a rope."""
    case, loss, onset = paper_case(3000, speed=0.7), 0.5, 0.3
    f = 1 - loss * (0.7 - onset)
    lost, kept, below = affected(
        [(case, {"traction_loss": {"loss": loss, "onset": o}}) for o in (onset, 0.7, 5.0)], 400.0
    )
    np.testing.assert_array_equal(kept.y, below.y)
    ratio = (1 + float(RIG.wrap_tail / RIG.span_length)) / (1 / f + float(RIG.wrap_tail / RIG.span_length))
    np.testing.assert_allclose(late_rates(lost) / late_rates(kept), ratio, rtol=0.02)


@pytest.mark.evidence("unequal_tension", route="definition", what="a yaw in proportion to the force, {EXACT}")
def test_unequal_tension_is_a_yaw_in_proportion_to_the_force():
    per_force, pairs = 1e-7, []
    for tension in (20, 40):
        case = paper_case(tension)
        pairs += [
            (case, {"unequal_tension": {"yaw_per_force": per_force}}),
            (paper_case(tension, YAW + per_force * float(case.tension_force)), {}),
        ]
    curves = affected(pairs, 50.0)
    for mine, plain in (curves[:2], curves[2:]):
        np.testing.assert_allclose(mine.y, plain.y, atol=EXACT * np.abs(plain.y).max())
    parts = UnequalTension(yaw_per_force=per_force).scene(SceneParts.from_case(case), case)
    assert parts.tail.yaw_offset == pytest.approx(per_force * float(case.tension_force))
    assert parts.head.yaw_offset == 0.0


@pytest.mark.evidence("sensor_delay", route="definition", what="the reading of before")
def test_a_late_sensor_shows_the_belt_and_its_edge_as_they_were():
    delay, case = 0.4, paper_case(40)
    plain = marched([STILL, case], "beam_th2", travel=100.0)[1]
    shown = indicated(plain, case, plain.travel, sensor_delay={"delay": delay})
    back = delay * 0.5  # a fifth of the distance between two records
    late = np.array([np.interp(plain.travel - back, plain.travel, row) for row in plain.y])
    np.testing.assert_allclose(shown.y, late, atol=2e-3 * np.abs(plain.y).max())
    np.testing.assert_allclose(shown.tilt, plain.tilt, atol=1e-15)
    mark = {"edge_profile": {"cos1": 1e-3, "sin3": 5e-4}}
    edges, both = (
        indicated(plain, case, plain.travel, **mark, **more).y for more in ({}, {"sensor_delay": {"delay": delay}})
    )
    there = indicated(plain, case, plain.travel - back, **mark)
    np.testing.assert_allclose(
        (both - shown.y)[:, 1:], (there.y - late)[:, 1:], atol=2e-3 * 1e-3 + 2e-3 * np.abs(plain.y).max()
    )
    assert np.abs(both - edges).max() > 1e-4
