"""Many tensions and yaws of the rope at once: ``python -m studies.mjx_batch tensions=[7,10,20,40]``.

MJX integrates, on whatever JAX_PLATFORMS names (the CPU by default) and compares every case with the rope law.
"""

import math
import time
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from rich.console import Console
from rich.table import Table

from belt_sim.analytic.march import march
from belt_sim.analytic.model import analytic_model
from belt_sim.case import Case, Schedule, Settings
from belt_sim.config import belt_from, rig_from
from belt_sim.curves import Curves, late_rates
from belt_sim.errors import InputError, RunFailed
from belt_sim.jax_setup import in_float64
from belt_sim.si import DEGREE, MM, MM_PER_M, N_PER_MM2
from studies.application import application
from studies.mjx_rope import PAUSE, SETTLE, SPEED_UP, YAW_TIME, Rope, begin, points, step

DX = 0.05  # [m]: y is off by 0.7 dx times the yaw at the start, by 1 % of itself after 2 m; both shrink with dx
EVERY = 0.025  # [m] between rows of the curves


@in_float64
def simulate_ropes(case: Case, tensions, yaws, *, travel: float, dx: float = DX) -> Curves:
    """Curves of the rope of ``case`` at every pair of tension [Pa] and yaw step [rad], shape (c,) both.

    travel [m]; dx [m] between stations. Returns travel, shape (n,), and y, shape (c, 4, n), from before the yaw on.
    Raises InputError for arrays that do not match, RunFailed when a rope diverges.
    """
    tensions, yaws = np.asarray(tensions, float), np.asarray(yaws, float)
    if tensions.shape != yaws.shape or tensions.ndim != 1 or not len(tensions) or tensions.min() <= 0.0:
        raise InputError("tensions, yaws", f"{tensions.shape}, {yaws.shape}", "", "give one positive tension a yaw")
    rope = Rope.of(case, dx)
    each = max(round(EVERY / (rope.speed * rope.dt)), 1)
    standing = SETTLE + YAW_TIME + PAUSE + 0.5 * SPEED_UP
    rows = math.ceil((standing + travel / rope.speed) / (each * rope.dt)) + 1

    def advance(state, weight, yaw):
        state = jax.lax.scan(lambda s, _: (step(rope, s, weight, yaw), None), state, None, length=each)[0]
        return state, (state.travel, points(rope, state))

    def run(weight, yaw):
        return jax.lax.scan(lambda s, _: advance(s, weight, yaw), begin(rope), None, length=rows)[1]

    weights = float(case.belt.density) * float(case.rig.gravity) / tensions
    gone, y = (np.asarray(v) for v in jax.jit(jax.vmap(run))(jnp.asarray(weights), jnp.asarray(yaws)))
    if not np.all(np.isfinite(y)):
        raise RunFailed("a rope of the batch diverged: give a smaller dx")
    grid = np.arange(math.floor(travel / EVERY + 1e-9) + 1) * EVERY
    at_rest = np.flatnonzero(gone[0] <= 0.0)[-1]
    kept = [[np.interp(grid, gone[0, at_rest:], curve) for curve in one.T[:, at_rest:]] for one in y]
    return Curves(travel=grid, y=np.array(kept))


def mjx_batch(config: dict[str, Any]) -> None:
    """Every tension with every yaw; a table beside the rope law."""
    pairs = [(t, y) for t in config["tensions"] for y in config["yaws"]]
    tensions, yaws = np.array(pairs, float).T * [[N_PER_MM2], [DEGREE]]
    rig, belt, travel = rig_from(config["rig"]), belt_from(config["belt"]), float(config["travel"])
    settings = [Settings(tension=t, yaw=Schedule.step(y)) for t, y in zip(tensions, yaws, strict=True)]
    cases = [Case(rig=rig, belt=belt, settings=s) for s in settings]
    begun, used = time.perf_counter(), time.process_time()
    curves = simulate_ropes(cases[0], tensions, yaws, travel=travel, dx=float(config["dx"]))
    wall, used = time.perf_counter() - begun, time.process_time() - used
    table = Table("N/mm2", "yaw deg", "y1 at the end mm", "law mm", "late rate of point 1 mm/m", "law mm/m")
    for (tension, yaw), case, y in zip(pairs, cases, curves.y, strict=True):
        law = march(case, analytic_model("rope"), travel=travel)
        rates = [late_rates(c)[0] / MM_PER_M for c in (Curves(travel=curves.travel, y=y), law)]
        ends = (y[0, -1] / MM, float(np.interp(curves.travel[-1], law.travel, law.y[0])) / MM)
        table.add_row(f"{tension:g}", f"{yaw:g}", *(f"{v:.4f}" for v in (*ends, *rates)))
    console = Console()
    console.print(table)
    console.print(
        f"{len(pairs)} cases on {jax.default_backend()}: {wall:.0f} s, {used:.0f} CPU s, compilation included"
    )


if __name__ == "__main__":
    application("mjx_batch", mjx_batch)
