"""Places, signs and sizes of single hooks against the machine's geometry and a beam's own equations."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from paper_cases import BELT, RIG, paper_case

from belt_sim.effects.shear import Shear
from belt_sim.effects.weld import Passing, Weld
from belt_sim.effects.wobble import Wobble
from belt_sim.laws.inside import BoundaryValues, no_bend
from belt_sim.laws.runup import RunUp, State
from belt_sim.laws.span import beam_second_order
from belt_sim.scene_parts import SceneParts

UNEQUAL = replace(RIG, head_radius=0.25, tail_radius=0.12)
SPAN, TAIL_WRAP = float(UNEQUAL.span_length), float(UNEQUAL.wrap_tail)
ROUND = float(UNEQUAL.belt_length)
#: places of the points along the belt, counted from point 4
POINTS = {4: 0.0, 1: SPAN, 2: SPAN + TAIL_WRAP, 3: 2 * SPAN + TAIL_WRAP}
EXACT = 1e-12


def bends(weld, case, travel):
    """Natural curvature [1/m] at the run-ups on tail and head, then at the run-offs of the same spans, shape (4,)."""
    still = Passing(x=jnp.array([0.0, SPAN]), added=jnp.zeros((3, 2)))
    boundary = BoundaryValues(
        travel=jnp.asarray(travel), start=jnp.zeros(2), ends=jnp.zeros((5, 2)), direction=case.settings.direction
    )
    bend = weld.bend(no_bend(), boundary, still, case)
    return np.concatenate([bend.natural_runup, bend.natural_runoff])


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
    bent = weld.scene(SceneParts.undisturbed(case), case).camber(s)
    assert s[np.argmax(bent)] == pytest.approx(at, abs=1e-3)
    assert np.trapezoid(bent, s) == pytest.approx(weld.angle, rel=1e-6)


def state(travel, direction):
    nothing = jnp.zeros(2)
    kept = dict.fromkeys(State.__dataclass_fields__, nothing)
    return State(**kept | {"travel": travel, "direction": direction})


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("pulley", ["tail", "head"])
def test_a_wobbling_pulley_is_the_same_in_the_law_and_in_the_scene(pulley, direction):
    """Where the belt runs up, the radius grows towards +y by what the geometry says; an axis yawed by beta brings the
    surface at +y back by beta y where it faces +x, and the pulley turns under it."""
    cos, sin = 3e-4, -2e-4
    names = ("beta_cos", "beta_sin") if pulley == "tail" else ("beta_cos_head", "beta_sin_head")
    wobble = Wobble(**dict(zip(names, (cos, sin), strict=True)))
    case = paper_case(40, 0.0, rig=UNEQUAL, direction=direction)
    parts = wobble.scene(SceneParts.undisturbed(case), case)
    own, other = (0, 1) if pulley == "tail" else (1, 0)
    surface, still = (getattr(parts, ("tail", "head")[k]) for k in (own, other))
    nothing, y = RunUp(drift=jnp.zeros(2), turn=jnp.zeros(2)), np.array([-0.05, 0.05])
    top = (pulley == "tail") == (direction > 0)  # the place of the run-up: material angle there at travel 0
    for travel in (0.0, 0.1, 0.3, 0.7):
        turned = travel / surface.radius
        yawed = -np.diff(surface.radius_at(y, 0.5 * np.pi - direction * turned))[0] / 0.1
        assert yawed == pytest.approx(cos * np.cos(turned) + sin * np.sin(turned), abs=EXACT)
        landing = surface.radius_at(y, (0.0 if top else np.pi) - direction * turned)
        wanted = np.diff(landing)[0] / 0.1 / surface.radius
        found = wobble.runup(nothing, state(travel, direction), case)
        assert float(found.turn[own]) == pytest.approx(wanted, abs=EXACT)
        assert float(found.turn[other]) == still.wobble == 0.0
        assert not found.drift.any()


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
    assert np.sqrt(span.force / span.bending) == pytest.approx(decay, rel=1e-10)
    assert decay < np.sqrt(force / belt.bending_stiffness) * (1 - 1e-5)
    assert Shear().coefficient == pytest.approx((12 + 11 * 0.3) / (10 + 10 * 0.3), rel=1e-3)
