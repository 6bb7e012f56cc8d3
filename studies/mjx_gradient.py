"""A gradient backwards through many steps of a belt on MJX: ``python -m studies.mjx_gradient [STEPS PIECE]``."""

import math
import resource
import sys
import time

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.jax_setup import LEAST_EFFORT, in_float64, known_options, prepare
from belt_sim.settings import make_case
from belt_sim.space.options import Options
from studies.application import show_help

STEP = 1.5e-3  # [s]
COARSE = Options(dx=0.04, dt=STEP, run_in=0.3, settle=0.2, yaw_time=0.15, acceleration=3.0)
NEAR = 0.01  # of the yaw, for the central difference


@in_float64
def gradient(steps: int = 2000, piece: int = 50) -> None:
    """Prints y1 of a belt of 60 N/mm2 on the coarse short rig, so many steps after its tail pulley began to turn by 1
    mrad; its derivative by the yaw, by ``jax.grad`` in pieces and by a central difference; seconds and memory."""
    from belt_sim.mjx import READING, MjxData, march, plan
    from belt_sim.mjx import prepare as made

    ready = made([make_case(rig="rope_example", tension=60.0, yaw=math.degrees(1e-3))], options=COARSE)[0]
    rows = jax.tree.map(jnp.asarray, plan(ready, 2.0 * STEP * steps))
    begin = int(np.argmax(np.asarray(rows.yaw[:, 1]) > 0.0))
    before, after = (jax.tree.map(lambda c, s=s: c[s], rows) for s in (slice(begin), slice(begin, begin + steps)))
    brief = known_options(LEAST_EFFORT)

    def y1(scale: jax.Array, data: MjxData) -> jax.Array:
        return march(ready.model, data, after._replace(yaw=scale * after.yaw), piece=piece)[1][-1, READING["y"]][0]

    data = jax.jit(lambda: march(ready.model, ready.data, before)[0], compiler_options=brief)()
    value = jax.jit(y1, compiler_options=brief)
    below, at, above = (float(value(s, data)) for s in (1.0 - NEAR, 1.0, 1.0 + NEAR))
    begun = time.perf_counter()
    run = jax.jit(jax.grad(y1)).lower(1.0, data).compile(compiler_options=brief)
    compiled, resident = time.perf_counter(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    slope = float(run(1.0, data))
    took, resident = time.perf_counter() - compiled, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - resident
    temporary = getattr(run.memory_analysis(), "temp_size_in_bytes", 0)
    difference = (above - below) / (2.0 * NEAR)
    print(f"{steps} steps in pieces of {piece}, {float(after.travel[-1]):.2f} m after the yaw, y1 {1e3 * at:.4f} mm")
    off = f"{100.0 * abs(slope / difference - 1.0):.2g} % off"
    print(f"slope {1e6 * slope:.4f} um/mrad, by a central difference {1e6 * difference:.4f}: {off}")
    print(f"compiled in {compiled - begun:.0f} s, run in {took:.0f} s", end="; ")
    print(f"{temporary / 1e6:.0f} MB for it in XLA's plan, {resident / 1e3:.0f} MB more resident")


if __name__ == "__main__":
    show_help(__doc__)
    prepare(space=True)
    gradient(*map(int, sys.argv[1:]))
