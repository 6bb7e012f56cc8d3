"""What sticking, a pulley's shape and a bent strip must look like in the curves, read off without the march's laws."""

from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
import pytest
from paper_cases import BELT, RIG, YAW, affected, marched, paper_case, response, steered
from scipy.interpolate import CubicSpline

from belt_sim.case import Schedule
from belt_sim.curves import late_rates
from belt_sim.effects.base import Effect, Parameter, effect
from belt_sim.line.march import march_case
from belt_sim.line.span import strip
from belt_sim.model import analytic_model

TRAVEL = 14.0  # [m], records 0.14 m apart
SLOPES = 0.01  # of the yaw: slopes of cubics through records that a ramp's ends fall between
PASSED = 2e-4  # of y: the history of the wrap, kept at steps of 7 mm and at records
PASSED_ON = 0.1  # of the wave at a pulley askew: what the spans take back of it and pass on, R dkappa/dtheta = 0.07
EARLY = 0.1  # of y after 0.56 m, where the span has taken back 7 % of the bend
UNEQUAL = replace(RIG, head_radius=0.25, tail_radius=0.12)
RAMP = Schedule.ramp(YAW, at=1.5, over=3.0)
HEAD = Schedule.ramp(-0.4 * YAW, at=0.5, over=5.0)


def slope(c, point):
    """dy/ds [m/m] of a point at every record."""
    return CubicSpline(c.travel, c.y[point])(c.travel, 1)


def ramp(s, size, at, over):
    return size * np.clip((s - at) / over, 0.0, 1.0)


@pytest.fixture(scope="module", params=["rope", "beam_th2", "strip"])
def ramped(request):
    """Curves while both pulleys of unequal radii are turned slowly, and the surface directions at points 1-4."""
    case = steered(paper_case(40, rig=UNEQUAL, yaw_head=HEAD), RAMP)
    c = marched([case], request.param, travel=TRAVEL)[0]
    tail, head = ramp(c.travel, YAW, 1.5, 3.0), ramp(c.travel, -0.4 * YAW, 0.5, 5.0)
    return c, np.stack([tail, -tail, -head, head])


def test_run_up_points_move_by_the_angle_against_their_pulley(ramped):
    """dy/ds = theta_p - theta: a belt that sticks is carried straight on."""
    c, surface = ramped
    for point in (0, 2):
        np.testing.assert_allclose(slope(c, point), (surface - c.angle)[point], atol=SLOPES * YAW)
    assert np.abs(surface - c.angle)[0].max() > 0.1 * YAW


def test_run_off_points_repeat_what_ran_up_one_wrap_of_their_own_ago(ramped):
    c, surface = ramped
    against = c.angle - surface
    for off, up, wrap in ((1, 0, UNEQUAL.wrap_tail), (3, 2, UNEQUAL.wrap_head)):
        late = c.travel > wrap
        for kept, near in ((c.y, PASSED * np.abs(c.y[up]).max()), (against, SLOPES * YAW)):
            before = CubicSpline(c.travel, kept[up])(c.travel - wrap)
            np.testing.assert_allclose(kept[off][late], before[late], atol=near)


@pytest.mark.parametrize(("where", "moves", "rests"), [("kappa_t", 0, 2), ("kappa_t_head", 2, 0)])
def test_a_taper_first_moves_the_belt_on_its_own_pulley(where, moves, rests):
    """dalpha/ds = -kappa_t where it runs up: y = kappa_t s^2/2 at first."""
    c = affected([(paper_case(20, 0.0), {"taper": {where: 2e-5}})], TRAVEL)[0]
    assert c.y[moves, 4] == pytest.approx(2e-5 * c.travel[4] ** 2 / 2, rel=EARLY)
    assert np.abs(c.y[rests, :5]).max() < EARLY * c.y[moves, 4]


