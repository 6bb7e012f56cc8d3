"""engine=mjx beside engine=native: ``python -m studies.mjx_beside_native FILE.csv``.

A row a case: by how much y of the four points differs at most between 0.05 and 2 m, and entry moments and tilts in
means over 0.25 m, each in % of the largest of native. Spans that nothing damps ring after a yaw step, in native the
less the longer its step is; with a drag of 15 1/s they do not. All runs are shared over the cores; cases of MJX of one
mesh, step and drag are one batch.
"""

import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import jax
import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.errors import SimulationError
from belt_sim.io import write_text
from belt_sim.jax_setup import prepare
from belt_sim.settings import make_case
from belt_sim.space.options import Options

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


if __name__ == "__main__":
    main(Path(sys.argv[1]))
