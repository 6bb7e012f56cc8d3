"""Rope and grid by MJX alone, tendons and all: ``python -m studies.bench.mjx_plain rope|grid``.

MJX's own step is explicit: of a belt of real steel it may take 6 us at most. Prints milliseconds a step on the CPU.
"""

import sys
import time

import jax
import mujoco
import numpy as np
from mujoco import mjx

from belt_sim.jax_setup import in_float64, prepare
from belt_sim.scene_parts import SceneParts
from belt_sim.settings import make_case
from belt_sim.space import mjx as mjx_interface  # remembers bodies of coordinates: without it tracing takes minutes
from belt_sim.space.machine import build_scene
from belt_sim.space.mujoco_interface import compile_model
from belt_sim.space.options import Options, fit_options

STEPS = 20
DT = 5e-6  # [s], near the largest stable one


@in_float64
def main(kind: str) -> None:
    """Compile the short rig's belt as it is, without the dummy equality, and step it."""
    assert mjx_interface.SLOW
    case = make_case(rig="rope_example", tension=40.0, yaw=-0.042, travel=2.0)
    options = fit_options(Options(), case, kind)
    spec, scene = build_scene(case, kind, options, SceneParts.from_case(case, np.inf))
    for element in list(spec.equalities):
        spec.delete(element)
    model = compile_model(spec)
    model.opt.timestep, model.opt.integrator = DT, mujoco.mjtIntegrator.mjINT_EULER
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    begun = time.process_time()
    m, d = mjx.put_model(model, impl="jax"), mjx.put_data(model, data, impl="jax")
    kinds = jax.tree.map(lambda v: np.asarray(v).dtype, d)

    def one(m: mjx.Model, d: mjx.Data) -> mjx.Data:
        return jax.tree.map(lambda v, kind: v.astype(kind), mjx.step(m, d), kinds)  # a step makes int64 of int32

    step = jax.jit(one).lower(m, d).compile()
    compiled_after = time.process_time() - begun
    d = jax.block_until_ready(step(m, d))
    begun = time.process_time()
    for _ in range(STEPS):
        d = step(m, d)
    jax.block_until_ready(d)
    took = 1e3 * (time.process_time() - begun) / STEPS
    tendons, finite = model.ntendon, bool(np.isfinite(np.asarray(d.qpos)).all())
    print(
        f"{kind}: {scene.mesh.stations} stations, {tendons} tendons: {took:.1f} CPU ms a step of {1e6 * DT:g} us, "
        f"{took / DT / 1e3:.0f} CPU s a simulated second; tracing and compilation {compiled_after:.0f} CPU s; "
        f"finite {finite}"
    )


if __name__ == "__main__":
    prepare(space=True)
    main(sys.argv[1])
