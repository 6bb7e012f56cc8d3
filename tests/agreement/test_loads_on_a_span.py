"""What loads on a span do, against finite elements, a tilted frame of reference, a rope and a machine turned round."""

from dataclasses import replace

import numpy as np
import pytest
from loaded_strip import LoadedStrip
from paper_cases import RIG, YAW, affected, paper_case, response

from belt_sim.case import Schedule
from belt_sim.curves import late_rates
from belt_sim.effects.span import IdlerSkew, MachineTilt, OffCentreLoad, Shear, SideDrag
from belt_sim.errors import CannotRepresent
from belt_sim.line.march import march_case
from belt_sim.line.span import (
    beam_first_order,
    beam_second_order,
    load_response,
    sag_softening,
    span_fields,
    strip,
)
from belt_sim.model import analytic_model
from studies.closed_forms import sievers_coefficients
from studies.paper.case import ROPE_EXAMPLE

ELEMENTS = 1e-5  # forty cubic elements
FIELDS = 1e-5  # Simpson's rule on 65 places
EXACT = 1e-9  # of the largest value: marches that must be one
LATE = 5e-3  # a march of 400 m against a closed form
SHARES = [0.1, 0.37, 0.5, 0.8]
HALF = RIG.span_length + RIG.wrap_tail


def found(push):
    return [float(push.runup), float(push.runoff), float(push.tilt)]


def agree(push, elements):
    wanted = np.array(elements)
    np.testing.assert_allclose(found(push)[:2], wanted[:2], atol=ELEMENTS * np.abs(wanted[:2]).max())
    assert found(push)[2] == pytest.approx(wanted[2], rel=20 * ELEMENTS, abs=1e-9)


@pytest.mark.evidence("idler_skew", route="elements", what="end moments and tilt of a loaded span, {ELEMENTS}")
@pytest.mark.evidence("side_drag", route="elements", what="end moments and tilt of a span under a couple, {ELEMENTS}")
@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize(("law", "tension"), [(beam_second_order, 40.0), (strip, 7.0), (strip, 20.0)])
def test_a_force_and_a_couple_at_a_place_do_what_elements_say(law, tension, share):
    span = law(paper_case(tension))
    elements, fields = LoadedStrip.of(span), span_fields(span)
    x = share * elements.length
    agree(load_response(span, "force", fields, share), elements.held(elements.point_work(x, force=1.0)))
    agree(load_response(span, "couple", fields, share), elements.held(elements.point_work(x, couple=1.0)))


@pytest.mark.evidence("off_centre_load", route="elements", what="spread rolling couple on a span, {ELEMENTS}")
@pytest.mark.evidence("machine_tilt", route="elements", what="even side load on a span, {ELEMENTS}")
@pytest.mark.parametrize(("law", "tension"), [(beam_second_order, 40.0), (strip, 7.0), (strip, 20.0)])
def test_spread_loads_do_what_elements_say(law, tension):
    span = law(paper_case(tension))
    elements, fields = LoadedStrip.of(span), span_fields(span)
    agree(load_response(span, "spread_force", fields), elements.held(elements.spread_work(force=1.0)))
    agree(load_response(span, "spread_roll", fields), elements.held(elements.spread_work(roll=1.0)))


@pytest.mark.evidence("side_drag", route="formula", what="end moments, textbook, {FIELDS}")
@pytest.mark.parametrize("share", SHARES)
def test_a_stiff_beam_bears_loads_like_the_textbook(share):
    """Clamped ends, end moments from the tables: P a^2 b L and P a b^2 L, C a (2 - 3 a) and C b (3 b - 2), q L^2/12."""
    span = beam_first_order(paper_case(40))
    fields, length, bending = span_fields(span), float(span.length), float(span.bending)
    a, b = share, 1.0 - share
    wanted = {"force": (a * a * b * length, a * b * b * length), "couple": (-a * (3 * a - 2), b * (3 * b - 2))}
    for load, (runup, runoff) in wanted.items():
        push = load_response(span, load, fields, share)
        assert bending * push.runup == pytest.approx(runup, rel=FIELDS)
        assert bending * push.runoff == pytest.approx(runoff, rel=FIELDS)
    even = load_response(span, "spread_force", fields)
    assert bending * even.runup == pytest.approx(length**2 / 12, rel=FIELDS)
    assert bending * even.runoff == pytest.approx(length**2 / 12, rel=FIELDS)


