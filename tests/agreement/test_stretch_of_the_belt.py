"""A stretch of another stiffness, and a span weaker to one side, beside the finite elements of the virtual rig.

Both sides share the equations of a span (physics sheet, section 3) and the case; neither its discretisation nor what
stands for the change: jumps of angle or roll here, elements of another stiffness there.
"""

from dataclasses import replace

import numpy as np
import pytest
from paper_cases import paper_case

import belt_sim as bs
from belt_sim.effects.generic_law import law_effect
from belt_sim.effects.law import LAW_PLACES, Form, Law, SizedLaw, Term
from belt_sim.jax_setup import in_float64
from belt_sim.line.span import stretch_adds, stretch_response, strip
from belt_sim.model import analytic_model
from belt_sim.virtual_rig.hidden import fault_from_spec
from belt_sim.virtual_rig.line import DOUBLINGS, Sections, solve_span
from belt_sim.virtual_rig.march import TrueErrors, observe, true_line
from belt_sim.virtual_rig.plan import Plan

TENSION, TIGHT = 5.0, 40.0  # N/mm2: the coupling of bending and roll is strong, and bends fade away within a stretch
HALF = 0.5 / 2**DOUBLINGS  # half an element
SLIGHT = 0.03  # of the most that a slight change does: 64 elements there, 65 places here
#: of a large one: twist may change its sign within the stretch
LARGE = {TENSION: {"bending": 0.03, "torsion": 0.25}, TIGHT: {"bending": 0.3, "torsion": 0.1}}
RUNS = 0.04  # of what a joint does to a run: its stretch is a rectangle here, a cosine squared there
MODULUS = 5e-3  # of the largest: torsion goes with the modulus as well, by G b h^3/3 of T
ONE_SIDE = 1e-3  # of what cracks do: seven powers of a change stand for it here, nine of its values there


@pytest.mark.parametrize("kind", ["bending", "torsion"])
@pytest.mark.parametrize(
    ("tension", "change", "wide"),
    [(TENSION, -1e-3, 0.1), (TENSION, -0.9, 0.1), (TENSION, -0.7, 0.3), (TENSION, 30.0, 0.15), (TIGHT, -0.9, 0.1)],
)
def test_a_stretch_does_to_a_span_what_elements_of_another_stiffness_do(kind, tension, change, wide):
    """To the curvature at either end and the roll at mid-span, at six places, of the most that it does at any."""
    span = in_float64(strip)(paper_case(tension))
    whole = [np.array([float(getattr(span, n))]) for n in ("length", "bending", "force", "torsion", "sag_curvature")]
    middles = (np.arange(2**DOUBLINGS) + 0.5) / 2**DOUBLINGS
    insides = [np.abs(middles - at) < 0.5 * wide for at in (0.2, 0.3, 0.45, 0.5, 0.6, 0.8)]

    def ends(inside: np.ndarray) -> np.ndarray:
        rows, _ = solve_span(*whole, Sections(**{kind: 1.0 + change * inside[None]}))
        return rows[:, [2, 1, 3], 0]  # y at the run-up, angles at the run-off and at the run-up

    def stretched(inside: np.ndarray) -> np.ndarray:
        first, last = (float(span.length) * (middles[inside][k] + off) for k, off in ((0, -HALF), (-1, HALF)))
        jump = -change / (1.0 + change) * (last - first)
        return stretch_adds(response, jump, last - first, (first, last), np)[0]

    response = in_float64(stretch_response)(span, kind=kind)
    true = np.array([ends(inside) - ends(0.0 * middles) for inside in insides])
    found = np.array([stretched(inside) for inside in insides])
    tolerance = SLIGHT if abs(change) < 0.01 else LARGE[tension][kind]
    assert np.all(np.abs(found - true).max(axis=(0, 2)) < tolerance * np.abs(true).max(axis=(0, 2)))


@pytest.mark.parametrize("kind", ["bending", "torsion"])
def test_a_stretch_is_at_most_rigid(kind):
    response = in_float64(stretch_response)(in_float64(strip)(paper_case(TENSION)), kind=kind)
    rigid, beyond = (stretch_adds(response, jump, 1.0, (2.0, 3.0), np) for jump in (-1.0, -4.0))
    assert np.array_equal(rigid[0], beyond[0])
    assert rigid[1] == beyond[1] == -1.0


