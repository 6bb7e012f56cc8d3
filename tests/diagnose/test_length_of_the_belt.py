"""A belt's length is known no better than its machine's; an edge that drifts out of step is no fault of the encoder."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from small_campaign import MODEL

from belt_sim.api.simulate import candidates_of
from belt_sim.campaign import Campaign, Machine, Quantity
from belt_sim.diagnosis.forward import NUISANCES
from belt_sim.diagnosis.noise import length_sigma
from belt_sim.diagnosis.workbench import Workbench, workbench
from belt_sim.units import DEGREE, MM, N_PER_MM2
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import Noise, Plan, RunSetting

CLASSES = candidates_of(("edge_profile", "encoder_scale"), MODEL)
EDGE = {"id": "edge_profile", "cos1": 1.5e-3, "sin2": 5e-4, "cos3": 2e-4}
SHORT = {"id": "edge_profile", "cos1": 1.5e-3, "cos20": 3e-4, "sin19": 5e-4}
ENCODER = {"id": "encoder_scale", "e": 0.02}
TERMS = {"edge_profile": 3}
U = 5e-3  # [m] of the centre distance
LONGER = 3.0  # times u that it is above what is stated


def machine(distance: float, u: float) -> Machine:
    """The test rig with radii that are known exactly."""
    radius = Quantity(value=0.17)
    return Machine(centre_distance=Quantity(value=distance, u=u), head_radius=radius, tail_radius=radius)


@cache
def measured(hidden: tuple[str, ...], u: float = U, *, short: bool = False) -> Campaign:
    """A belt that lies over pulleys three sigma further apart than is stated."""
    runs = tuple(RunSetting(tension=t * N_PER_MM2, yaw=0.042 * s * DEGREE) for t in (10.0, 40.0) for s in (-1, 1))
    true = Plan(runs=runs, length=60.0, spacing=0.5, machine=machine(11.28, 0.0))
    noise = Noise(white=0.01 * MM, wander_sd=0.005 * MM, zero=0.05 * MM, tension_rel=0.005)
    faults = [f for f in (SHORT if short else EDGE, ENCODER) if f["id"] in hidden]
    made = make_campaign(hidden=faults, seed=4, plan=true, noise=noise)[0]
    return replace(made, machine=machine(11.28 - LONGER * U, u))


@cache
def beside_the_edge(hidden: tuple[str, ...], u: float = U) -> Workbench:
    """The workbench where the edge alone was fitted."""
    bench = workbench(measured(hidden, u), MODEL, CLASSES, terms=TERMS)
    (edge,) = bench.fit([bench.start(["edge_profile"], bench.forward.null())])
    return bench.moved_to(edge.vector)


def encoder(hidden: tuple[str, ...], u: float = U) -> tuple[float, float, float]:
    """What a scale of the encoder takes off chi2 beside the edge; the scale, and one sigma of it."""
    bench, null = beside_the_edge(hidden, u), workbench(measured(hidden, u), MODEL, CLASSES, terms=TERMS).forward.null()
    alone, both = bench.fit([bench.start(ids, null) for ids in (["edge_profile"], ["edge_profile", "encoder_scale"])])
    (k,) = bench.forward.index("encoder_scale")
    scale = bench.forward.slots[k].scale
    u_of = np.sqrt(both.covariance[both.free.index(k), both.free.index(k)])
    return alone.chi2 - both.chi2, both.vector[k] * scale, u_of * scale


def test_a_length_taken_as_exact_would_look_like_a_scale_of_the_encoder():
    """Where it is known to be uncertain, such a scale spares what its being three sigma off costs, and no more."""
    exact, known = (encoder(("edge_profile",), u)[0] for u in (0.0, U))
    assert exact > 100.0
    assert known < LONGER**2 + 4.0


def test_a_scale_of_the_encoder_is_found_beside_an_edge():
    gain, e, u = encoder(("edge_profile", "encoder_scale"))
    assert gain > 100.0
    assert e == pytest.approx(ENCODER["e"], abs=4.0 * u)


def test_the_shape_is_what_a_longer_belt_does():
    """A phase that falls back with travel, beside the little that longer spans do to the belt's path."""
    bench = workbench(measured(("edge_profile",)), MODEL, CLASSES, terms=TERMS)
    around, edge, null = bench.samples.cases.rig.belt_length, 1e-3, bench.forward.null()
    sigma = length_sigma(bench.campaign, around)
    assert sigma == pytest.approx(2.0 * U / around)
    with_edge = null.copy()
    with_edge[bench.forward.index("edge_profile")[0]] = edge / bench.forward.slots[0].scale
    moved = bench.moved_to(with_edge)
    longer = with_edge.copy()
    longer[len(bench.forward.slots) + NUISANCES.index("belt_length")] = sigma
    here, there = moved.forward.values(np.array([with_edge, longer]))
    np.testing.assert_allclose(moved.shared[-1], there - here, atol=0.02 * np.abs(there - here).max())
    phase = 2 * np.pi * bench.samples.travel[0] / around
    of_point_4 = [s.at for s in bench.samples.signals].index("point_4")
    seen = (moved.shared - bench.shared)[-1, 0, of_point_4]
    np.testing.assert_allclose(seen, edge * sigma * phase * np.sin(phase), atol=1e-3 * edge * sigma * phase.max())


def test_short_waves_that_come_far_out_of_step_are_found_in_their_full_size():
    """Half a radian after two and a half turns: in the linear range they would be found smaller, and the rest left."""
    bench = workbench(measured(("edge_profile",), short=True), MODEL, CLASSES, terms={"edge_profile": 20})
    for _ in range(2):
        (edge,) = bench.fit([bench.start(["edge_profile"], bench.forward.null())])
        bench = bench.moved_to(edge.vector)
    (edge,) = bench.fit([bench.start(["edge_profile"], edge.vector)])
    numbers = {bench.forward.slots[k].name: (j, edge.vector[k]) for j, k in enumerate(edge.free)}
    for name in ("cos20", "sin19"):
        j, value = numbers[name]
        true = SHORT[name] / bench.forward.slots[edge.free[j]].scale
        assert abs(value - true) < 3.0 * np.sqrt(edge.covariance[j, j])
