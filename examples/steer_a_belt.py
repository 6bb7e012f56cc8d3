"""Learn to steer a belt: two gains of a controller, in two minutes on a core.

python examples/steer_a_belt.py [PICTURE.png]

Four belts of 30 to 50 N/mm2 run at once; in each the tail pulley stands askew by an unknown angle. The controller sees
y1, where the belt comes onto that pulley, and turns the pulley by a share of y1 and one of its slope along the travel.
Adam follows the slope of the mean reward over 3 m of belt by the two gains: differences of one batch, which on a CPU
are cheaper than ``jax.grad`` through the same steps, because less is compiled. A step that makes the reward worse (with
large gains a belt swings up) is taken back and halved. In the end the gains steer belts that were not learned from.
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
NEAR, LEAD = 0.02, 0.3  # of the gains, for their slope; [m]
RIG = {"centre_distance": 2.0, "head_radius": 0.3, "tail_radius": 0.3}  # [m]: large pulleys take far stations
COARSE = Options(dx=0.07, dt=4e-3, run_in=0.3, settle=0.2, acceleration=3.0)


def make_environment() -> SteeringEnvironment:
    """Belts of three tensions, askew by up to 0.3 mrad."""
    cases = [make_case(rig=RIG, tension=tension, yaw=0.0) for tension in (30.0, 40.0, 50.0)]
    return SteeringEnvironment(cases, options=COARSE, ranges=Ranges(yaw_offset=3e-4), most_yaw=1e-3, y_scale=1e-4)


def steered(env: SteeringEnvironment, gains: jax.Array, rng: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Mean reward of a belt, its y1 [m] at each control, (CONTROLS,); gains (2,): on y1 and on LEAD times its slope."""

    def control(carry, _):
        state, before = carry
        y1 = state.obs[0]
        state = env.step(state, gains[0] * y1 + gains[1] * LEAD * (y1 - before) / env.control_travel)
        return (state, y1), (state.reward, state.metrics["y1"])

    reward, y1 = jax.lax.scan(control, (env.reset(rng), 0.0), length=CONTROLS)[1]
    return reward.mean(), y1


def learn(env: SteeringEnvironment) -> tuple[np.ndarray, np.ndarray]:
    """What was tried in every update: gains and mean reward (UPDATES, 3); and y1 [m] of belts that were not learned
    from, without steering and with the best gains, (2, BELTS, CONTROLS)."""
    sets = jax.jit(jax.vmap(jax.vmap(lambda gains, key: steered(env, gains, key), (None, 0)), (0, None)))
    beside = NEAR * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
    keys, others = jax.random.split(jax.random.PRNGKey(0), 2 * BELTS).reshape(2, BELTS, -1)
    best, least, step, mean, square, rows = np.zeros(2), -np.inf, np.zeros(2), 0.0, 0.0, []
    for k in range(UPDATES):
        gains = best + step
        value, *around = np.asarray(sets(gains + beside, keys)[0].mean(axis=1))
        rows.append((*gains, value))
        print(f"update {k:2d}: gains {gains[0]:+.3f} {gains[1]:+.3f}, mean reward {value:.4f}", flush=True)
        if not value > least:  # NaN, too
            step = 0.5 * step
            continue
        best, least, slope = gains, value, np.array([around[0] - around[1], around[2] - around[3]]) / (2 * NEAR)
        mean, square = FADE[0] * mean + (1 - FADE[0]) * slope, FADE[1] * square + (1 - FADE[1]) * slope**2
        step = RATE * (mean / (1 - FADE[0] ** (k + 1))) / (np.sqrt(square / (1 - FADE[1] ** (k + 1))) + 1e-9)
    reward, y1 = (np.asarray(v)[:2] for v in sets(np.outer([0, 1, 1, 1, 1], best), others))
    told = "without steering {:.3f}, with the best gains {:.4f}".format(*reward.mean(axis=1))
    print(f"mean reward of belts not learned from: {told}")
    return np.array(rows), y1


def draw(tried: np.ndarray, y1: np.ndarray, path: Path) -> None:
    """The learning curve, the gains on the way, and belts that were not learned from."""
    fig, (left, middle, right) = plt.subplots(1, 3, figsize=(11.0, 3.2), layout="constrained")
    left.semilogy(-tried[:, 2], "o-", color="tab:blue")
    left.set(xlabel="update", ylabel="mean of (y1 / 0.1 mm)$^2$ and effort", title="Learning curve")
    middle.plot(tried[:, 0], "o-", label="on y1 [1 mrad per 0.1 mm]")
    middle.plot(tried[:, 1], "s--", label=f"on its slope times {LEAD:g} m")
    middle.set(xlabel="update", ylabel="gain", title="Gains of the controller")
    middle.legend()
    travel = 0.1 * (1.0 + np.arange(CONTROLS))
    for rows, colour, label in zip(y1, ("tab:gray", "tab:blue"), ("not steered", "steered"), strict=True):
        right.plot(travel, 1e3 * rows.T, color=colour, label=[label] + [None] * (len(rows) - 1))
    right.set(xlabel="travel [m]", ylabel="y1 [mm]", title="Belts not learned from")
    right.legend()
    fig.savefig(path, dpi=130)


if __name__ == "__main__":
    jax.config.update("jax_enable_x64", True)
    clock, cpu = time.perf_counter(), time.process_time()
    environment = make_environment()
    attempts, others = learn(environment)
    print(f"{time.perf_counter() - clock:.0f} s, {time.process_time() - cpu:.0f} CPU s, compilation included")
    draw(attempts, others, Path(sys.argv[1] if len(sys.argv) > 1 else "steering.png"))
