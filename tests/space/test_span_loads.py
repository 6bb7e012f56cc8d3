"""Loads between the pulleys, in 3D as forces on nodes and by the laws of their effects."""

from dataclasses import replace

import numpy as np
import pytest
from paper_cases import paper_case
from pulley_bench import stations_on

from belt_sim.effects.base import library
from belt_sim.effects.span import IdlerSkew, Shear, SideDrag
from belt_sim.effects.yaw import Cant
from belt_sim.jax_setup import in_float64
from belt_sim.model import analytic_model
from belt_sim.space.belt import load_forces
from belt_sim.space.model import SpaceModel
from belt_sim.space.native import SpaceRun, instants_of
from belt_sim.space.options import Options, fit_options
from belt_sim.space.quasi_static import simulate_batch
from belt_sim.space.wrap import HEAD, TAIL
from studies.paper.case import ROPE_EXAMPLE

WIDTH = 0.1  # [m]: the belt of 0.2 m shears so much that the law needs the effect for it
CHANGE = 0.02  # of the largest y
MEMBRANE = Shear(coefficient=1.0)  # its triangles have even strains
WITHOUT = 0.03  # of the largest y, by which the law is off without shear, at least
TILT = 0.1  # of the largest tilt: what a drag does to the tension is not in the law; 5 % without one
ROLLED = 0.05  # of the largest tilt; without the roll of its ends the law is 10 % off
COARSE = 0.04  # of y after 0.8 m, 50 mm between stations
#: effect, numbers, tension [N/mm2], direction
LOADS = [
    ("idler_skew", {"force": 20.0, "place": 0.3}, 60, 1.0),
    ("idler_skew", {"force": 20.0, "place": 0.3}, 60, -1.0),
    ("side_drag", {"moment": 2.0, "place": 0.3}, 60, 1.0),
    ("side_drag", {"moment": -2.0, "place": 0.7}, 60, -1.0),
    ("machine_tilt", {"angle": 0.5}, 10, 1.0),
    ("off_centre_load", {"moment": 0.01}, 10, 1.0),
]


def narrow(tension, direction=1.0):
    """A narrow belt on the short rig, not yawed."""
    case = paper_case(tension, 0.0, ROPE_EXAMPLE, direction=direction)
    return replace(case, belt=replace(case.belt, width=WIDTH))


def both(effect, case, travel, options):
    """y (4, n) and tilt (2, n) from 0.2 m on, in 3D and by the law; a belt that nothing pushes moves by 0.2 um."""
    at = np.arange(0.2, travel, 0.05)
    for model in (SpaceModel(options=options), analytic_model("strip")):
        c = model.run(case, (effect,), travel=travel)
        yield [np.array([np.interp(at, c.travel, row) for row in np.asarray(rows)]) for rows in (c.y, c.tilt)]


@pytest.mark.evidence(
    "idler_skew",
    route="3d",
    what="y of all points on a narrow short rig, both directions, {CHANGE} of the largest; tilt {TILT}",
)
@pytest.mark.evidence(
    "side_drag",
    route="3d",
    what="a drag at one edge: y of all points on a narrow short rig, both edges and directions, "
    "{CHANGE} of the largest; tilt {TILT}",
)
@pytest.mark.evidence(
    "machine_tilt",
    "off_centre_load",
    route="3d",
    what="y of all points on a narrow short rig at 10 N/mm2, {CHANGE} of the largest; tilt {TILT}",
)
@pytest.mark.long
@pytest.mark.parametrize(("name", "numbers", "tension", "direction"), LOADS)
def test_a_loaded_belt_runs_and_tilts_as_the_law_says(name, numbers, tension, direction):
    options = Options(dx=0.025, dt=1.5e-3, run_in=0.0, settle=0.3, acceleration=2.0)
    (y, tilt), (y_told, tilt_told) = both(library()[name](**numbers), narrow(tension, direction), 2.0, options)
    np.testing.assert_allclose(y, y_told, atol=CHANGE * np.abs(y_told).max())
    np.testing.assert_allclose(tilt, tilt_told, atol=TILT * np.abs(tilt_told).max())


@pytest.mark.evidence(
    "cant", route="3d", what="y of all points on a narrow short rig at 10 N/mm2, {CHANGE} of the largest; tilt {ROLLED}"
)
@pytest.mark.long
def test_a_slack_belt_on_a_canted_pulley_runs_and_tilts_as_the_law_says():
    """In equilibria; what the belt does without a cant is left out. The first half metre tilts by single landings."""
    case, cant, travel = narrow(10), Cant(gamma=2e-3), 6.0
    options = Options(dx=0.02, run_in=0.0)
    parts = [SpaceModel(options=options).parts(case, acting) for acting in ((cant,), ())]
    canted, plain = simulate_batch([case, case], travel=travel, options=options, parts=parts)
    law, at = analytic_model("strip").run(case, (cant,), travel=travel), np.arange(1.0, travel, 0.05)
    for name, off in (("y", CHANGE), ("tilt", ROLLED)):
        found, without, told = (
            np.array([np.interp(at, c.travel, row) for row in np.asarray(getattr(c, name))])
            for c in (canted, plain, law)
        )
        np.testing.assert_allclose(found - without, told, atol=off * np.abs(told).max())


