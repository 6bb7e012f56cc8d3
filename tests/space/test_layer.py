"""The bending layer in 3D: each line of nodes from its own stress and slope, and what the belt makes of it."""

from types import SimpleNamespace

import numpy as np
import pytest
from paper_cases import paper_case
from pulley_bench import empty_wrap, pose, surface

from belt_sim.effects.pulley import LiftOff
from belt_sim.line.span import strip
from belt_sim.model import analytic_model
from belt_sim.space import Options
from belt_sim.space.belt import LayerFibres
from belt_sim.space.elastic import Ties, TwistStiffness
from belt_sim.space.model import SpaceModel
from belt_sim.space.scene import Mesh
from belt_sim.space.wrap import (
    FIRST,
    LAST,
    OUTWARDS,
    BeltOnPulley,
    depth,
    line_displacements,
    station_displacement,
    thread_places,
)
from studies.paper.case import ROPE_EXAMPLE

pytestmark = [pytest.mark.filterwarnings("ignore:flex"), pytest.mark.usefixtures("float64")]

R, CHORD, N, HELD = 0.17, 0.025, 24, 12  # HELD: the last station that lies on the pulley or the first
FIBRES = 0.01  # the law is linear in M, fibres are not: (M y / F r^2)^2
KAPPA, TWIST, ROLLED = 2e-6, 2e-3, 1e-9  # [1/m], [rad/m]
CHANGE = 0.06  # of what the layer does to y: stations of 25 mm on a span of 2 m, moments read 50 mm off


CYLINDER = surface(R, CHORD)


def beside_a_pulley(case, end, across, kappa=0.0, twist=0.0):
    """A straight span along +x above (end FIRST) or along -x below a pulley at x = 0, bent and twisted in its links."""
    side = -OUTWARDS[end]  # +1: upper span, which comes to the tail; -1: lower span, which leaves it
    y = 0.5 * float(case.belt.width) * np.linspace(1.0, -1.0, across)
    x = CHORD * (np.arange(N) - HELD) * side
    rest = np.zeros((N, across, 3))
    rest[..., 0], rest[..., 1] = x[:, None], y
    mesh = Mesh(rest, rest, np.ones(across), y, np.ones(across), CHORD)
    strain = float(case.settings.tension / case.belt.youngs_modulus) - kappa * y
    slides = np.zeros_like(rest)
    slides[..., 0] = x[:, None] * strain
    slides[..., 2] = side * R + twist * x[:, None] * y
    wrap = empty_wrap(*((HELD, N - 1) if end == FIRST else (0, HELD)), N, across)
    wrap.tangent[:] = 0.0 if end == FIRST else np.pi
    twist = TwistStiffness.from_belt(case.belt, mesh)
    belt = SimpleNamespace(
        ties=Ties(None, np.ones((1, 1)), np.full((1, 1, 1), CHORD), np.zeros((1, 1, 1))), line_y=y, chord=CHORD,
        fibres=LayerFibres.from_mesh(case, mesh, twist, 1.0),
    )  # fmt: skip
    if across > 1:
        length = np.full((across - 1, 6, 1), CHORD)
        belt.ties = belt.ties._replace(length=length, natural=0.0 * length)
    return belt, np.moveaxis(rest + slides, 0, -1), wrap


def of_the_law(case):
    """l^2/2R and l^3/8R^2, each over the torsional stiffness."""
    layer = np.sqrt(case.belt.plate_stiffness / (case.settings.tension * case.belt.thickness))
    torsion = float(strip(case).torsion)
    return float(layer**2 / 2 / R), float(layer**3 / 8 / R**2), torsion


