"""Places, signs and sizes of single hooks against the machine's geometry and a beam's own equations."""

import inspect
import pickle
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from paper_cases import BELT, RIG, paper_case

from belt_sim.effects.base import Effect, library
from belt_sim.effects.load import load_classes
from belt_sim.effects.span import Shear, Weld
from belt_sim.effects.yaw import Wobble
from belt_sim.io import ROOT
from belt_sim.jax_setup import in_float64
from belt_sim.line.hooks import HOOKS, overrides
from belt_sim.line.runup import State, Yaw
from belt_sim.line.span import Bend, BoundaryValues, beam_first_order, beam_second_order, dimensionless
from belt_sim.line.spans import span_responses
from belt_sim.scene_parts import SceneParts
from belt_sim.space.wrap import axes_of

UNEQUAL = replace(RIG, head_radius=0.25, tail_radius=0.12)
SPAN, TAIL_WRAP = float(UNEQUAL.span_length), float(UNEQUAL.wrap_tail)
ROUND = float(UNEQUAL.belt_length)
#: places of the points along the belt, counted from point 4
POINTS = {4: 0.0, 1: SPAN, 2: SPAN + TAIL_WRAP, 3: 2 * SPAN + TAIL_WRAP}
EXACT = 1e-12
ROUNDING = 1e-9  # of a span condensed in nine doublings
SMALL = 1e-7  # products of angles below 1e-3


@pytest.mark.parametrize("name", HOOKS)
def test_a_hook_that_is_not_overridden_returns_its_first_argument(name):
    hook = getattr(Effect, name)
    names = [*inspect.signature(hook).parameters][1:]
    assert pickle.loads(pickle.dumps(hook)) is hook

    class Own(Effect):
        pass

    setattr(Own, name, lambda self, *given: getattr(super(Own, self), name)(*given))
    assert getattr(Own(), name)(*names) == names[0]
    assert hook(Own(), **{n: n for n in names}) == names[0]
    with pytest.raises(TypeError, match="missing 1 required"):
        getattr(Own(), name)(*names[:-1])
    assert overrides(Own) == {name}
    assert not overrides(Effect)


def test_a_hook_of_the_library_can_be_called_where_it_changes_nothing():
    assert library()["taper"](kappa_t=2e-5).sensor("reading", None) == "reading"


def bends(weld, case, travel):
    """Natural curvature [1/m] at the run-ups on tail and head, then at the run-offs of the same spans, shape (4,)."""
    still = jnp.array([0.0, SPAN]), jnp.zeros((3, 2))
    boundary = BoundaryValues(
        travel=jnp.asarray(travel), start=jnp.zeros(2), ends=jnp.zeros((5, 2)), direction=case.settings.direction
    )
    bend = weld.bend(Bend(), boundary, still, case)
    return np.concatenate([bend.natural_runup, bend.natural_runoff])


@pytest.mark.evidence("weld", route="formula", what="where it passes the points, from the machine's lengths")
@pytest.mark.parametrize("at", [3.0, 15.0])
@pytest.mark.parametrize(("direction", "order"), [(1.0, (1, 3, 4, 2)), (-1.0, (2, 4, 3, 1))])
def test_a_weld_passes_the_points_where_its_place_on_the_belt_says(at, direction, order):
    """Forward the belt runs up at points 1 and 3, reversed at 2 and 4; from a point further on the weld comes later."""
    weld = Weld(angle=1e-3, at=at)
    case = paper_case(40, 0.0, rig=UNEQUAL, direction=direction)
    for row, point in enumerate(order):
        reached = direction * (POINTS[point] - at) % ROUND
        there, before, after = (bends(weld, case, reached + d)[row] for d in (0.0, -0.35, 0.35))
        assert there == pytest.approx(2 * weld.angle / weld.length, rel=1e-6)  # the top of a raised cosine
        assert before == after == 0.0
    s = np.linspace(0.0, ROUND, 20001)
    bent = weld.scene(SceneParts.from_case(case), case).camber(s)
    assert s[np.argmax(bent)] == pytest.approx(at, abs=1e-3)
    assert np.trapezoid(bent, s) == pytest.approx(weld.angle, rel=1e-6)


def state(travel, direction):
    nothing = jnp.zeros(2)
    kept = dict.fromkeys(State.__dataclass_fields__, nothing)
    return State(**kept | {"travel": travel, "direction": direction})


