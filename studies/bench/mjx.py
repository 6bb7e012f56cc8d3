"""What a step of the 3D belt on MJX costs: ``python -m studies.bench.mjx RIG CASES [segments]``.

And a gradient backwards through many steps: ``python -m studies.bench.mjx gradient [STEPS PIECE]``.
"""

import math
import resource
import sys
import time

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.jax_setup import in_float64, least_effort, prepare
from belt_sim.settings import make_case
from belt_sim.space.options import Options

COARSE = Options(dx=0.04, dt=1.5e-3, run_in=0.3, settle=0.2, yaw_time=0.15, acceleration=3.0)
NEAR = 0.01  # of the yaw, for the central difference


@in_float64
def main(rig: str, count: int, segments: int) -> None:
    """Prints seconds of preparation, tracing and compilation, milliseconds a step, memory."""
    from belt_sim.mjx import prepare as made
    from belt_sim.space.mjx import SEGMENT, carried_state, compile_batch, padded, plan, stack_cases

    begun = time.perf_counter()
    cases = [make_case(rig=rig, tension=float(t), yaw=-0.042, travel=2.0) for t in np.linspace(20.0, 60.0, count)]
    ready = made(cases, options=Options())
    models, axes = stack_cases([r.model for r in ready])
    data = jax.tree.map(lambda *v: np.stack([np.asarray(x) for x in v]), *[carried_state(r.data) for r in ready])
    still, some = ready[0].data.mjx, padded([plan(ready[0], 0.1)] * count, SEGMENT)
    models, still, data, some = jax.device_put((models, still, data, some))
    prepared = time.perf_counter()
    lowered = compile_batch(axes).lower(models, still, data, some)
    traced = time.perf_counter()
    march = lowered.compile()
    compiled = time.perf_counter()
    took = []
    for _ in range(segments):
        cpu, wall = time.process_time(), time.perf_counter()
        data, reads = march(models, still, data, some)
        jax.block_until_ready(reads)
        took.append((time.perf_counter() - wall, time.process_time() - cpu))
    wall, cpu = 1e3 * np.median(took, axis=0) / SEGMENT
    device = jax.devices()[0]
    peak = (device.memory_stats() or {}).get("peak_bytes_in_use", 0)
    stations = ready[0].model.belt.shape.stations
    print(
        f"| {rig}, {stations} stations | {count} | {prepared - begun:.1f} + {traced - prepared:.1f} + "
        f"{compiled - traced:.1f} s | {wall:.3f} ms ({cpu:.3f} CPU) | {wall / count:.4f} ms | {peak / 1e9:.2f} GB | "
        f"{device.device_kind} | finite {np.isfinite(np.asarray(reads)).all()} |",
        flush=True,
    )


@in_float64
def gradient(steps: int = 2000, piece: int = 50) -> None:
    """Prints y1 of a belt of 60 N/mm2 on the coarse short rig, so many steps after its tail pulley began to turn by 1
    mrad; its derivative by the yaw, by ``jax.grad`` in pieces and by a central difference; seconds and memory."""
    from belt_sim.mjx import READING, march, plan
    from belt_sim.mjx import prepare as made

    ready = made([make_case(rig="rope_example", tension=60.0, yaw=math.degrees(1e-3))], options=COARSE)[0]
    rows = jax.tree.map(jnp.asarray, plan(ready, 2.0 * COARSE.dt * steps))
    begin = int(np.argmax(np.asarray(rows.yaw[:, 1]) > 0.0))
    before, after = (jax.tree.map(lambda c, s=s: c[s], rows) for s in (slice(begin), slice(begin, begin + steps)))
    brief = least_effort()

    def y1(scale: jax.Array, data: object) -> jax.Array:
        return march(ready.model, data, after._replace(yaw=scale * after.yaw), piece=piece)[1][-1, READING["y"]][0]

    data = jax.jit(lambda: march(ready.model, ready.data, before)[0], compiler_options=brief)()
    value = jax.jit(y1, compiler_options=brief)
    below, at, above = (float(value(s, data)) for s in (1.0 - NEAR, 1.0, 1.0 + NEAR))
    begun = time.perf_counter()
    run = jax.jit(jax.grad(y1)).lower(1.0, data).compile(compiler_options=brief)
    compiled, resident = time.perf_counter(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    slope = float(run(1.0, data))
    took, resident = time.perf_counter() - compiled, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - resident
    temporary = run.memory_analysis().temp_size_in_bytes
    difference = (above - below) / (2.0 * NEAR)
    print(f"{steps} steps in pieces of {piece}, {float(after.travel[-1]):.2f} m after the yaw, y1 {1e3 * at:.4f} mm")
    off = f"{100.0 * abs(slope / difference - 1.0):.2g} % off"
    print(f"slope {1e6 * slope:.4f} um/mrad, by a central difference {1e6 * difference:.4f}: {off}")
    print(f"compiled in {compiled - begun:.0f} s, run in {took:.0f} s", end="; ")
    print(f"{temporary / 1e6:.0f} MB for it in XLA's plan, {resident / 1e3:.0f} MB more resident")


if __name__ == "__main__":
    prepare(space=True)
    if sys.argv[1] == "gradient":
        gradient(*map(int, sys.argv[2:]))
    else:
        main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 6)
