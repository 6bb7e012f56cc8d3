"""What a step of the 3D belt on MJX costs: ``python -m studies.bench.mjx RIG CASES [segments]``."""

import sys
import time

import jax
import numpy as np

from belt_sim.jax_setup import in_float64, prepare
from belt_sim.settings import make_case
from belt_sim.space.options import Options


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


if __name__ == "__main__":
    prepare(space=True)
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 6)
