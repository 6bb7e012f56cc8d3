"""Small rules by themselves: numbers that only shape, waves of any spectrum, conditions that test nothing."""

import threading
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from small_campaign import repeated_bench

from belt_sim.diagnosis import forward
from belt_sim.diagnosis.examine import keeps_tension
from belt_sim.diagnosis.fit import Fit
from belt_sim.effects.base import Parameter
from belt_sim.results.diagnosis import error_table
from belt_sim.results.errors import Change, Errors


def slot(*, modifier):
    """A number that a machine has between 0 and 1."""
    declared = Parameter(unit="1", meaning="play", plausible=(0.0, 1.0), scale=1.0, modifier=modifier)
    return SimpleNamespace(effect=SimpleNamespace(id="a", parameters={"n": declared}), name="n", scale=1.0, null=0.0)


def test_a_condition_that_tests_nothing_is_said_to():
    change = Change(before=1e-3, after=1e-4)
    both = {"7 N/mm2": change, "yaw +": change}
    rows = [row[0] for row in error_table(Errors(noise_floor=1e-5, by_condition=both, untestable=("yaw +",))).rows]
    assert rows == ["7 N/mm2, unseen", "yaw + (not testable by hold-out), unseen"]


def test_the_first_batch_of_every_program_comes_before_the_second_of_any(monkeypatch):
    """So programs are loaded side by side."""
    done = []
    works = [
        forward.Work(np.zeros(0), [partial(done.append, (name, k)) for k in range(n)])
        for name, n in (("a", 3), ("b", 1), ("c", 2))
    ]
    with ThreadPoolExecutor(1) as one:
        monkeypatch.setattr(forward, "_pool", lambda: one)
        forward.finish(works)
    assert done == [("a", 0), ("b", 0), ("c", 0), ("a", 1), ("c", 1), ("a", 2)]


def test_batches_of_all_requests_run_in_the_same_threads():
    seen = set()
    works = [forward.Work(np.zeros(0), [lambda: seen.add(threading.get_ident())] * 4)]
    for _ in range(8):
        forward.finish(works)
    assert len(seen) <= forward.WORKERS + 1  # and the caller's own, which compiles a lone program


def test_an_error_of_a_batch_is_told_when_all_have_ended():
    ended = []
    works = [forward.Work(np.zeros(0), [batch]) for batch in (lambda: 1 / 0, lambda: ended.append(1))]
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