@pytest.mark.parametrize("tension", [7, 40])
@pytest.mark.parametrize(("end", "across"), [(FIRST, 2), (LAST, 2), (FIRST, 5)])
def test_a_bent_belt_tilts_and_turns_at_the_tangent_point(tension, end, across):
    case = paper_case(tension)
    belt, nodes, wrap = beside_a_pulley(case, end, across, kappa=KAPPA)
    layer = np.zeros((2, across, 2))
    pulley = BeltOnPulley(wrap, CYLINDER, pose(), layer)
    layer[end] = line_displacements(belt, pulley, 1.0, nodes, end)
    out, drawn = layer[end].T
    lift, lean, torsion = of_the_law(case)
    moment, y = float(case.belt.bending_stiffness) * KAPPA, belt.line_y
    assert np.polyfit(y, out, 1)[0] == pytest.approx(lift * moment / torsion, rel=FIBRES)
    assert np.polyfit(y, drawn, 1)[0] == pytest.approx(lean * moment / torsion, rel=FIBRES)
    moved = station_displacement(belt, pulley, np.zeros(1), end)[..., 0]
    side = -OUTWARDS[end]
    assert np.polyfit(y, moved[:, 2], 1)[0] == pytest.approx(side * lift * moment / torsion, rel=FIBRES)
    assert moved[:, 0] == pytest.approx(drawn)  # into the tail pulley, at x > 0 of upper and lower span
    assert np.abs(out.mean()) + np.abs(drawn.mean()) < ROLLED


@pytest.mark.parametrize("end", [FIRST, LAST])
def test_a_twisted_belt_is_drawn_in_less_where_it_comes_steeper(end):
    case = paper_case(10)
    belt, nodes, wrap = beside_a_pulley(case, end, 2, twist=TWIST)
    out, drawn = line_displacements(belt, BeltOnPulley(wrap, CYLINDER, pose()), 1.0, nodes, end).T
    lift, _, torsion = of_the_law(case)
    own = float(case.tension_force) * float(case.belt.width) ** 2 / 12.0 / torsion
    steeper = TWIST if end == FIRST else -TWIST  # the lower span's outside is below
    assert np.polyfit(belt.line_y, drawn, 1)[0] == pytest.approx(-lift * own * steeper, rel=FIBRES)
    assert np.abs(np.diff(out)).max() < 0.01 * np.abs(np.diff(drawn)).max()


@pytest.mark.parametrize("end", [FIRST, LAST])
def test_a_landing_station_is_put_back_by_what_the_layer_displaces_it(end):
    belt, nodes, wrap = beside_a_pulley(paper_case(10), end, 2)
    wrap.angle[:] = wrap.tangent[end]
    pair, layer = nodes[..., [HELD + OUTWARDS[end], HELD]], np.zeros((2, 2, 2))
    np.testing.assert_array_equal(thread_places(belt, BeltOnPulley(wrap, CYLINDER, pose()), nodes, end), pair)
    layer[end] = [[2e-5, 1e-6], [-2e-5, -1e-6]]
    pulley = BeltOnPulley(wrap, CYLINDER, pose(), layer)
    thread = thread_places(belt, pulley, nodes, end)

    def displaced(*inside):
        return station_displacement(belt, pulley, np.array(inside), end)

    assert thread + displaced(-CHORD, 0.0) == pytest.approx(pair, abs=2e-9)
    assert displaced(-CHORD)[:, 1, 0] == pytest.approx(1e-6 / belt.line_y[0] * CHORD * np.ones(2))
    assert displaced(6 * CHORD) == pytest.approx(0.0)
    assert depth(pulley, wrap.tangent[end], end) == pytest.approx(0.0)


@pytest.mark.evidence(
    "lift_off",
    route="3d",
    what="change of points 1 and 3 on a short slack rig, {CHANGE} of the change (the layer of each "
    "line is a condition)",
)
@pytest.mark.long
def test_the_belt_runs_as_the_law_says():
    """A slack short rig, where the layer takes a third of the lower run-up's movement."""
    case = paper_case(10, np.deg2rad(-0.01), ROPE_EXAMPLE)
    model, law = SpaceModel(options=Options(run_in=0.3, settle=0.4)), analytic_model("strip")
    seen, expected = (
        [np.array([np.interp(0.8, c.travel, c.y[k]) for k in (0, 2)]) for c in runs]
        for runs in (
            [model.run(case, e, travel=0.81) for e in ((), (LiftOff(),))],
            [law.run(case, e, travel=0.81) for e in ((), (LiftOff(),))],
        )
    )
    change = expected[1] / expected[0] - 1.0
    assert change[1] < -0.3
    assert seen[1] / seen[0] - 1.0 == pytest.approx(change, rel=CHANGE)
