"""Small rules by themselves: numbers that only shape, waves of any spectrum, conditions that test nothing."""

import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from belt_sim.diagnosis.choice.chance import Chance
from belt_sim.diagnosis.fits.candidate import estimates, is_plausible, is_possible
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.heldout import Condition, HeldOut
from belt_sim.diagnosis.left_over import openset
from belt_sim.diagnosis.left_over.null import NullGains
from belt_sim.diagnosis.left_over.openset import SPECTRUM, OpenSet, OpenTests
from belt_sim.diagnosis.left_over.waves import EACH_ITS_PHASE, Waves
from belt_sim.diagnosis.readings import batches
from belt_sim.effects.base import Parameter
from belt_sim.results.diagnosis import error_table
from belt_sim.results.errors import Change, Errors


def slot(*, modifier):
    """A number that a machine has between 0 and 1."""
    declared = Parameter(unit="1", meaning="play", plausible=(0.0, 1.0), scale=1.0, modifier=modifier)
    return SimpleNamespace(effect=SimpleNamespace(id="a", parameters={"n": declared}), name="n", scale=1.0, null=0.0)


@pytest.mark.parametrize(
    ("value", "u", "as_size", "as_shape"),
    [
        (0.5, 0.1, True, True),
        (1.6, 0.1, True, True),  # nobody knows the end of a range better than to a factor of two
        (2.2, 0.7, False, True),  # outside, but its interval reaches in: an only size is judged by itself
        (3.0, 0.2, False, False),
    ],
)
def test_a_number_that_only_shapes_or_is_one_of_several_is_judged_by_its_interval(value, u, as_size, as_shape):
    numbers = np.array([value]), np.array([u])
    assert is_possible([slot(modifier=False)], *numbers) is as_size
    assert is_possible([slot(modifier=True)], *numbers) is as_shape
    other = slot(modifier=False)
    other.name, other.effect.parameters["m"] = "m", other.effect.parameters["n"]
    two = np.array([value, 0.5]), np.array([u, 0.1])
    assert is_possible([slot(modifier=False), other], *two) is as_shape  # of two sizes one may be hardly bound


def test_a_range_that_begins_beyond_null_is_wider_at_both_ends():
    """A share of 0.5 to 1.5 may be 0.3 or 2.5, but neither 0.1 nor 4."""
    declared = Parameter(unit="1", meaning="share", plausible=(0.5, 1.5), scale=1.0)
    share = SimpleNamespace(effect=SimpleNamespace(id="a", parameters={"n": declared}), name="n", scale=1.0, null=0.0)
    said = [is_possible([share], np.array([value]), np.array([0.01])) for value in (0.1, 0.3, 1.0, 2.5, 4.0)]
    assert said == [False, True, True, True, False]


def test_an_effect_whose_shape_cannot_be_told_is_there_without_a_number():
    """Loss and onset of one product: neither is known by itself; that the product is not null is."""
    loss, onset = slot(modifier=False), slot(modifier=True)
    both = SimpleNamespace(id="a", parameters={"n": loss.effect.parameters["n"], "m": onset.effect.parameters["n"]})
    slots = [SimpleNamespace(effect=both, name=n, scale=1.0, null=0.0) for n in ("n", "m")]
    columns = np.full((2, 5), 10.0)
    columns[1, 1] += 0.01
    fit = Fit(ids=("a",), free=[0, 1], vector=np.array([0.5, 0.2]), chi2=1.0, columns=columns, values=np.zeros(1))
    forward = SimpleNamespace(slots=slots)
    assert estimates(forward, fit) == {"a": {}}
    assert is_plausible(forward, fit)
    assert not is_plausible(forward, replace(fit, vector=np.array([2.5, 0.2])))


def test_waves_of_their_own_phase_are_allowed_another_spectrum(monkeypatch):
    """The same gain counts for less there, since wander need not be what it is modelled as."""
    gain, tests = 30.0, {EACH_ITS_PHASE: [f"{EACH_ITS_PHASE} 0"], "run r01": ["run r01"]}
    names = [n for each in tests.values() for n in each]
    given = {n: np.array([gain]) for n in names}, dict.fromkeys(names, 1), tests
    monkeypatch.setattr(openset, "_gains", lambda *args: given)
    monkeypatch.setattr(openset, "wavelengths", lambda bench: np.array([5.0]))
    null = NullGains({n: np.ones(10) for n in names}, dict.fromkeys(names, 1))
    open_tests = OpenTests(Waves(None), np.empty((0, 3)), {}, null, critical=-14.0)
    found = open_tests.look(np.zeros(3))
    assert found.gain == {EACH_ITS_PHASE: pytest.approx(gain / SPECTRUM), "run r01": gain}
    assert found.failed == ("run r01",)
    assert found.wavelength == {EACH_ITS_PHASE: 5.0}


