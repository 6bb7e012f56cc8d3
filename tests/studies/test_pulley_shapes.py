"""Pulleys that are no cylinders, in 3D and by the laws of their effects: taper, crown, cant, wobble ..."""

from dataclasses import dataclass, replace

import jax.numpy as jnp
import pytest

from belt_sim.effects.base import Effect, Parameter, effect
from belt_sim.effects.library import library
from belt_sim.scene_parts import SceneParts
from studies.pulley_shapes import SHAPES, case, change

RATE = 0.03  # of the late rate, in 4 m that the belt has hardly settled in
CHANGE = 0.02  # of the largest: dx = 25 mm stands for a span longer by dx
CANT = 0.01  # of the late rate
WAVE = 0.05  # of the wave: 43 stations a turn of the pulley
STATIONS = 0.025  # [m]

pytestmark = [pytest.mark.long, pytest.mark.filterwarnings("ignore:flex")]


def of_the_study(name: str):
    numbers, travel = SHAPES[name]
    return change(library()[name](**numbers), travel, STATIONS)


@pytest.mark.parametrize("name", ["taper", "crown", "pulley_deflection", "unequal_tension"])
def test_the_belt_on_shapes_changes_as_their_laws_say(name):
    found = of_the_study(name)
    seen, told = found.rates
    assert seen == pytest.approx(told, rel=RATE)
    assert name == "taper" or found.off < CHANGE


def test_a_canted_pulley_drives_the_belt_as_the_law_says():
    """cant: its rate; the start is another, since in 3D the pulley is canted under the belt."""
    seen, told = of_the_study("cant").rates
    assert seen == pytest.approx(told, rel=CANT)


@effect
@dataclass(frozen=True, kw_only=True)
class TurningTaper(Effect):
    """(beta/R) sin(s/R): what a pulley is whose cylinder sits askew by beta on its shaft."""

    id = "turning_taper"
    law = "run-up"
    reference = "geometry"
    parity = "even"
    parameters = {"beta": Parameter(unit="rad", meaning="askew by", plausible=(-1e-2, 1e-2), scale=1e-4)}
    beta: float = 0.0

    def runup(self, runup, state, case):
        radius = case.rig.tail_radius
        taper = self.beta / radius * jnp.sin(state.travel / radius)
        return replace(runup, turn=runup.turn + jnp.stack([taper, 0.0 * taper]))

    def scene(self, parts, case):
        return parts.with_pulley("tail", wobble=self.beta)


def test_a_pulley_askew_on_its_shaft_is_a_taper_that_turns():
    """wobble has the same scene, and its law has a third of the wave: docs/how_far.md."""
    numbers, travel = SHAPES["wobble"]
    wobble, askew = library()["wobble"](**numbers), TurningTaper(beta=numbers["beta_cos"])
    plain = SceneParts.undisturbed(case())
    assert wobble.scene(plain, case()) == askew.scene(plain, case())
    seen, told = change(askew, travel, STATIONS).waves
    assert seen == pytest.approx(told, rel=WAVE)