@pytest.mark.evidence(
    "shear",
    route="3d",
    what="y of all points on a wide short rig under an idler and on a tilted machine, {CHANGE} of the largest",
)
@pytest.mark.parametrize(
    ("name", "numbers", "tension"), [LOADS[0][:3], pytest.param(*LOADS[4][:3], marks=pytest.mark.long)]
)
def test_a_wide_belt_lands_sheared(name, numbers, tension):
    """Without the effect the law is 4 % off under the idler and 6 % on the tilted machine."""
    options = Options(dx=0.04, dt=1.5e-3, run_in=0.0, settle=0.3, acceleration=2.0)
    load, case, at = library()[name](**numbers), paper_case(tension, 0.0, ROPE_EXAMPLE), np.arange(0.2, 1.8, 0.05)
    runs = (
        SpaceModel(options=options).run(case, (load,), travel=1.8),
        *(analytic_model("strip").run(case, (load, *more), travel=1.8) for more in ((), (MEMBRANE,))),
    )
    y, plain, sheared = (np.array([np.interp(at, c.travel, row) for row in np.asarray(c.y)]) for c in runs)
    np.testing.assert_allclose(sheared, y, atol=CHANGE * np.abs(y).max())
    assert np.abs(plain - y).max() > WITHOUT * np.abs(y).max()


@pytest.mark.long
def test_a_skewed_idler_drives_the_belt_where_it_pushes():
    options = Options(dx=0.04, dt=2e-3, run_in=0.0, settle=0.2, acceleration=2.0)
    (y, _), (told, _) = both(IdlerSkew(force=20.0, place=0.3), narrow(60), 0.8, options)
    assert y[0, -1] == pytest.approx(told[0, -1], rel=COARSE)


def test_nodes_take_what_the_effects_say():
    """Sums over the nodes: force aside, drag along the travel, its couple about the belt's normal, at the place."""
    direction, place = -1.0, 0.3
    case = narrow(60, direction)
    effects = (IdlerSkew(force=7.0, place=place), SideDrag(moment=2.0, place=place))
    parts = SpaceModel().parts(case, effects)
    run = SpaceRun(case, "flex", fit_options(Options(dx=0.04), case, "flex"), parts)
    state, mesh = run.lay(instants_of(run.scene, 0.1)[0][0]), run.scene.mesh
    nodes = mesh.rest + state.slides
    forces = np.moveaxis(np.asarray(in_float64(load_forces)(run.belt, np.moveaxis(nodes, 0, -1))), -1, 0)
    drag = 2.0 * 2.0 / WIDTH
    np.testing.assert_allclose(forces.sum(axis=(0, 1))[:2], [-drag * direction, 7.0 * direction], rtol=1e-5)
    couple = (nodes[..., 0] * forces[..., 1] - nodes[..., 1] * forces[..., 0]).sum()
    x = (nodes[..., 0] * forces[..., 1]).sum() / forces[..., 1].sum()
    assert couple - 7.0 * direction * x == pytest.approx(2.0 * direction, rel=1e-3)  # pull narrows it
    assert x == pytest.approx(place * ROPE_EXAMPLE.centre_distance, abs=1e-3)
    held = np.concatenate([stations_on(state, k) for k in (HEAD, TAIL)])
    assert not forces[held].any()


BELOW = 0.04  # of the largest y; 0.8 and 0.3 % but for the drag, which moves it by 14 um
WEDGE = 0.1  # of the largest y, in the points that leave: its sudden beginning, as of a taper


@pytest.mark.long
@pytest.mark.evidence(
    "idler_skew_lower", "side_drag_lower", "off_centre_load_lower",
    route="3d", what="y of all points on a narrow short rig, {BELOW} of the largest",
)  # fmt: skip
@pytest.mark.evidence(
    "thickness_wedge", route="3d", what="y of all points on a narrow short rig, {WEDGE} of the largest"
)
@pytest.mark.parametrize("tension", [60, 10])
def test_loads_below_and_a_belt_of_uneven_thickness_move_it_as_their_laws_say(tension):
    """Static equilibria in 3D, two effects a tension in one batch."""
    numbers = {
        60: {"idler_skew_lower": {"force": 20.0, "place": 0.3}, "side_drag_lower": {"moment": 2.0, "place": 0.3}},
        10: {"off_centre_load_lower": {"moment": 0.01}, "thickness_wedge": {"slope": 3e-4}},
    }[tension]
    case, options = narrow(tension), Options(dx=0.025, run_in=0.3, steps=4)
    effects = [library()[name](**values) for name, values in numbers.items()]
    parts = [SpaceModel(options=options).parts(case, (e,)) for e in effects]
    at = np.arange(0.2, 2.95, 0.02)
    for e, seen in zip(effects, simulate_batch([case] * 2, travel=3.0, options=options, parts=parts), strict=True):
        told = analytic_model("strip").run(case, (e,), travel=3.0)
        found, wanted = (np.array([np.interp(at, c.travel, row) for row in np.asarray(c.y)]) for c in (seen, told))
        limit = WEDGE if e.id == "thickness_wedge" else BELOW
        np.testing.assert_allclose(found, wanted, atol=limit * np.abs(wanted).max(), err_msg=e.id)