@pytest.mark.parametrize(("where", "point", "sign"), [("", 0, 1.0), ("_head", 2, -1.0)])
@pytest.mark.parametrize(("wave", "shape"), [("cos", np.cos), ("sin", np.sin)])
def test_a_pulley_askew_turns_the_landing_belt_with_its_own_turn(where, point, sign, wave, shape):
    """dy/ds = -theta, dtheta/ds = -kappa_t: where it runs up, y swings by R beta, against the yaw of the surface."""
    numbers = {f"beta_{wave}{where}": 1e-4, f"radius_error{where}": 0.2}
    c = affected([(paper_case(40, 0.0), {"wobble": numbers})], TRAVEL)[0]
    turned = c.travel / (1.2 * RIG.tail_radius)
    late = c.travel > TRAVEL - 6 * 1.2 * RIG.tail_radius * 2 * np.pi
    columns = np.stack([np.cos(turned), np.sin(turned), *(c.travel**k for k in range(5))], axis=1)[late]
    for at, size in ((point, 1e-4), (2 - point, 0.0)):
        cos, sin = np.linalg.lstsq(columns, slope(c, at)[late], rcond=None)[0][:2]
        wanted = -sign * size * np.array([shape is np.cos, shape is np.sin])
        np.testing.assert_allclose([cos, sin], wanted, atol=PASSED_ON * 1e-4)


def test_the_inner_edge_of_a_curved_belt_loses_the_bending_stress():
    """A flat span of a belt that is curved by nature is bent straight: E kappa b/2 at its edges."""
    kappa, case = 1e-4, paper_case(10, 0.0)
    c = affected([(case, {"camber": {"kappa_c": kappa}})], TRAVEL)[0]
    wanted = 10e6 - BELT.youngs_modulus * kappa * BELT.width / 2
    np.testing.assert_allclose(c.edge_stress, wanted, rtol=1e-6)


@effect
@dataclass(frozen=True, kw_only=True)
class Creep(Effect):
    """A belt that creeps sideways on both pulleys while it runs up, m per m of travel."""

    id = "creep"
    law = "run-up"
    reference = "none: for this test"
    parameters = {"d": Parameter(unit="1", meaning="creep", plausible=(-1e-3, 1e-3), scale=1e-5)}
    d: float = 0.0

    def runup(self, runup, state, case):
        return replace(runup, drift=runup.drift + self.d)


def test_a_belt_that_creeps_on_the_pulleys_leans_back_in_the_spans():
    """At first y = d s; in the end w = d - theta, straight spans lean by theta, and 2 L theta = 2 W w."""
    size, case = 1e-5, paper_case(100, 0.0)
    c = march_case(case, analytic_model("beam_th2"), (Creep(d=size),), travel=400.0, step=0.1)
    np.testing.assert_allclose(c.y[:3:2, 1], size * c.travel[1], rtol=EARLY)
    np.testing.assert_allclose(late_rates(c), size * RIG.span_length / (RIG.span_length + RIG.wrap_tail), rtol=1e-3)


@effect
@dataclass(frozen=True, kw_only=True)
class Rolled(Effect):
    """Ends of the spans that are rolled, and nothing else: yaw makes so little roll that it would not show."""

    id = "rolled"
    law = "drive"
    reference = "none: for this test"
    parameters = {n: Parameter(unit="rad", meaning=n, plausible=(-1, 1), scale=1e-2) for n in ("phi_u", "phi_o")}
    phi_u: float = 0.0
    phi_o: float = 0.0

    def yaw(self, yaw, state, case):
        up, off = (jnp.stack([roll, -0.3 * roll]) for roll in (self.phi_u, self.phi_o))
        return replace(yaw, roll_runup=yaw.roll_runup + up, roll_runoff=yaw.roll_runoff + off)


@pytest.mark.parametrize("rolls", [{"phi_u": 0.01}, {"phi_o": 0.01}], ids=["run-up", "run-off"])
def test_the_belt_turns_on_its_pulleys_by_the_curvature_that_rolled_ends_give_it(rolls):
    """dalpha/ds = -kappa, at first k_phi phi of the hanging span's response."""
    case = paper_case(10, 0.0)
    known = response(strip(case)).runup[4 if "phi_u" in rolls else 3]
    c = march_case(case, analytic_model("strip"), (Rolled(**rolls),), travel=3.0)
    for point, roll in ((0, 0.01), (2, -0.003)):
        turn = CubicSpline(c.travel, c.angle[point])(0.0, 1)
        assert turn == pytest.approx(-float(known) * roll, rel=EARLY)
