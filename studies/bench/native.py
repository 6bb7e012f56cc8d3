"""What a step of engine=native costs beside MuJoCo's own: ``python -m studies.bench.native``, a minute of one core."""

import time

import mujoco
import numpy as np

from belt_sim.jax_setup import prepare
from belt_sim.settings import make_case
from belt_sim.space.native import SpaceRun, instants_of
from belt_sim.space.options import Options, fit_options
from studies.application import show_help

FIRST, STEPS = 300, 1000


def cost(rig: str, tension: float) -> tuple[float, float, float]:
    """CPU time [ms], medians, of a step and of MuJoCo's share of it, and steps a metre at full speed."""
    case = make_case(rig=rig, tension=tension, yaw=-0.042)
    options = fit_options(Options(settle=0.0, run_in=5.0), case, "flex")
    run, own, whole, own_step = SpaceRun(case, "flex", options), [], [], mujoco.mj_step
    rows, _ = instants_of(run.scene, 5.0)
    state = run.lay(rows[0])

    def timed(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        begun = time.process_time()
        own_step(model, data)
        own.append(time.process_time() - begun)

    mujoco.mj_step = timed
    try:
        for k in range(FIRST + STEPS):
            begun = time.process_time()
            run.step(state, rows[k], rows[k + 1])
            whole.append(time.process_time() - begun)
    finally:
        mujoco.mj_step = own_step
    took = [1e3 * float(np.median(times[FIRST:])) for times in (whole, own)]
    return took[0], took[1], 1.0 / (options.step * options.run_speed)


if __name__ == "__main__":
    show_help(__doc__)
    prepare(space=True)
    for rig, tension in (("rope_example", 20.0), ("test_rig", 10.0), ("test_rig", 40.0)):
        whole, own, steps = cost(rig, tension)
        said = f"{whole:.2f} ms a step, MuJoCo's {own:.2f} ({whole / own:.2f} times)"
        print(f"{rig}, {tension:g} N/mm2: {said}, {1e-3 * whole * steps:.2f} CPU s a metre", flush=True)