def changes_of(plan: Plan, runs: int, what) -> np.ndarray:
    """What an effect, or a fault of the virtual rig, changes in the first runs of a plan, (runs, signals, n) [m]."""
    if isinstance(what, dict):
        line = true_line(plan, "strip", TrueErrors())
        found = observe(plan, line, [fault_from_spec(what)]) - observe(plan, line, ())
        return np.moveaxis(found, 2, 0)[:runs]
    rows = []
    for run in plan.runs[:runs]:
        yaw = [{"at": run.yaw_at, "yaw": np.degrees(run.yaw)}]
        case = bs.make_case(rig="test_rig", tension=run.tension / 1e6, yaw=yaw, direction=run.direction)
        after, before = (analytic_model("strip").run(case, some, travel=plan.length) for some in ((what,), ()))
        added = np.asarray(after.y - before.y)
        rows.append([np.interp(plan.travel, after.travel, added[int(at[-1]) - 1]) for at in plan.signals.values()])
    return np.array(rows)


def law(place: str, form: Form, size: float):
    content = SizedLaw(Law((Term(LAW_PLACES[place], form),)), (size,), 1e7)
    return law_effect(content)()


@pytest.mark.parametrize("change", [-0.3, 0.3])
def test_spans_of_another_bending_stiffness_move_and_bear_the_moments_of_such_a_belt(change):
    """Beside a belt of another modulus, whose torsion is St. Venant's to a small part."""
    case = paper_case(20.0)
    other = replace(case, belt=replace(case.belt, youngs_modulus=(1.0 + change) * case.belt.youngs_modulus))
    found = analytic_model("strip").run(case, (law("bending_both", Form("none"), change),), travel=10.0)
    true = analytic_model("strip").run(other, (), travel=10.0)
    for name in ("y", "moment"):
        wanted = np.asarray(getattr(true, name))
        np.testing.assert_allclose(getattr(found, name), wanted, atol=MODULUS * np.abs(wanted).max())


def joint(plan: Plan, share: float, at: float, stretch: float):
    """A law of a stretch that bends as the virtual rig's soft joint does, and lies where that lies."""
    length = plan.machine.centre_distance.value
    around = float(bs.make_case(rig="test_rig", tension=10, yaw=0.0).rig.belt_length)
    size = -(1.0 / np.sqrt(1.0 - share) - 1.0) * stretch  # of the mean of 1 / (1 - share cos^2) - 1
    runs_up = (length - at) / around  # it counts from point 4, a law from the tail pulley
    return law("bending_carried", Form("none", course="belt_section", at=runs_up, wide=stretch * length / around), size)


@pytest.mark.parametrize(("share", "at", "stretch"), [(0.7, 8.0, 0.3)])
def test_a_joint_does_in_a_run_what_that_of_the_virtual_rig_does(share, at, stretch):
    plan = Plan()
    hidden = {"id": "soft_joint", "share": share, "at": at, "stretch": stretch}
    true, found = changes_of(plan, 3, hidden), changes_of(plan, 3, joint(plan, share, at, stretch))
    assert np.linalg.norm(found - true) < RUNS * np.linalg.norm(true)


@pytest.mark.parametrize(("sign", "shape"), [(1.0, "positive"), (-1.0, "negative")])
def test_a_span_weaker_to_one_side_does_what_the_cracks_of_the_virtual_rig_do(sign, shape):
    plan, share, angle = Plan(), 0.6, 1e-4
    hidden = {"id": "edge_cracks", "share": share, "sign": sign, "angle": angle}
    knee = angle / plan.machine.centre_distance.value
    effect = law("bending_both", Form("kappa_mean", shape=shape, knee=knee), -share)
    true, found = changes_of(plan, 4, hidden), changes_of(plan, 4, effect)
    assert np.linalg.norm(found - true) < ONE_SIDE * np.linalg.norm(true)