@pytest.mark.parametrize(("log_p", "asked"), [(-5.0, [200]), (-9.0, [200, 1000]), (-10.5, [200, 1000]), (-30.0, [200])])
def test_chance_is_asked_more_often_where_it_decides(monkeypatch, log_p, asked):
    found, counts = OpenSet((), {"a": log_p}, {}, {}), []

    def made(bench, fit, *, bootstraps, seed):
        counts.append(bootstraps)
        return SimpleNamespace(look=lambda residual: found, critical=-10.0)

    monkeypatch.setattr(openset, "open_tests", made)
    assert openset.open_set(None, SimpleNamespace(residual=None), bootstraps=200, seed=0) is found
    assert counts == asked


def test_a_condition_that_tests_nothing_is_said_to():
    change = Change(before=1e-3, after=1e-4)
    both = {"7 N/mm2": change, "yaw +": change}
    rows = [row[0] for row in error_table(Errors(noise_floor=1e-5, by_condition=both, untestable=("yaw +",))).rows]
    assert rows == ["without 7 N/mm2", "without yaw + (not testable by hold-out)"]


@pytest.mark.parametrize(("more", "worse"), [(0.0, ()), (-2.0, ()), (2.0, ("density",))])
def test_a_condition_in_which_nothing_is_asked_speaks_against_no_effect(more, worse):
    """Runs without yaw are predicted alike with and without what acts on the yaw."""

    def left_out(surprise):
        still = np.zeros(3)
        every = np.ones(1, dtype=bool), still[None, None]
        return HeldOut(
            0.0, 0.0, {"yaw 0": Condition(surprise, still, np.empty((0, 3)), np.zeros(3, dtype=int), *every)}
        )

    assert Chance({"yaw 0": np.ones((5, 3))}).worse(left_out(7.0 + more), left_out(7.0)) == worse


def test_a_zero_that_is_far_off_is_no_law():
    """One run's zero is beyond what its sheet says, another's readings bend as none do by chance."""
    rng = np.random.default_rng(2)
    noise = 0.1 * rng.normal(size=(200, 40)) + rng.normal(size=(200, 1))
    record, bent = np.zeros(40, dtype=int), 6.0 * np.cos(np.linspace(0.0, np.pi, 40))

    def left_out(errors):
        every = np.ones(1, dtype=bool), errors[None, None]
        return Condition(0.0, errors, np.empty((0, 40)), record, *every)

    held = HeldOut(0.0, 0.0, {"zero": left_out(np.full(40, 6.0)), "bent": left_out(bent)})
    assert list(Chance({"zero": noise, "bent": noise}).beyond_floor(held)) == ["bent"]


@pytest.mark.parametrize(("sigmas", "beyond"), [(2.5, []), (6.0, ["slack"])])
def test_a_number_that_the_rest_hardly_knows_may_be_off_by_some_sigma(sigmas, beyond):
    """A tension that is far from the others is predicted by a number whose error is one draw, not a mean of many."""
    noise = np.random.default_rng(2).normal(size=(200, 40))
    moved = 5.0 * np.cos(np.linspace(0.0, np.pi, 40))
    every = np.ones(1, dtype=bool), np.zeros((1, 1, 40))
    slack = Condition(0.0, sigmas * moved, moved[None], np.zeros(40, dtype=int), *every)
    assert list(Chance({"slack": noise}).beyond_floor(HeldOut(0.0, 0.0, {"slack": slack}))) == beyond


def test_the_first_batch_of_every_program_comes_before_the_second_of_any(monkeypatch):
    """So programs are loaded side by side."""
    done = []
    works = [
        batches.Work(np.zeros(0), [partial(done.append, (name, k)) for k in range(n)])
        for name, n in (("a", 3), ("b", 1), ("c", 2))
    ]
    with ThreadPoolExecutor(1) as one:
        monkeypatch.setattr(batches, "_pool", lambda: one)
        batches.finish(works)
    assert done == [("a", 0), ("b", 0), ("c", 0), ("a", 1), ("c", 1), ("a", 2)]


def test_batches_of_all_requests_run_in_the_same_threads():
    seen = set()
    works = [batches.Work(np.zeros(0), [lambda: seen.add(threading.get_ident())] * 4)]
    for _ in range(8):
        batches.finish(works)
    assert len(seen) <= batches.WORKERS + 1  # and the caller's own, which compiles a lone program


def test_an_error_of_a_batch_is_told_when_all_have_ended():
    ended = []
    works = [batches.Work(np.zeros(0), [batch]) for batch in (lambda: 1 / 0, lambda: ended.append(1))]
    with pytest.raises(ZeroDivisionError):
        batches.finish(works)
    assert ended == [1]
