"""The same membrane with MuJoCo's explicit integrator, Euler.

What is compared: the free spans as they are, under tension and gravity; the landed nodes are given an inertia of
1e6 kg, which keeps them in place at no cost and without shortening the step. Left out in the competitor's favour:
carrying and landing the belt, friction, the readings, and the Python loop (all steps are made inside one mj_step call).
"""

import time
from typing import Any

import mujoco
import numpy as np

from belt_sim.space.native import SpaceRun
from studies.bench.space.task import Task

STEPS = 3000  # of a trial: beyond the limit by 1 % the fastest mode grows by a quarter a step
KICK = 1e-3  # [m/s] random speeds of the free nodes that wake every mode
UNSTABLE = 100.0  # [m/s]: the laid belt itself stirs at 3 m/s
WITHIN = 0.01  # of the largest stable step, the end of the bisection
BEYOND = 1.3  # times the largest stable step must fail
REPEATS = 3  # the best of so many
_PLACED = 1e6  # [kg]


def explicit_figures(task: Task) -> dict[str, Any]:
    """Largest stable step [s], milliseconds a step, steps and CPU seconds a metre at the product's belt speed."""
    run, options = task.begin()
    model, free = explicit_model(run)
    low, high = 1e-7, 1e-4
    while high / low > 1.0 + WITHIN:
        middle = (low * high) ** 0.5
        low, high = (middle, high) if stable(model, free, middle) else (low, middle)
    each = min(_cpu_seconds_of_step(model, low) for _ in range(REPEATS))
    per_metre = 1.0 / (low * options.run_speed)
    return {
        "dt_s": low,
        "stable_at_dt": stable(model, free, low),
        f"stable_at_{BEYOND:g}_dt": stable(model, free, BEYOND * low),
        "belt_speed_m_per_s": options.run_speed,
        "ms_per_step": 1e3 * each,
        "steps_per_m": per_metre,
        "cpu_s_per_m": each * per_metre,
    }


def explicit_model(run: SpaceRun) -> tuple[mujoco.MjModel, np.ndarray]:
    """The run's model with Euler steps and its landed nodes put in place; which coordinates are free."""
    solver = run.solver
    model, landed = solver.model, np.zeros(solver.shape, bool)
    wrap = run.laid.pulleys.wrap
    for first, last in zip(wrap.first, wrap.last, strict=True):
        landed[np.arange(first, last + 1) % len(landed)] = True
    placed = np.concatenate([np.ones(solver.base, bool), landed.ravel()])
    model.jnt_stiffness[:] = 0.0
    model.dof_armature[placed] = _PLACED
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    return model, ~placed


def _initial_state(model: mujoco.MjModel, dt: float) -> mujoco.MjData:
    model.opt.timestep = dt
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    return data


def stable(model: mujoco.MjModel, free: np.ndarray, dt: float) -> bool:
    """Whether speeds stay bounded over STEPS steps of ``dt`` [s] after a random kick."""
    data = _initial_state(model, dt)
    data.qvel[free] = KICK * np.random.default_rng(0).standard_normal(int(free.sum()))
    warn = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(_ignore)  # of speeds that are not finite: that is what is asked for
    try:
        mujoco.mj_step(model, data, STEPS)
    finally:
        mujoco.set_mju_user_warning(warn)
    fastest = np.abs(data.qvel).max()
    return bool(np.isfinite(fastest) and fastest < UNSTABLE)


def _ignore(message: str) -> None:
    pass


def _cpu_seconds_of_step(model: mujoco.MjModel, dt: float) -> float:
    data = _initial_state(model, dt)
    begun = time.process_time()
    mujoco.mj_step(model, data, STEPS)
    return (time.process_time() - begun) / STEPS
