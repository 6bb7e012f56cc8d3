"""How long a diagnosis takes from the shell to its report, four campaigns beside what was wanted of each; and its
predictions the old way: compiled for one campaign, eight points at a time."""

import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.api.resolve import candidates_of
from belt_sim.campaign import read_campaign
from belt_sim.campaign.folder import write_campaign
from belt_sim.case import Case
from belt_sim.diagnosis.readings.forward import Forward
from belt_sim.diagnosis.readings.samples import samples_of
from belt_sim.effects.pipeline import indicate
from belt_sim.files import ROOT
from belt_sim.jax_setup import jit_float64
from belt_sim.line.march import march_traced, plan_steps
from belt_sim.model import MODELS
from belt_sim.si import DEGREE, N_PER_MM2
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import Plan, grid

CAMPAIGN, MODEL = "slack_belt", "strip"
POINTS = 32
OLD_POINTS = 8  # a batch, the old way
BOOTSTRAPS = 1000
PATIENCE = 900.0  # [s]: a diagnosis that takes longer is ended, and said to have taken longer
LARGE = Plan(
    runs=grid([t * N_PER_MM2 for t in (7, 10, 15, 20, 30, 40)], [y * DEGREE for y in (-0.042, 0.021, 0.042)]),
    length=100.0,
    signals={f"y{k}": f"point_{k}" for k in (1, 2, 3, 4)},
)
LONG = Plan(  # 50 readings a second
    runs=grid([t * N_PER_MM2 for t in (7, 10, 15, 20, 40)], [y * DEGREE for y in (-0.042, 0.042)]),
    spacing=0.01,
    signals=LARGE.signals,
)
#: what is hidden, of which plan, and the seconds wanted on two quiet cores
WANTED = {
    "one effect: 10 runs, 2 signals, 60 m": ({"id": "taper", "kappa_t": 1.27e-6}, Plan(), 10.0),
    "a stranger, of the same size": ({"id": "yaw_creep", "share": 0.05, "time": 25.0}, Plan(), 30.0),
    "one effect: 20 runs, 4 signals, 100 m": ({"id": "crown", "c": 1.6e-4}, LARGE, 60.0),
    "a stranger at 50 Hz: 12 runs, 4 signals, 60 m": ({"id": "square_moment", "d": 12.0}, LONG, 60.0),
}


def whole_diagnoses() -> list[dict[str, Any]]:
    """Seconds by the clock and of the processor that ``belt-sim diagnose`` takes in a process of its own, the most
    memory [MB] of it or one before it, programs that it had to compile, verdict; one row for each of WANTED."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for number, (what, (hidden, plan, limit)) in enumerate(WANTED.items()):
            campaign, _ = make_campaign(hidden=[hidden], base=MODEL, seed=number, plan=plan)
            write_campaign(campaign, Path(folder) / f"campaign_{number}")
            measured = _call(Path(folder) / f"campaign_{number}", Path(folder) / f"diagnosed_{number}")
            found.append({"what": what, "limit_s": limit, "bootstraps": BOOTSTRAPS} | measured)
    return found


def _call(campaign: Path, out: Path) -> dict[str, Any]:
    program = "from belt_sim.cli import main; main()"
    settings = [f"campaign={campaign}", f"model={MODEL}", f"bootstraps={BOOTSTRAPS}", f"hydra.run.dir={out}"]
    programs, spent = _programs(), resource.getrusage(resource.RUSAGE_CHILDREN)
    begun = time.perf_counter()
    command = [sys.executable, "-c", program, "diagnose", *settings]
    with suppress(subprocess.TimeoutExpired):
        subprocess.run(command, cwd=ROOT, check=True, capture_output=True, timeout=PATIENCE)
    wall, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
    result = out / "diagnosis.json"
    return {
        "wall_s": wall,
        "processor_s": after.ru_utime + after.ru_stime - spent.ru_utime - spent.ru_stime,
        "memory_mb": after.ru_maxrss / 1024.0,
        "compiled": _programs() - programs,
        "verdict": json.loads(result.read_text())["verdict"] if result.is_file() else "not finished",
    }


def _programs() -> int:
    """How many programs JAX's cache on disk holds."""
    folder: str | None = jax.config.values["jax_compilation_cache_dir"]
    return sum(1 for p in Path(folder).glob("*-cache")) if folder else 0


def prediction_figures() -> dict[str, Any]:
    """Processor milliseconds of predictions at POINTS points, old and new, how far these are apart, and seconds of the
    first: of a campaign's own code the first of every campaign, of code for all what it costs to load (or to compile).
    """
    campaign, model = read_campaign(CAMPAIGN), MODELS[MODEL]
    classes = [c for c in candidates_of(None, model, None) if c.id not in ("edge_profile", "weld")]
    forward = Forward(samples_of(campaign), model, classes)
    vectors = np.repeat(forward.null()[None], POINTS, axis=0)
    vectors[:, 0] = np.linspace(0.0, 1.0, POINTS)
    old, few = _old(forward), vectors[:OLD_POINTS]
    firsts = _seconds(lambda: old(few)), _seconds(lambda: forward.values(few))
    apart = float(np.abs(old(few) - forward.values(few)).max())
    return {
        "points": POINTS,
        "old_first_s": firsts[0],
        "new_first_s": firsts[1],
        "old_ms": 1e3
        * _seconds(lambda: [old(vectors[k : k + OLD_POINTS]) for k in range(0, POINTS, OLD_POINTS)])
        / POINTS,
        "new_ms": 1e3 * _seconds(lambda: forward.values(vectors)) / POINTS,
        "apart_m": apart,
    }


def _seconds(run: Callable[[], Any]) -> float:
    begun = time.process_time()
    run()
    return time.process_time() - begun


def _old(forward: Forward) -> Callable[[np.ndarray], np.ndarray]:
    """Predictions of eight points by code compiled for the travel, runs and samples of one campaign."""
    samples = forward.samples
    travel = samples.end
    plan = plan_steps(samples.cases, travel=travel, step=forward.step, keep=forward.step)
    one = partial(_one, plan=plan, length=travel, forward=forward)
    runs = jax.vmap(one, in_axes=(None, Case(rig=None, belt=None, settings=0), 0, 0))  # type: ignore[arg-type]
    march = jit_float64(jax.vmap(runs, in_axes=(0, None, None, None)))
    points = [int(s.at[-1]) - 1 for s in samples.signals]
    return lambda v: np.asarray(march(v, samples.cases, samples.travel, samples.yaw_at))[:, :, points]


def _one(vector, case: Case, travel, yaw_at, *, plan, length: float, forward: Forward):
    """Readings (4, n) of one run."""
    numbers: dict[type, dict] = {c: {} for c in forward.classes}
    for k, slot in enumerate(forward.slots):
        numbers[slot.effect][slot.name] = vector[k] * slot.scale
    effects = tuple(c(**values) for c, values in numbers.items())
    curves = march_traced(case, effects, length, model=forward.model, plan=plan)
    shown = indicate(curves, case, effects, jnp.append(travel, yaw_at))
    return shown.y[:, :-1] - shown.y[:, -1:]