@pytest.mark.evidence("shear", route="formula", what="clamped beam under yaw, force and couple, textbook, {FIELDS}")
@pytest.mark.parametrize("share", SHARES)
def test_a_sheared_beam_bears_ends_and_loads_like_the_textbook(share):
    """Timoshenko's clamped beam, P = 12 n EI/(G A L^2): 4 + P and 2 - P over 1 + P; at x = a L a couple C brings the
    side force 6 C a b/(L (1 + P)), a force moments that differ by a b (a - b)/(1 + P)."""
    case = paper_case(40, rig=ROPE_EXAMPLE)
    span = Shear(coefficient=1.2).span(beam_first_order(case), case)
    length, bending = float(span.length), float(span.bending)
    ratio = 12 * 1.2 * bending / (case.belt.shear_modulus * case.belt.area * length**2)
    answer, fields, a, b = response(span), span_fields(span), share, 1.0 - share
    near, far = (4 + ratio) / (1 + ratio), (2 - ratio) / (1 + ratio)
    np.testing.assert_allclose(answer.runup[1:3] * length, [far, near], rtol=FIELDS)
    np.testing.assert_allclose(answer.runup[0] * length**2, -6 / (1 + ratio), rtol=FIELDS)
    force, couple = load_response(span, "force", fields, share), load_response(span, "couple", fields, share)
    side_force = bending * (couple.runup - couple.runoff) / length + couple.side_force
    assert side_force == pytest.approx(6 * a * b / (1 + ratio) / length, rel=FIELDS)
    differ = bending * (force.runup - force.runoff) / length
    assert differ == pytest.approx(a * b * (a - b) / (1 + ratio), rel=FIELDS, abs=FIELDS)


@pytest.mark.evidence("machine_tilt", route="formula", what="a level machine with canted ends, {FIELDS}")
@pytest.mark.parametrize("tension", [7.0, 40.0])
def test_a_tilted_machine_is_a_level_one_with_canted_ends(tension):
    """Seen with gravity straight down, a machine that leans by a has no side load, but its ends are rolled by -a, and
    their slopes Z L/2 out of the plane turn into -a Z L/2 and + a Z L/2 in it."""
    case, lean = paper_case(tension), 1e-3
    span = strip(case)
    rolled, leaning = -lean, lean * float(span.sag_curvature * span.length) / 2
    ends = np.array([0.0, -leaning, leaning, rolled, rolled])
    answer = response(span)
    side_load = lean * float(case.weight_per_length)
    push = load_response(span, "spread_force", span_fields(span))
    assert side_load * push.runup == pytest.approx(float(answer.runup @ ends), rel=FIELDS)
    assert side_load * push.runoff == pytest.approx(float(answer.runoff @ ends), rel=FIELDS)
    assert side_load * push.tilt == pytest.approx(float(answer.mid_tilt @ ends) + lean, rel=1e-4, abs=1e-9)


@pytest.mark.evidence("machine_tilt", route="formula", what="late rate from tabled end moments, {LATE}")
def test_a_belt_on_a_tilted_machine_climbs_as_tabled_end_moments_say():
    """Clamped beam under tension and even load: end moments q'/K^2 (u coth u - 1), u = KL/2; they vanish when the belt
    climbs by w = q'/F (u coth u - 1) L^2/(f1 (L + pi R)), f1 of Sievers, whatever the direction of travel."""
    lean, pairs, wanted = 1e-2, [], []
    for tension, direction in ((20, 1.0), (40, -1.0), (3000, 1.0)):
        case = paper_case(tension, 0.0, direction=direction)
        force, length = float(case.tension_force), float(RIG.span_length)
        kl = np.sqrt(force / case.belt.bending_stiffness) * length
        ends = kl / 2 / np.tanh(kl / 2) - 1
        share = lean * float(case.weight_per_length) / force
        wanted.append(share * ends * length**2 / float(sievers_coefficients(kl)[0]) / float(HALF))
        pairs.append((case, {"machine_tilt": {"angle": lean}}))
    for w, c in zip(wanted, affected(pairs, 400.0), strict=True):
        np.testing.assert_allclose(late_rates(c), w, rtol=LATE)


