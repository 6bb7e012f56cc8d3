"""Pulleys that are no cylinders, in 3D and by the laws of their effects: taper, crown, cant, wobble ..."""

import pytest

from belt_sim.effects.base import library
from studies.pulley_shapes import SHAPES, change

RATE = 0.03  # of the late rate, in 4 m that the belt has hardly settled in
CHANGE = 0.02  # of the largest: dx = 25 mm stands for a span longer by dx
BENT = 0.03  # of the largest, 8 um; 2.2 % with 25 mm between stations, 1.2 % with 12.5 mm
CANT = 0.01  # of the late rate
WAVE = 0.06  # of the largest y, 0.1 to 0.2 mm: 43 stations a turn of the pulley
STATIONS = 0.025  # [m]

pytestmark = [pytest.mark.long, pytest.mark.filterwarnings("ignore:flex")]


def of_the_study(name: str):
    numbers, travel = SHAPES[name]
    return change(library()[name](**numbers), travel, STATIONS)


@pytest.mark.evidence(
    "taper",
    route="3d",
    what="change of the late rate by a conical tail pulley on a short rig, {RATE} (y: 8 % of the largest)",
)
@pytest.mark.evidence(
    "crown",
    "unequal_tension",
    route="3d",
    what="change of y on a short rig, {CHANGE} of the largest",
)
@pytest.mark.evidence(
    "pulley_deflection",
    route="3d",
    what="change of y by pulleys with bent axes on a short rig, {BENT} of the largest",
)
@pytest.mark.evidence("yaw_compliance", route="3d", what="change of y on a short rig, {CHANGE} of the largest")
@pytest.mark.parametrize("name", ["taper", "crown", "pulley_deflection", "unequal_tension", "yaw_compliance"])
def test_the_belt_on_shapes_changes_as_their_laws_say(name):
    found = of_the_study(name)
    seen, told = found.rates
    assert seen == pytest.approx(told, rel=RATE)
    assert name == "taper" or found.off < (BENT if name == "pulley_deflection" else CHANGE)


@pytest.mark.evidence(
    "cant",
    route="3d",
    what="late rate on a short rig, {CANT}; not the start: 3D cants the pulley under the belt, "
    "which moves it by R gamma",
)
def test_a_canted_pulley_drives_the_belt_as_the_law_says():
    """cant: its rate; the start is another, since in 3D the pulley is canted under the belt."""
    seen, told = of_the_study("cant").rates
    assert seen == pytest.approx(told, rel=CANT)


@pytest.mark.evidence(
    "wobble",
    route="3d",
    what="y of all four points on a short rig, either pulley askew, sizes and phases, {WAVE} of the largest",
)
@pytest.mark.parametrize("numbers", [{"beta_cos": 5e-4}, {"beta_sin_head": 5e-4}], ids=["tail", "head"])
def test_pulleys_askew_move_all_points_as_the_law_says(numbers):
    """All along, sizes and phases, at the askew pulley and at the other."""
    assert change(library()["wobble"](**numbers), SHAPES["wobble"][1], STATIONS).off < WAVE
