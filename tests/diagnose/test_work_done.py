"""How much a diagnosis computes: marches, programs and eigen-decompositions are counted, batches run side by side."""

import threading
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from small_campaign import MODEL, campaign, repeated_bench

import belt_sim as bs
from belt_sim.diagnosis import forward
from belt_sim.diagnosis import forward as march_module
from belt_sim.diagnosis.examine import keeps_tension
from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.forward import HEAVY, Forward
from belt_sim.diagnosis.samples import samples_of
from belt_sim.discovery import responses
from belt_sim.effects.pulley import Crown, Taper
from belt_sim.effects.span import Camber, Weld
from belt_sim.effects.yaw import YawOffsetTail
from belt_sim.jax_setup import StoredProgram
from belt_sim.line import march
from belt_sim.results.errors import Change, Errors

#: campaign -> its base model, candidates, and the most of runs marched at a point, programs and calls of eigh: one of
#: them a call for the evidence of an input, of small matrices
LIMITS = {
    "small": ("beam_th2", ["sag_roll", "taper", "yaw_offset_tail"], {"rows": 1872, "programs": 11, "eigh": 1702}),
    "machine_fault": (  # two faults, no law; the last program is that of the limits of validity
        "strip", ["side_drag", "taper", "yaw_offset_tail", "edge_profile"],
        {"rows": 3710, "programs": 10, "eigh": 2919},
    ),
}  # fmt: skip
SLACK = 1.05  # rounding of another processor may cost a step


@pytest.mark.parametrize("name", ["small", pytest.param("machine_fault", marks=pytest.mark.long)])
def test_a_diagnosis_does_no_more_than_it_did(monkeypatch, name):
    model, few, limits = LIMITS[name]
    done: Counter[str] = Counter()
    plan, make, eigh = forward.Forward._march, StoredProgram._make, np.linalg.eigh

    def count(name, function):
        def counted(*arguments, **more):
            done[name] += len(arguments[1]) * len(arguments[0].samples.distinct[0]) if name == "rows" else 1
            return function(*arguments, **more)

        return counted

    monkeypatch.setattr(forward.Forward, "_march", count("rows", plan))
    monkeypatch.setattr(StoredProgram, "_make", count("programs", make))
    monkeypatch.setattr(np.linalg, "eigh", count("eigh", eigh))
    compilers = [forward.compile_march, forward._compile_columns, march._compile_march]
    for cached in (*compilers, responses._compile_march, responses._compile_changes):
        cached.cache_clear()  # what other tests have compiled
    bs.diagnose(campaign("sag_roll") if name == "small" else name, model, effects=few, advise=False)
    for what, limit in limits.items():
        assert 0 < done[what] <= SLACK * limit, f"{what}: {done[what]}, {limit} before"


def test_what_is_dear_is_asked_by_itself_where_nothing_else_acts(monkeypatch):
    forward = Forward(samples_of(campaign("nothing")), MODEL, (Taper, Crown, Weld))
    sizes = [k for k, s in enumerate(forward.slots) if not s.parameter.modifier]
    along = np.eye(forward.size)[sizes]
    asked: list[frozenset[str]] = []

    def noted(self, vector, groups):
        """The code is noted, and neither compiled nor run."""
        asked.append(groups)
        return np.zeros((len(vector), *self.samples.y.shape)), []

    monkeypatch.setattr(Forward, "_march", noted)
    forward.values_and_slopes(np.repeat(forward.null()[None], len(along), axis=0), along)
    assert set(asked) == {frozenset(), frozenset({HEAVY})}
    asked.clear()
    tapered = forward.null()
    tapered[forward.index("taper")] = 0.1
    forward.values_and_slopes(np.repeat(tapered[None], len(along), axis=0), along)
    assert set(asked) == {frozenset(), frozenset({HEAVY})}