@pytest.mark.evidence("idler_skew", route="formula", what="late rate of a tight belt as of a rope, 10 %")
def test_a_load_at_one_place_makes_a_tight_belt_run_where_it_pushes():
    """A rope under P at a share a from the head: it reaches the tail a P/F less steeply and leaves the head the more,
    so w = a P/F / (2 (1 + pi R/L)), stiffer ends apart; a couple on a rope does nothing late but through its ends."""
    case, push, place = paper_case(3000, 0.0), 10.0, 0.7
    forward, backward = (
        late_rates(c)
        for c in affected(
            [
                (
                    replace(case, settings=replace(case.settings, direction=d)),
                    {"idler_skew": {"force": push, "place": p}},
                )
                for d, p in ((1.0, place), (-1.0, 1.0 - place))
            ],
            400.0,
        )
    )
    rope = place * push / float(case.tension_force) / (2 * float(HALF / RIG.span_length))
    np.testing.assert_allclose(forward, rope, rtol=0.1)
    np.testing.assert_allclose(backward, -forward, rtol=1e-6)


MIRRORED = {
    "idler_skew": ({"force": 2.0, "place": 0.3}, {"force": 2.0, "place": 0.7}),
    "side_drag": ({"moment": 1.5, "place": 0.3}, {"moment": -1.5, "place": 0.7}),
    "off_centre_load": ({"moment": 0.02}, {"moment": -0.02}),
    "machine_tilt": ({"angle": 2e-3}, {"angle": -2e-3}),
}


@pytest.mark.evidence("idler_skew", "side_drag", route="symmetry", what="machine turned about the vertical, {EXACT}")
@pytest.mark.parametrize("name", MIRRORED)
def test_a_machine_turned_about_the_vertical_is_the_same_machine(name):
    """Head and tail change places, the upper span stays above and runs the other way; y and tapers change sign."""
    here, there = MIRRORED[name]
    hanging = {"sag_roll": {"strength": 1.0}}
    forward = paper_case(10, YAW, yaw_head=Schedule.step(0.4 * YAW))
    turned = paper_case(10, 0.4 * YAW, yaw_head=Schedule.step(YAW), direction=-1.0)
    one, other = affected([(forward, hanging | {name: here}), (turned, hanging | {name: there})], 20.0)
    np.testing.assert_allclose(other.y, -one.y[[3, 2, 1, 0]], atol=EXACT * np.abs(one.y).max())
    np.testing.assert_allclose(other.tilt, -one.tilt, atol=EXACT * np.abs(one.tilt).max())


def test_a_load_on_the_upper_span_starts_the_belt_where_it_runs_up():
    """The run-up of the upper span is bent at once, that of the lower one not; a couple's end moment changes its sign
    at two thirds of the span, a force's never."""
    case = paper_case(40, 0.0)
    loads = [
        {name: {size: 1.0, "place": p}}
        for name, size in (("side_drag", "moment"), ("idler_skew", "force"))
        for p in (0.5, 0.8)
    ]
    curves = affected([(case, load) for load in loads], 20.0)
    for c in curves:
        assert abs(c.y[0, 2]) > 100 * abs(c.y[2, 2])
    assert [np.sign(c.y[0, 2]) for c in curves] == [1.0, -1.0, 1.0, 1.0]


@pytest.mark.evidence("off_centre_load", route="formula", what="tilt of mid-span by torsion and bending, 5 %")
def test_a_loaded_side_sinks():
    """By torsion alone w e L^2/8T; in-plane bending, which rolling brings to a hanging span, holds the rest."""
    case = paper_case(10, 0.0)
    curves = march_case(case, analytic_model("strip"), (OffCentreLoad(moment=0.02),), travel=1.0)
    span = strip(case)
    alone = -0.02 * float(span.length**2 / span.torsion) / 8
    assert curves.tilt[0, 0] == pytest.approx(alone / (1 + sag_softening(case)), rel=0.05)
    assert abs(curves.tilt[1, 0]) < 1e-12


def test_a_beam_refuses_what_acts_through_the_roll():
    with pytest.raises(CannotRepresent, match="beam_th2 do not hang, and off_centre_load"):
        march_case(paper_case(10), analytic_model("beam_th2"), (OffCentreLoad(moment=0.1),), travel=1.0)
    for effect in (MachineTilt(angle=1e-3), IdlerSkew(force=1.0), SideDrag(moment=1.0)):
        analytic_model("beam_th2").admit((effect,))
