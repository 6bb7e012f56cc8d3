"""A steering controller on a batch of belts on MuJoCo MJX: ``python examples/steer_on_mjx.py``.

The head pulley of every belt is skewed by another angle, which pushes the belt sideways. A controller reads y of point
1 and turns the tail pulley. All belts run at once: jax.vmap over models, data and commands, jax.lax.scan over time.
"""

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.config import case_asked
from belt_sim.jax_setup import in_float64, prepare
from belt_sim.mjx import READING, Data, Model, command, stacked, step
from belt_sim.mjx import prepare as prepare_belts
from belt_sim.mujoco3d import Options

GAIN = 2e-3  # rad of yaw per mm of y
SPEED, ACCELERATION = 1.0, 1.5  # m/s, m/s2
SKEWS = (0.01, 0.02, 0.04)  # deg, of the head pulleys
COARSE = Options(dx=0.04, dt=1.5e-3, settle=0.2, run_in=0.3)


@in_float64
def steered(gains: np.ndarray, skews: np.ndarray, steps: int) -> np.ndarray:
    """y of point 1 [mm] of every belt after every step, (belts, steps), under yaw = -gain * y.

    gains [rad per mm], skews [deg]: of the belts, (belts,).
    """
    case = case_asked(rig="rope_example", tension=40.0, yaw=0.0, travel=2.0)
    ready = prepare_belts([case] * len(gains), options=COARSE)
    models, axes = stacked([r.model for r in ready])
    data = jax.tree.map(lambda *v: jnp.stack([jnp.asarray(x) for x in v]), *[r.data for r in ready])

    def run(model: Model, data: Data, gain: jax.Array, skew: jax.Array) -> jax.Array:
        def one(data: Data, k: jax.Array) -> tuple[Data, jax.Array]:
            speed = jnp.minimum(SPEED, ACCELERATION * model.dt * k)
            y = 1e3 * data.reading[READING["y"]][0]
            yaw = jnp.stack([skew * jnp.minimum(model.dt * k / 0.3, 1.0), -gain * y])  # the skew sets in within 0.3 s
            data = step(model, data, command(model, data, speed, yaw))
            return data, 1e3 * data.reading[READING["y"]][0]

        return jax.lax.scan(one, data, jnp.arange(steps))[1]

    several = jax.jit(jax.vmap(run, in_axes=(axes, 0, 0, 0)))
    return np.asarray(several(models, data, jnp.asarray(gains), jnp.deg2rad(jnp.asarray(skews))))


def main() -> None:
    """Print where the belts are after 3 s with and without the controller."""
    prepare(space=True)
    count = len(SKEWS)
    y = steered(np.repeat([0.0, GAIN], count), np.tile(SKEWS, 2), 2000)[:, -1]
    print("head skewed, deg | y of point 1 after 3 s, mm: free | steered")
    for skew, free, held in zip(SKEWS, y[:count], y[count:], strict=True):
        print(f"{skew:16.3f} | {free:32.3f} | {held:7.3f}")


if __name__ == "__main__":
    main()
