"""Learn to steer a belt: two gains of a controller, in two minutes on one core.

python examples/steer_a_belt.py [PICTURE.png]

Four belts of 30 to 50 N/mm2 run at once; in each the tail pulley stands askew by an unknown angle. The controller sees
y1 and y4 and turns the pulley. Adam follows the slope of the mean reward over 3 m of belt by the two gains: differences
of one batch, which on a CPU are cheaper than ``jax.grad`` through the same steps, because less is compiled. A step that
makes the reward worse (with large gains a belt swings up) is taken back and halved. In the end the gains steer four
belts that were not learned from.
"""

import sys
import time
from pathlib import Path

import jax
import matplotlib.pyplot as plt
import numpy as np

from belt_sim.mjx import Ranges, SteeringEnvironment
from belt_sim.settings import make_case
from belt_sim.space import Options

BELTS, CONTROLS, UPDATES, RATE, FADE = 4, 30, 10, 0.3, (0.8, 0.95)  # RATE, FADE: of Adam
NEAR = 0.02  # of the gains, for their slope
RIG = {"centre_distance": 2.0, "head_radius": 0.3, "tail_radius": 0.3}  # [m]: large pulleys take far stations
COARSE = Options(dx=0.07, dt=4e-3, run_in=0.3, settle=0.2, acceleration=3.0)


def make_environment() -> SteeringEnvironment:
    """Belts of three tensions, askew by up to 0.3 mrad."""
    cases = [make_case(rig=RIG, tension=tension, yaw=0.0) for tension in (30.0, 40.0, 50.0)]
    return SteeringEnvironment(cases, options=COARSE, ranges=Ranges(yaw_offset=3e-4), most_yaw=1e-3, y_scale=1e-4)


def rewards(env: SteeringEnvironment, gains: jax.Array, rng: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Rewards and y1 [m] of a belt at every control, (CONTROLS,); gains (2,): on y1 and on y1 - y4."""

    def control(state, _):
        y1, y4 = state.obs[0], state.obs[3]
        state = env.step(state, gains[0] * y1 + gains[1] * (y1 - y4))
        return state, (state.reward, state.metrics["y1"])

    return jax.lax.scan(control, env.reset(rng), length=CONTROLS)[1]


def learn(env: SteeringEnvironment) -> tuple[np.ndarray, np.ndarray]:
    """Gains tried in every update (UPDATES, 2), and the mean reward with them (UPDATES,)."""
    sets = jax.jit(jax.vmap(jax.vmap(lambda g, key: rewards(env, g, key)[0].mean(), (None, 0)), (0, None)))
    beside = NEAR * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
    keys, others = jax.random.split(jax.random.PRNGKey(0), 2 * BELTS).reshape(2, BELTS, -1)
    best, least, step, mean, square, rows = np.zeros(2), -np.inf, np.zeros(2), 0.0, 0.0, []
    for k in range(UPDATES):
        gains = best + step
        value, *around = np.asarray(sets(gains + beside, keys).mean(axis=1))
        rows.append((*gains, value))
        print(f"update {k:2d}: gains {gains[0]:+.3f} {gains[1]:+.3f}, mean reward {value:.4f}", flush=True)
        if not value > least:  # NaN, too
            step = 0.5 * step
            continue
        best, least, slope = gains, value, np.array([around[0] - around[1], around[2] - around[3]]) / (2 * NEAR)
        mean, square = FADE[0] * mean + (1 - FADE[0]) * slope, FADE[1] * square + (1 - FADE[1]) * slope**2
        step = RATE * (mean / (1 - FADE[0] ** (k + 1))) / (np.sqrt(square / (1 - FADE[1] ** (k + 1))) + 1e-9)
    unsteered, steered, *_ = np.asarray(sets(np.outer([0, 1, 1, 1, 1], best), others).mean(axis=1))
    print(f"belts not learned from: mean reward {unsteered:.3f} without steering, {steered:.4f} with the best gains")
    table = np.array(rows)
    return table[:, :2], table[:, 2]


def draw(gains: np.ndarray, learned: np.ndarray, path: Path) -> None:
    """The learning curve, and the gains on the way."""
    fig, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.2), layout="constrained")
    left.semilogy(-learned, "o-", color="tab:blue")
    left.set(xlabel="update", ylabel="mean of (y1 / 0.1 mm)$^2$ and effort", title="Learning curve")
    right.plot(gains[:, 0], "o-", label="on y1")
    right.plot(gains[:, 1], "s--", label="on y1 - y4")
    right.set(xlabel="update", ylabel="gain [1 mrad per 0.1 mm]", title="Gains of the controller")
    right.legend()
    fig.savefig(path, dpi=130)


if __name__ == "__main__":
    jax.config.update("jax_enable_x64", True)
    clock, cpu = time.perf_counter(), time.process_time()
    environment = make_environment()
    steered, curve = learn(environment)
    print(f"{time.perf_counter() - clock:.0f} s, {time.process_time() - cpu:.0f} CPU s, compilation included")
    draw(steered, curve, Path(sys.argv[1] if len(sys.argv) > 1 else "steering.png"))
