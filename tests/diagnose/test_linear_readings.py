"""Readings that are linear in an effect: derivatives without a march, and how many harmonics an edge asks for."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from small_campaign import MODEL, campaign

from belt_sim.campaign import Campaign
from belt_sim.diagnosis.forward import Forward
from belt_sim.diagnosis.samples import samples_of
from belt_sim.diagnosis.workbench import workbench
from belt_sim.effects.base import Effect, Parameter, effect, library
from studies.paper.case import TEST_RIG

NAMES = ("edge_profile", "encoder_scale", "sensor_delay", "sensor_gain")
CLASSES = tuple(library()[name] for name in NAMES)
SAME = 1e-6  # of a column: differences of two marches
FOUND = 5.0  # standard deviations
POINTS = {"point_4": 0.0, "point_1": TEST_RIG.span_length, "point_2": TEST_RIG.span_length + TEST_RIG.wrap_tail}
POINTS["point_3"] = POINTS["point_2"] + TEST_RIG.span_length


@effect
@dataclass(frozen=True, kw_only=True)
class Cubed(Effect):
    """A sensor that is no gain."""

    id = "cubed"
    law = "sensor"
    reference = "none"
    parameters = {"size": Parameter(unit="1/m^2", meaning="of the cube", plausible=(-1e3, 1e3), scale=1.0)}
    size: float = 0.0

    def sensor(self, reading, case):
        return replace(reading, y=reading.y + self.size * reading.y**3)


ODD = (*CLASSES, Cubed)


def with_edge(plain: Campaign, sizes: np.ndarray) -> Campaign:
    """The campaign with an edge of cosines of these sizes [m], read by every lateral sensor, zero at the yaw."""
    order = np.arange(1, len(sizes) + 1)[:, None]

    def edge(travel, signal, direction):
        return sizes @ np.cos(2 * np.pi * order * (travel - direction * POINTS[signal.at]) / TEST_RIG.belt_length)

    runs = []
    for run in plain.runs:
        added = {
            s.name: run.signals[s.name]
            + edge(run.travel, s, run.direction)
            - edge(np.array([run.yaw_at]), s, run.direction)
            for s in plain.signals
            if s.at in POINTS
        }
        runs.append(replace(run, signals=run.signals | added))
    return replace(plain, runs=tuple(runs))


def test_derivatives_are_those_of_the_whole_prediction():
    """At an encoder, gains and a delay that are off: nothing of the march is needed for them."""
    forward = Forward(samples_of(campaign("nothing")), MODEL, CLASSES)
    vector = forward.null()
    for k, slot in enumerate(forward.slots):
        vector[k] = {"e": 1.5, "g1": 2.0, "g4": -1.0, "delay": 3.0, "cos2": 1.0}.get(slot.name, vector[k])
    wanted = [forward.index("edge_profile")[k] for k in (0, 3, 17)]
    directions = np.eye(forward.size)[wanted]
    found = forward.values_and_slopes(np.repeat(vector[None], 3, axis=0), directions)[1]
    there, here = (forward.values(vector + h * directions) for h in (0.5, -0.5))
    np.testing.assert_allclose(found, there - here, atol=SAME * np.abs(found).max())
    assert np.abs(found).max(axis=(1, 2, 3)).min() > 1e-6


def test_an_edge_is_added_to_a_march_without_it():
    """As a march with the edge in it has it, which is compiled only beside a sensor that shows no gain."""
    samples, rng = samples_of(campaign("nothing")), np.random.default_rng(3)
    apart, within = (Forward(samples, MODEL, classes, terms={"edge_profile": 4}) for classes in (CLASSES, ODD))
    assert apart._addable
    assert not within._addable
    vector = apart.null() + 0.3 * rng.standard_normal((2, apart.size)) * (np.arange(apart.size) < len(apart.slots))
    beside = np.insert(vector, len(apart.slots), 0.0, axis=1)
    assert within.slots[len(apart.slots)].effect is Cubed
    found, marched = apart.values(vector), within.values(beside)
    np.testing.assert_allclose(found, marched, rtol=0.0, atol=1e-12 * np.abs(marched).max())
    vector[:, apart.index("edge_profile")] = 0.0
    assert np.abs(apart.values(vector) - marched).max() > 1e-3 * np.abs(marched).max()
    beside[:, len(apart.slots)] = 1e3
    assert np.abs(within.values(beside) - marched).max() > 1e-9 * np.abs(marched).max()


def test_as_many_harmonics_are_asked_for_as_show():
    plain = campaign("nothing")
    assert workbench(plain, MODEL, CLASSES).forward.terms == {"edge_profile": 3}
    for count in (6, 12):
        bench = workbench(with_edge(plain, 2e-4 / np.arange(1, count + 1) ** 1.27), MODEL, CLASSES)
        assert count - 1 <= bench.forward.terms["edge_profile"] <= count + 1
        assert len(bench.forward.index("edge_profile")) == 2 * bench.forward.terms["edge_profile"]


def test_harmonics_with_fewer_than_two_samples_a_wave_are_asked_for():
    """Where the samples lie on the belt is known, and so what a short wave shows there."""
    bench = workbench(with_edge(campaign("nothing"), 4e-4 / np.arange(1, 41) ** 1.27), MODEL, CLASSES)
    assert bench.forward.terms["edge_profile"] > TEST_RIG.belt_length / (2 * np.diff(bench.samples.travel[0])[0])


@pytest.mark.parametrize("size", [4.5e-6, 7e-6])  # of the smaller ones none stands out alone
def test_a_faint_shape_is_asked_for_with_all_its_harmonics(size):
    bench = workbench(with_edge(campaign("nothing"), np.full(12, size)), MODEL, CLASSES)
    assert 11 <= bench.forward.terms["edge_profile"] <= 14


def test_an_edge_of_ten_harmonics_is_fitted():
    sizes = 3e-4 / np.arange(1, 11) ** 1.27
    bench = workbench(with_edge(campaign("nothing"), sizes), MODEL, CLASSES)
    null = bench.forward.null()
    base, fit = bench.fit([bench.start((), null), bench.start(["edge_profile"], null)])
    assert fit.chi2 < 0.5 * base.chi2
    (edge,) = bench.forward.effects_at(fit.vector, ["edge_profile"])
    spread = np.sqrt(np.diag(fit.covariance))
    for k, size in enumerate(sizes[:8]):
        u = spread[2 * k] * bench.forward.slots[2 * k].scale
        assert getattr(edge, f"cos{k + 1}") == pytest.approx(size, abs=FOUND * u)
        assert u < 0.2 * size or k < 2
