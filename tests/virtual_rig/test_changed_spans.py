"""Faults that change a span: EI, T, Z and F by factors, in places, with time, with what the belt does."""

from dataclasses import replace

import numpy as np
import pytest
from virtual_bench import ARC, SPAN, YAW, measured, plan_of

from belt_sim.virtual_rig.hidden import SPAN_FAULTS as NAMES
from belt_sim.virtual_rig.hidden import UNMODELLED, fault_class
from belt_sim.virtual_rig.line import DOUBLINGS, RUN_OFF, RUN_UP, TILT, Sections
from belt_sim.virtual_rig.march import TrueErrors, observe, true_line
from belt_sim.virtual_rig.plan import RunSetting

ROUNDING = 1e-9  # relative, of two ways to eliminate the same nodes
STEP = 1e-7  # [m]: far below what the faults do here, tenths of a millimetre


def line_of(**setting):
    return true_line(plan_of(RunSetting(**({"tension": 10e6, "yaw": YAW} | setting))), "strip", TrueErrors())


def change(name: str, parameters: dict, **run) -> tuple[np.ndarray, np.ndarray]:
    run = {"base": "strip", "tension": 10e6} | run
    s, y = measured(fault_class(name)(**parameters), **run)
    return s, y - measured(**run)[1]


@pytest.mark.parametrize(
    ("factors", "field", "power"),
    [({"bending": 0.5}, "youngs_modulus", 1.0), ({"sag": 2.0}, "gravity", 1.0)],
)
def test_a_factor_all_along_is_another_belt(factors, field, power):
    line = line_of()
    factor = next(iter(factors.values()))
    other = replace(line, **{field: getattr(line, field) * factor})
    torsion = other.torsion / line.torsion  # of a belt of half the modulus, its shear too
    got = line.span(sections=Sections(**factors, torsion=torsion))[0]
    np.testing.assert_allclose(got, other.span()[0], rtol=ROUNDING, atol=1e-9)


def test_elements_count_from_the_run_off():
    line, soft = line_of(tension=40e6), np.ones((1, 2**DOUBLINGS))
    soft[:, -3:] = 0.5
    up, off = (line.span(sections=Sections(bending=f))[0] for f in (soft, soft[:, ::-1]))
    mirrored = off[RUN_OFF, [2, 3, 0, 1]] * [[1], [-1], [1], [-1]]
    np.testing.assert_allclose(up[RUN_UP], mirrored, rtol=ROUNDING)
    assert abs(up[RUN_UP, 3, 0]) > 1.2 * abs(line.span()[0][RUN_UP, 3, 0])  # the bend goes where it is easy


def test_a_spring_at_mid_span_stops_the_roll_there():
    held, _ = line_of().span(sections=Sections(roll_spring=1e9))
    assert np.abs(held[TILT]).max() < 1e-6 * np.abs(line_of().span()[0][TILT]).max()


@pytest.mark.parametrize("name", NAMES)
def test_no_torsion_acts_on_a_belt_that_does_not_roll(name):
    cls = UNMODELLED[name]
    typical = {n: size.typical for n, size in cls.sizes.items()}
    acts = np.abs(change(name, typical, base="beam_th2", tension=7e6, length=20.0)[1]).max() > 0
    assert acts == ("beam_th2" not in cls.idle_on)


def test_fatigue_begins_at_nothing_and_grows():
    s, more = change("fatigue_cracks", {"rate": 5e-3}, base="beam_th2")
    assert np.abs(more[0, s < 0.3]).max() < STEP
    assert np.abs(more[0, -1]) > np.abs(more[0, len(s) // 2]) > 10 * STEP


def test_cracks_open_to_one_side():
    """Mirrored yaw with mirrored cracks is the mirror image; with the same cracks it is not."""
    one = change("edge_cracks", {"share": 0.5})[1]
    np.testing.assert_allclose(change("edge_cracks", {"share": 0.5, "sign": -1.0}, yaw=-YAW)[1], -one, atol=STEP * 1e-3)
    assert np.abs(change("edge_cracks", {"share": 0.5}, yaw=-YAW)[1] + one).max() > 10 * STEP


def test_a_stiffer_span_at_twice_the_yaw_is_more_than_twice():
    half, whole = (change("span_stiffening", {"c": 0.5, "bend": 5e-3}, yaw=y)[1] for y in (YAW / 2, YAW))
    assert np.abs(whole).max() == pytest.approx(8 * np.abs(half).max(), rel=0.1)  # the cube


def test_a_tight_belt_has_no_slack_edge_and_no_contact():
    for name, parameters in (("one_long_edge", {"amplitude": 9e6}), ("support_roller", {"stiffness": 100.0})):
        assert np.abs(change(name, parameters, tension=60e6)[1]).max() < STEP
    assert np.abs(change("one_long_edge", {"amplitude": 3e7})[1]).max() > 10 * STEP


def test_the_joint_acts_while_it_is_in_the_span_that_it_softens():
    """It passes the span to the tail from 0 to 11.28 m of its way, and comes again a belt length later."""
    line, joint = line_of(), fault_class("soft_joint")(share=0.5, at=0.0, stretch=0.2)
    ends = (np.zeros((2, 1)), np.zeros((2, 1)))
    np.testing.assert_allclose(joint.span_state(SPAN / 2, line, True, ends), 0.5)
    np.testing.assert_allclose(joint.span_state(SPAN / 2 + SPAN + ARC, line, False, ends), 0.5)
    np.testing.assert_allclose(joint.span_state(SPAN / 2 + 2 * (SPAN + ARC), line, True, ends), 0.5)
    assert joint.sections(0.5, line, None).bending[0, 2 ** (DOUBLINGS - 1)] == pytest.approx(0.5, abs=0.01)
    assert np.all(joint.sections(1.25, line, None).bending == 1.0)


def test_the_slack_side_changes_with_the_way_the_belt_runs():
    forwards, backwards = (change("slack_side", {"share": 0.3}, direction=d)[1] for d in (1.0, -1.0))
    np.testing.assert_allclose(backwards[[1, 0, 3, 2]], forwards, atol=STEP * 1e-3)


def test_what_lost_half_its_tension_runs_and_tilts_as_a_belt_of_half_the_tension():
    plan = replace(plan_of(RunSetting(tension=10e6, yaw=YAW)), signals={"y1": "point_1", "phi": "upper_mid_span"})
    line, lost = true_line(plan, "strip", TrueErrors()), fault_class("ratchet_slip")(share=0.5, at=-5.0)
    half = observe(plan, replace(line, stress=line.stress / 2), [])
    np.testing.assert_allclose(observe(plan, line, [lost]), half, atol=STEP * 1e-3)
