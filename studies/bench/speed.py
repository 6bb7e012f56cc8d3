"""Ten thousand cases with the batch march, and the same case with a plain loop and with jitcdde."""

import shutil
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import jax
import numpy as np

from belt_sim.jax_setup import WORKERS, jit_float64, map_in_threads
from belt_sim.line.march import march_traced, plan_steps
from belt_sim.units import N_PER_MM2
from studies.bench.delay import DelayEquation
from studies.bench.plain import plain_march
from studies.bench.task import KEEP, TENSIONS, TRAVEL, YAWS, errors, linear, strip, truth
from studies.paper.case import paper_case

STEP = 0.1  # [m] of the batch march: of second order, its error is below that of first order at 20 mm
CHUNK = 250  # cases; their state stays in a core's cache
REPEATS = 3  # the best of so many: another program on the machine only ever adds time
SAMPLE = [(0, 0), (5, 99), (30, 10), (99, 99)]  # (tension, yaw) of the cases whose error is measured


def batch_figures() -> dict[str, Any]:
    """Seconds for all cases after compilation, and the errors of a sample of them."""
    case = paper_case(TENSIONS[0], 0.0)
    plan = plan_steps(case, travel=TRAVEL, step=STEP, keep=KEEP)
    tension, yaw = (x.ravel() for x in np.meshgrid(TENSIONS, YAWS, indexing="ij"))

    def one(tension, yaw):
        settings = replace(case.settings, tension=tension, yaw=replace(case.settings.yaw, change=yaw[None]))
        return march_traced(replace(case, settings=settings), (), TRAVEL, model=strip(), plan=plan).y

    side_by_side = jit_float64(jax.vmap(one))

    def run():
        chunks = [slice(k, k + CHUNK) for k in range(0, len(yaw), CHUNK)]
        parts = map_in_threads(lambda rows: np.asarray(side_by_side(tension[rows], yaw[rows])), chunks, WORKERS)
        return np.concatenate(parts)

    begun = time.perf_counter()
    y = run()
    first = time.perf_counter() - begun
    seconds = min(_seconds(run) for _ in range(REPEATS))
    found = [errors(y[t * len(YAWS) + k], truth(paper_case(TENSIONS[t], YAWS[k]))) for t, k in SAMPLE]
    return {
        "cases": len(y),
        "first_call_s": first,
        "seconds": seconds,
        "per_case_ms": 1e3 * seconds / len(y),
        "error": _worst(found),
    }


def plain_figures() -> dict[str, Any]:
    """Milliseconds a case of the plain loop on one core, and its errors on the same sample."""
    return _one_by_one(lambda case: plain_march(linear(case)), plain_march)


def delay_figures() -> dict[str, Any] | None:
    """The same for jitcdde; None where it or a C compiler is missing."""
    case = paper_case(7.0 * N_PER_MM2, YAWS[0])
    if not (shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")):
        return None
    try:
        equation = DelayEquation(float(case.rig.wrap_tail), float(case.rig.wrap_head))
    except ImportError:
        return None
    return _one_by_one(lambda case: equation.solve(linear(case)), equation.solve)


def _one_by_one(solve: Callable, timed: Callable) -> dict[str, Any]:
    cases = [paper_case(TENSIONS[t], YAWS[k]) for t, k in SAMPLE]
    found = [errors(solve(case), truth(case)) for case in cases]
    ready = [linear(case) for case in cases]
    each = [min(_seconds(partial(timed, c)) for _ in range(REPEATS)) for c in ready]
    return {"per_case_ms": 1e3 * float(np.mean(each)), "error": _worst(found)}


def _worst(found: list[dict[str, float]]) -> dict[str, float]:
    return {name: max(e[name] for e in found) for name in found[0]}


def _seconds(run: Callable[[], Any]) -> float:
    begun = time.perf_counter()
    run()
    return time.perf_counter() - begun
