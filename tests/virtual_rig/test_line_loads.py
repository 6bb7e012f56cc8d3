"""Loads on the spans: against the strip's equations by a matrix exponential, in limit cases, and turned round."""

import numpy as np
import pytest
from scipy.linalg import expm
from virtual_bench import SPAN, YAW, measured, plan_of

from belt_sim.virtual_rig.faults import (
    EdgeGuideFault,
    IdlerSkewFault,
    MachineTiltFault,
    OffCentreLoadFault,
    SideDragFault,
)
from belt_sim.virtual_rig.line import RUN_UP, TILT, unit_load
from belt_sim.virtual_rig.march import TrueErrors, observe, true_line
from belt_sim.virtual_rig.plan import Plan, RunSetting

EXACT = 1e-5  # relative: 64 cubic elements a span
TILTED = 1e-4
BENDING = 42000.0
WEIGHT = 7850 * 9.81 * 0.2 * 3e-4  # [N/m]


def line_from(base: str, tension: float = 10e6, direction: float = 1.0):
    return true_line(plan_of(RunSetting(tension=tension, yaw=YAW, direction=direction)), base, TrueErrors())


def ends_of(line, jump, at, spread) -> tuple[float, float, float]:
    """Curvature at run-up and run-off and tilt at mid-span: state y, y', kappa, kappa', phi, phi' between held ends.

    jump, shape (6,), at the place ``at``; spread, shape (6,), per metre all along.
    """
    names = ("bending", "force", "sag_curvature", "torsion", "span_length")
    bending, force, z, torsion, length = (getattr(line, n).item() for n in names)
    z *= line.sag_roll.item()
    m = np.zeros((7, 7))
    m[0, 1] = m[1, 2] = m[2, 3] = m[4, 5] = 1.0
    m[1, 4], m[3, 2], m[3, 4], m[5, 2] = -z, force / bending, -force / bending * z, bending * z / torsion
    m[:6, 6] = spread
    kick = np.append(jump, 0.0)

    def at_end(x, start):
        return expm(m * x) @ start + (expm(m * (x - at)) @ kick if x > at else 0.0)

    held, open_ = [0, 1, 4], [2, 3, 5]
    blank = at_end(length, np.eye(7)[6])
    start = np.eye(7)[6]
    start[open_] = np.linalg.solve(expm(m * length)[np.ix_(held, open_)], -blank[held])
    return at_end(length, start)[2], start[2], at_end(length / 2, start)[4]


@pytest.mark.parametrize("base", ["beam_th2", "strip"])
@pytest.mark.parametrize("share", [0.2, 0.5, 0.83])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_forces_and_couples_are_what_the_equations_say(base, share, direction):
    """EI kappa' jumps by a force towards +y, EI kappa falls by a couple that turns y' upwards."""
    line = line_from(base, direction=direction)
    along = (share if direction > 0 else 1 - share) * SPAN
    for couple, place in ((False, 3), (True, 2)):
        jump = np.zeros(6)
        jump[place] = 1 / BENDING if place == 3 else -1 / BENDING
        found, wanted = (
            unit_load(line, True, "couple" if couple else "force", share),
            ends_of(line, jump, along, np.zeros(6)),
        )
        assert found.adds[:2, 0].tolist() == pytest.approx(wanted[:2], rel=EXACT)
        assert found.adds[TILT].item() == pytest.approx(wanted[2], rel=TILTED, abs=1e-12)


@pytest.mark.parametrize("base", ["beam_th2", "strip"])
def test_spread_loads_are_what_the_equations_say(base):
    """EI kappa'' = F y'' + p, and T phi'' = EI Z kappa - m for a couple m that lifts the side y > 0."""
    line = line_from(base)
    for roll, place, size in ((False, 3, 1 / BENDING), (True, 5, -1 / line.torsion.item())):
        spread = np.zeros(6)
        spread[place] = size
        found, wanted = (
            unit_load(line, True, "spread_roll" if roll else "spread_force"),
            ends_of(line, np.zeros(6), 2 * SPAN, spread),
        )
        assert found.adds[:2, 0].tolist() == pytest.approx(wanted[:2], rel=EXACT, abs=1e-15)
        assert found.adds[TILT].item() == pytest.approx(wanted[2], rel=TILTED, abs=1e-15)


