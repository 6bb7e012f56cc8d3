"""What a step of the batched 3D belt costs: ``python -m studies.bench.mjx [native]``.

Milliseconds a step and a case against the number of cases and of stations, compilation apart; with ``native`` beside
MuJoCo's run of the same belt in the same process.
"""

import sys
import time

import jax
import numpy as np

from belt_sim.case import Case, Schedule, Settings
from belt_sim.errors import RunFailed
from belt_sim.jax_setup import in_float64
from belt_sim.mjx.run import marched, prepared, simulate_batch
from belt_sim.mujoco3d.options import Options
from belt_sim.rig import Belt, Rig

RIG = Rig(centre_distance=11.28, head_radius=0.17, tail_radius=0.17, gravity=9.81)
BELT = Belt(width=0.2, thickness=3e-4, youngs_modulus=210e9, density=7850.0, poisson_ratio=0.3)
TRAVEL = 0.5  # [m], after a run-in of as much


def case_at(tension: float) -> Case:
    """The full rig at a tension [N/mm2], yawed by -0.042 deg."""
    return Case(rig=RIG, belt=BELT, settings=Settings(tension=tension * 1e6, yaw=Schedule.step(-0.042 * np.pi / 180)))


@in_float64
def step_time(cases: int, dx: float) -> tuple[int, float]:
    """Stations, and wall milliseconds a step of all ``cases`` together, second run."""
    options = Options(dx=dx, run_in=TRAVEL)
    ready = [prepared(case_at(t), travel=TRAVEL, options=options) for t in np.geomspace(10, 60, cases)]
    arrays = jax.tree.map(lambda *v: np.stack(v), *[(r.belt, r.state, r.plan.commands) for r in ready])
    arrays = jax.device_put(arrays)
    for _ in range(2):
        begun = time.perf_counter()
        jax.block_until_ready(marched(ready[0].shape, *arrays))
        wall = time.perf_counter() - begun
    return ready[0].shape.stations, 1e3 * wall / (len(ready[0].plan.recorded) * options.steps)


def native_beside(travel: float = 1.0) -> None:
    """CPU seconds a metre of one case, MuJoCo's run and this engine's."""
    from belt_sim.mujoco3d.run.simulate import simulate

    begun = time.process_time()
    simulate(case_at(40.0), travel=travel)
    middle = time.process_time()
    simulate_batch([case_at(40.0)], travel=travel)
    compiled = time.process_time()
    found = simulate_batch([case_at(40.0)], travel=travel)[0]
    assert not isinstance(found, RunFailed)
    metres = travel + Options().run_in
    print(
        f"native {(middle - begun) / metres:.2f} CPU s/m, mjx {(time.process_time() - compiled) / metres:.2f} CPU s/m"
    )


def main() -> None:
    """The table."""
    print(jax.devices()[0])
    for cases, dx in ((1, 0.025), (4, 0.025), (16, 0.025), (64, 0.025), (256, 0.025), (1024, 0.025), (64, 0.04),
                      (64, 0.0125)):  # fmt: skip
        if cases > 16 and jax.default_backend() == "cpu":
            continue
        stations, wall = step_time(cases, dx)
        print(f"{cases} cases, {stations} stations: {wall:.2f} ms a step, {wall / cases:.3f} ms a case", flush=True)
    if "native" in sys.argv:
        native_beside()


if __name__ == "__main__":
    main()
