"""engine=mjx beside engine=native: ``python -m studies.mjx_beside_native FILE.csv``.

A row a case: by how much y of the four points differs at most between 0.05 and 2 m, and entry moments and tilts in
means over 0.25 m, each in % of the largest of native. Spans that nothing damps ring after a yaw step, in native the
less the longer its step is; with a drag of 15 1/s they do not. All runs are shared over the cores; cases of MJX of one
mesh, step and drag are one batch.

``python -m studies.mjx_beside_native ring``: how fast torsion of a span at rest dies away in a step of both engines.
"""

import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.errors import SimulationError
from belt_sim.io import write_text
from belt_sim.jax_setup import in_float64, least_effort, prepare
from belt_sim.settings import make_case
from belt_sim.space.options import Options, fit_options

TRAVEL = 2.0  # [m]
BEGIN = 0.05  # [m]: before it y is below a hundredth of its largest
MEAN = 0.25  # [m]
HEADER = "rig,tension_n_per_mm2,dt_ms,damping_per_s,off_1_percent,off_2_percent,off_3_percent,off_4_percent,"
HEADER += "largest_y_mm,moment_off_percent,tilt_off_percent,tension_off_percent,native_cpu_s,native_steps"


@dataclass(frozen=True)
class TableCase:
    rig: str
    tension: float
    dt: float
    damping: float = Options().damping

    @property
    def case(self) -> Case:
        """Sticking, the tail pulley yawed by -0.042 deg."""
        return make_case(rig=self.rig, tension=self.tension, yaw=-0.042, travel=TRAVEL)

    @property
    def options(self) -> Options:
        """The usual ones but for the step [s] and the drag [1/s] of the free belt."""
        return Options(dt=self.dt, damping=self.damping)


SHORT = [TableCase("rope_example", t, dt) for t in (7.0, 20.0, 40.0) for dt in (1e-3, 5e-4, 2.5e-4)]
CALM = [TableCase("rope_example", t, 1e-3, damping=15.0) for t in (7.0, 20.0, 40.0)]
CASES = [*SHORT, *CALM, TableCase("test_rig", 40.0, 1e-3)]


def on_the_cpu() -> None:
    """In a worker: leave the GPU alone."""
    jax.config.update("jax_platforms", "cpu")
    prepare(space=True)


def native(asked: TableCase) -> tuple[Curves, float]:
    """By MuJoCo, step by step; and CPU time [s]."""
    from belt_sim.space.native import run_native

    begun = time.process_time()
    curves = run_native(asked.case, travel=TRAVEL, options=asked.options)
    return curves, time.process_time() - begun


def on_mjx(asked: list[TableCase]) -> list[Curves | SimulationError]:
    """By MJX, cases of one rig, step and drag at once."""
    from belt_sim.mjx import simulate_batch

    begun = time.perf_counter()
    found = simulate_batch([a.case for a in asked], travel=TRAVEL, options=asked[0].options, chunk=len(asked))
    took = time.perf_counter() - begun
    print(f"{asked[0].rig}, {1e3 * asked[0].dt:g} ms, {len(asked)} cases on MJX: {took:.0f} s", flush=True)
    return list(found)


def row(asked: TableCase, mine: Curves, reference: Curves, cpu: float) -> str:
    """One line of the table."""
    at = mine.travel[(mine.travel > BEGIN) & (mine.travel < reference.travel[-1])]
    y, wanted = (np.array([np.interp(at, c.travel, point) for point in c.y]) for c in (mine, reference))
    off = 100.0 * np.abs(y - wanted).max(axis=1) / np.abs(wanted).max()
    begins = np.arange(BEGIN, at[-1] - MEAN, MEAN)

    def means(curves: Curves, name: str) -> np.ndarray:
        """Over MEAN, of the upper and the lower span."""
        rows = [(curves.travel >= b) & (curves.travel < b + MEAN) for b in begins]
        return np.array([np.asarray(getattr(curves, name))[:, row].mean(axis=1) for row in rows])

    assert mine.extra is not None
    assert reference.extra is not None
    numbers = [asked.tension, 1e3 * asked.dt, asked.damping, *off, 1e3 * np.abs(wanted).max()]
    for name in ("moment", "tilt"):
        apart, most = np.abs(means(mine, name) - means(reference, name)).max(), np.abs(means(reference, name)).max()
        numbers.append(100.0 * apart / most)
    numbers += [100.0 * (mine.extra["tension"][-1] / reference.extra["tension"][-1] - 1.0), cpu]
    return f"{asked.rig}," + ",".join(f"{v:.4g}" for v in [*numbers, reference.extra["steps"][-1]])