def test_an_effect_that_is_null_takes_no_time_and_changes_no_bit(monkeypatch):
    """A batch passes over the hooks of effects that are null in all of its rows (``switched``)."""
    classes = (Taper, Crown, YawOffsetTail, Camber)
    passed: list[int] = []
    compile_march = march_module.compile_march

    def noting(*arguments):
        program = compile_march(*arguments)
        return lambda *given: (passed.append(int(given[-1].sum())), program(*given))[1]

    monkeypatch.setattr(march_module, "compile_march", noting)

    def predict():
        forward = Forward(samples_of(campaign("nothing")), MODEL, classes)
        points = np.repeat(forward.null()[None], 3, axis=0)
        points[1, forward.index("taper")] = 0.1
        points[2, [*forward.index("crown"), *forward.index("camber")]] = 0.1
        return np.concatenate([forward._predict(points[k : k + 1], [frozenset()]) for k in range(3)])

    found = predict()
    assert passed == [0, 1, 2]
    monkeypatch.setattr(march_module, "switched", lambda effect, acts: effect)
    compile_march.cache_clear()
    monkeypatch.setenv("BELT_SIM_CACHE", "off")
    monkeypatch.setattr(march_module, "program_key", lambda *parts: None)
    assert np.array_equal(found, predict())
    compile_march.cache_clear()


def test_a_run_and_its_repeat_are_predicted_once_until_they_are_set_apart():
    all_runs = samples_of(campaign("nothing"))
    forward = Forward(all_runs.of_runs(np.array([1, 0, 1])), MODEL, ())
    null = forward.null()[None]
    part, _ = forward._march(null, frozenset())
    assert part.shape[1] == 2
    each = Forward(all_runs.of_runs(np.array([1, 0])), MODEL, ()).values(null)
    assert np.array_equal(forward.values(null), each[:, [0, 1, 0]])
    apart = forward.set_to(np.array([0.0, 0.0, 0.01]), np.zeros(3))
    assert list(apart.samples.distinct[1]) == [0, 1, 2]
    assert (
        apart.of_runs(np.array([], int)).values(apart.null()[None]).shape[1] == 0
    )  # an action that turns no belt over
    other_places = replace(forward.samples, travel=forward.samples.travel + np.array([[0.0], [0.0], [0.1]]))
    assert list(other_places.distinct[1]) == [0, 1, 2]


def test_a_condition_that_tests_nothing_is_said_to():
    change = Change(before=1e-3, after=1e-4)
    both = {"7 N/mm2": change, "yaw +": change}
    rows = list(Errors(noise_floor=1e-5, by_condition=both, untestable=("yaw +",)).rows())
    assert rows == ["7 N/mm2, unseen", "yaw + (not testable by hold-out), unseen"]


def test_the_first_batch_of_every_program_comes_before_the_second_of_any(monkeypatch):
    """So programs are loaded side by side."""
    done = []
    works = [[partial(done.append, (name, k)) for k in range(n)] for name, n in (("a", 3), ("b", 1), ("c", 2))]
    with ThreadPoolExecutor(1) as one:
        monkeypatch.setattr(forward, "_POOL", one)
        forward.finish(works)
    assert done == [("a", 0), ("b", 0), ("c", 0), ("a", 1), ("c", 1), ("a", 2)]


def test_batches_of_all_requests_run_in_the_same_threads():
    seen = set()
    works = [[lambda: seen.add(threading.get_ident())] * 4]
    for _ in range(8):
        forward.finish(works)
    assert len(seen) <= forward.WORKERS + 1  # and the caller's own, which compiles a lone program


def test_an_error_of_a_batch_is_told_when_all_have_ended():
    ended = []
    works = [[lambda: 1 / 0], [lambda: ended.append(1)]]
    with pytest.raises(ZeroDivisionError):
        forward.finish(works)
    assert ended == [1]


def test_a_load_cell_may_not_leave_a_span_compressed():
    """The equations of such a span have a solution, so that a fit may end there; nothing is sought beside it."""
    bench = repeated_bench()
    (gain,) = (k for k, s in enumerate(bench.forward.slots) if (s.effect.id, s.name) == ("tension_bias", "gain"))
    for size, kept in ((-0.5, True), (-1.5, False)):
        vector = bench.forward.null()
        vector[gain] = size / bench.forward.slots[gain].scale
        assert keeps_tension(bench, Fit(ids=("tension_bias",), free=[gain], vector=vector)) is kept


def test_batches_that_wait_are_dropped_when_a_diagnosis_is_stopped(monkeypatch):
    done, gate = [], threading.Event()

    def stop():
        raise KeyboardInterrupt

    with ThreadPoolExecutor(1) as one:
        monkeypatch.setattr(forward, "_POOL", one)
        with pytest.raises(KeyboardInterrupt):
            forward.finish([[stop], [partial(gate.wait, 10)], [partial(done.append, 1)]])
        gate.set()
    assert done == []