@pytest.mark.evidence(
    "wobble",
    route="formula",
    what="yaw, roll and place of the surface in the law and in the scene's geometry, both pulleys "
    "and directions; it never carries the belt sideways",
)
@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("pulley", ["tail", "head"])
def test_a_wobbling_pulley_is_the_same_in_the_law_and_in_the_scene(pulley, direction):
    """Yaw and roll of the scene's axis, and where they take the places on which the belt runs up and off."""
    cos, sin = 3e-4, -2e-4
    names = ("beta_cos", "beta_sin") if pulley == "tail" else ("beta_cos_head", "beta_sin_head")
    wobble = Wobble(**dict(zip(names, (cos, sin), strict=True)))
    case = paper_case(40, 0.0, rig=UNEQUAL, direction=direction)
    parts = wobble.scene(SceneParts.from_case(case), case)
    own, other = (0, 1) if pulley == "tail" else (1, 0)
    surface, still = (getattr(parts, ("tail", "head")[k]) for k in (own, other))
    above = 1.0 if (pulley == "tail") == (direction > 0) else -1.0  # where it runs up
    for travel in (0.0, 0.1, 0.3, 0.7):
        axes = np.asarray(in_float64(axes_of)(surface, 0.0, 1.0, direction * travel / surface.radius))
        found = wobble.yaw(Yaw(tail=jnp.zeros(()), head=jnp.zeros(())), state(travel, direction), case)
        yawed = cos * np.cos(travel / surface.radius) + sin * np.sin(travel / surface.radius)
        assert float(getattr(found, pulley)) == pytest.approx(yawed, abs=SMALL)
        assert np.arctan2(-axes[0, 1], axes[1, 1]) == pytest.approx(yawed, abs=SMALL)
        for at, side, aside, roll in (
            (own, above, found.aside_runup, found.roll_runup),
            (other, -above, found.aside_runoff, found.roll_runoff),
        ):
            there = (axes @ [0.0, 0.0, side * surface.radius])[1]
            assert float(aside[at]) == pytest.approx(there, abs=SMALL * surface.radius)
            assert float(roll[at]) == pytest.approx(axes[2, 1], abs=SMALL)
            assert float(aside[1 - at]) == float(roll[1 - at]) == still.wobble == 0.0


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_wobbling_surface_never_carries_the_belt_sideways(direction):
    """What it points aside, it comes back from: theta_p + d(aside)/ds = 0 at all four places."""
    case = paper_case(40, 0.0, rig=UNEQUAL, direction=direction)
    wobble = Wobble(beta_cos=3e-4, beta_sin=-2e-4, beta_cos_head=1e-4, beta_sin_head=4e-4, radius_error=0.01)

    def swung(travel):
        return wobble.yaw(Yaw(tail=jnp.zeros(()), head=jnp.zeros(())), state(travel, direction), case)

    moved, at = (jax.jacfwd(lambda s: (swung(s).aside_runup, swung(s).aside_runoff))(0.37), swung(0.37))
    np.testing.assert_allclose(moved[0] + at.runup, 0.0, atol=EXACT)
    np.testing.assert_allclose(moved[1] + at.runoff, 0.0, atol=EXACT)


@pytest.mark.evidence("shear", route="formula", what="decay of a bend, straight from equilibrium")
@pytest.mark.parametrize("width", [0.2, 2.0])
def test_a_bend_decays_along_a_beam_whose_cross_sections_shear(width):
    """Straight from equilibrium with nothing across: EI theta' = M, M' = -Q, Q = -F y', y' = theta + n Q/(G b h)."""
    belt, coefficient = replace(BELT, width=width), 1.177
    case = replace(paper_case(40), belt=belt)
    force = float(case.tension_force)
    give = coefficient * 2 * (1 + belt.poisson_ratio) / (belt.youngs_modulus * width * belt.thickness)
    slope, across = np.linalg.solve([[1.0, -give], [force, 1.0]], [1.0, 0.0])  # y' and Q at theta = 1
    assert slope < 1.0
    change = np.array([[0.0, 1.0 / belt.bending_stiffness], [-across, 0.0]])  # of theta and M
    decay = np.linalg.eigvals(change).real.max()
    span = Shear(coefficient=coefficient).span(beam_second_order(case), case)
    square = dimensionless(span)[0][0] / span.length**2
    assert np.sqrt(square) == pytest.approx(decay, rel=1e-10)
    assert decay < np.sqrt(force / belt.bending_stiffness) * (1 - 1e-5)
    assert Shear().coefficient == pytest.approx((12 + 11 * 0.3) / (10 + 10 * 0.3), rel=1e-3)


def test_a_lining_holds_like_a_spring_at_the_clamped_end():
    """A beam whose end is on a spring 1/c bears 4 EI/L / (1 + c 4 EI/L) newton metres per radian (any textbook)."""
    case = paper_case(1e-3)
    span = beam_first_order(case)
    clamped = 4.0 * span.bending / span.length
    lining = load_classes([str(ROOT / "models" / "effects" / "lining.py")])["lining"]
    for c in (0.0, 1e-6, 1e-4, 1.0):
        answer = span_responses(case, (lining(c=c),), span)
        assert span.bending * answer.runup[0, 2] == pytest.approx(clamped / (1.0 + c * clamped), rel=ROUNDING)