def main(path: Path) -> None:
    """Run both and write the table."""
    kinds = dict.fromkeys((a.rig, a.dt, a.damping) for a in CASES)
    batches = [[a for a in CASES if (a.rig, a.dt, a.damping) == kind] for kind in kinds]
    with ProcessPoolExecutor(mp_context=get_context("spawn"), initializer=on_the_cpu) as pool:
        together = [pool.submit(on_mjx, some) for some in batches]
        reference = {a: pool.submit(native, a) for a in CASES}
        mine: dict[TableCase, Curves] = {}
        for some, found in zip(batches, together, strict=True):
            for a, curves in zip(some, found.result(), strict=True):
                if isinstance(curves, SimulationError):
                    raise curves
                mine[a] = curves
        lines = [HEADER] + [row(a, mine[a], *reference[a].result()) for a in CASES]
    write_text(path, "\n".join(lines) + "\n")
    print("\n".join(lines))


RING_TENSION, SETTLE, RING = 20.0, 0.5, 0.3  # [N/mm2], [s], [s]


@in_float64
def ring(dt: float, kicks: list[float]) -> None:
    """Prints the rate [1/s] at which the first mode of torsion of the upper span dies away, undamped but for steps of
    ``dt`` [s], when its edges are struck apart by kicks [m/s]; of implicit Euler it is omega^2 dt / 2."""
    from belt_sim.mjx import READING, march, plan
    from belt_sim.mjx import prepare as made
    from belt_sim.space.native import SpaceRun, instants_of

    case = make_case(rig="rope_example", tension=RING_TENSION, yaw=0.0)
    options, steps = Options(dt=dt, settle=SETTLE, run_in=0.3), round(RING / dt)
    ready = made([case], options=options)[0]
    laid, length = ready.scene.mesh.laid, float(case.rig.span_length)
    x, tilts = np.clip(laid[..., 0] / length, 0.0, 1.0), READING["tilt"].start
    blow = np.zeros(laid.shape)
    blow[..., 2] = np.where(laid[..., 2] > 0.0, np.sin(np.pi * x), 0.0) * [1.0, -1.0]
    rows = plan(ready, 0.1)
    rest = jax.tree.map(lambda c: jnp.broadcast_to(jnp.asarray(c[0]), (steps, *np.shape(c)[1:])), rows)
    on_mjx, still = jax.jit(march, compiler_options=least_effort()), ready.data
    for _ in range(round(SETTLE / RING) + 1):
        still = on_mjx(ready.model, still, rest)[0]

    def said(tilt: np.ndarray) -> str:
        top = 1 + np.flatnonzero((tilt[1:-1] > tilt[:-2]) & (tilt[1:-1] >= tilt[2:]) & (tilt[1:-1] > 0.2 * tilt.max()))
        rate, omega = -np.polyfit(dt * top, np.log(tilt[top]), 1)[0], 2.0 * np.pi / (dt * np.diff(top).mean())
        return f"{rate:.2f} 1/s from {1e3 * tilt.max():.2g} mrad (omega^2 dt / 2 = {0.5 * omega**2 * dt:.2f})"

    for kick in kicks:
        qvel = still.mjx.qvel.at[-blow.size :].add(kick * blow.ravel())
        struck = still._replace(mjx=still.mjx.replace(qvel=qvel))
        read = on_mjx(ready.model, struck, rest._replace(drag=jnp.zeros_like(rest.drag)))[1]
        run = SpaceRun(case, "flex", fit_options(options, case, "flex"))
        instants, resting = instants_of(run.scene, 0.1)
        state, tilt, now = run.lay(instants[0]), [], instants[resting - 1].copy()
        for k in range(resting - 1):
            run.step(state, instants[k], instants[k + 1])
        state.slide_rates += kick * blow
        now[6:8] = 0.0
        for _ in range(steps):
            run.step(state, now, now)
            tilt.append(state.readings[tilts])
        print(f"{1e3 * dt:g} ms: native {said(np.array(tilt))}, mjx {said(np.asarray(read)[:, tilts])}", flush=True)


if __name__ == "__main__":
    if sys.argv[1] == "ring":
        prepare(space=True)
        ring(1e-3, [0.005, 0.025, 0.05, 0.1])
        ring(2.5e-4, [0.005, 0.05])
    else:
        main(Path(sys.argv[1]))