def test_a_couple_is_two_forces_ahead_and_behind():
    """Towards +y ahead and towards -y behind turns y' upwards: as drag on the edge y > 0 does, r x F > 0."""
    line, apart = line_from("strip"), 1e-3
    ahead, behind = (unit_load(line, True, "force", 0.4 + side * apart / 2) for side in (1, -1))
    pair = (ahead.adds - behind.adds) / (apart * SPAN)
    assert unit_load(line, True, "couple", 0.4).adds == pytest.approx(pair, rel=1e-4)


def test_a_leaning_machine_bends_both_run_ups_as_clamped_beams():
    """At low sag and tension: kappa = q a L^2/(12 EI), so both run-ups go as + kappa s^2/2, with the bow."""
    kl2 = 12 * 1e5 / 210e9 / 0.04 * SPAN**2
    s, y = measured(MachineTiltFault(angle=1e-2), yaw=0.0, tension=1e5, length=0.2, spacing=0.05)
    expected = 1e-2 * WEIGHT * SPAN**2 / (12 * BENDING) * s**2 / 2
    np.testing.assert_allclose(y[[0, 2]], np.stack([expected, expected]), rtol=0.02 + kl2, atol=1e-12)


def tilt_of(*faults, base="strip", **setting) -> float:
    setting = {"tension": 4e6, "yaw": 0.0} | setting
    plan = Plan(runs=(RunSetting(**setting),), length=0.01, spacing=0.01, signals={"phi": "upper_mid_span"})
    return observe(plan, true_line(plan, base, TrueErrors()), faults)[0, -1, 0]


def test_a_slack_belt_rolls_with_the_gravity_of_a_leaning_machine():
    """The surface stands square to gravity, which points towards +y and down: the side y > 0 comes up by the angle."""
    assert tilt_of(MachineTiltFault(angle=1e-2), tension=2e5) == pytest.approx(1e-2, rel=0.05)


def test_the_loaded_side_of_a_flat_belt_goes_down_by_its_torsion():
    line = line_from("beam_th2", 4e6)
    sunk = -0.01 * SPAN**2 / (8 * line.torsion.item())
    assert tilt_of(OffCentreLoadFault(moment=0.01), base="beam_th2") == pytest.approx(sunk, rel=1e-3)
    assert np.all(measured(OffCentreLoadFault(moment=0.01), yaw=0.0)[1] == 0.0)
    assert -1.0 < tilt_of(OffCentreLoadFault(moment=0.01)) / sunk < 1.0  # a hanging belt holds against it


@pytest.mark.parametrize(
    ("fault", "sign"),
    [
        (MachineTiltFault(angle=1e-2), 1.0),
        (IdlerSkewFault(force=1.0, place=0.5), -1.0),
        (SideDragFault(moment=1.0, place=0.5), 1.0),
        (OffCentreLoadFault(moment=0.01), 1.0),
    ],
)
def test_reversed_travel_is_the_machine_turned_about_the_vertical(fault, sign):
    """Turned by half a turn, y and the load's side change sign, and point 4 stands where point 1 stood."""
    forward, backward = (measured(fault, base="strip", yaw=0.0, direction=d)[1] for d in (1.0, -1.0))
    assert np.abs(forward[0]).max() > 1e-5
    np.testing.assert_allclose(backward[3], sign * forward[0], atol=1e-9)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_without_tension_a_span_is_a_clamped_beam(share):
    """kappa L = P L t^2 (1 - t)/EI under a force, M t (2 - 3 t)/EI under a couple (any table of beams)."""
    line = line_from("beam_th2", 1e3)
    force, couple = (unit_load(line, True, kind, share).adds[RUN_UP].item() for kind in ("force", "couple"))
    assert force == pytest.approx(SPAN * share**2 * (1 - share) / BENDING, rel=1e-3)
    assert couple == pytest.approx(share * (2 - 3 * share) / BENDING, rel=1e-3)


def test_a_hard_guide_near_the_tail_stops_point_1_at_its_gap_and_a_far_one_nothing():
    free = measured(tension=40e6)[1]
    stopped = measured(EdgeGuideFault(stiffness=1e7, gap=5e-4, at=0.3), tension=40e6)[1]
    mirrored = measured(EdgeGuideFault(stiffness=1e7, gap=5e-4, at=0.3), tension=40e6, yaw=-YAW)[1]
    assert 5e-4 < stopped[0].max() < 8e-4 < free[0].max() / 5
    np.testing.assert_array_equal(mirrored, -stopped)
    far = measured(EdgeGuideFault(stiffness=1e7, stiffness_lower=1e7, gap=1.0), tension=40e6)[1]
    np.testing.assert_array_equal(far, free)
