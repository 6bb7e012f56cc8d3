"""bs.mjx: belts on MuJoCo MJX for loops of one's own, many at once, on JAX.

``prepare`` cases of one mesh, ``command`` and ``step`` them under jax.jit, jax.vmap (``stack_cases``), jax.lax.scan and
jax.grad; ``PreparedCase.to_mujoco`` shows any of them in MuJoCo's renderer. ``simulate_batch`` runs whole cases.
``SteeringEnvironment`` is the same as an environment of MuJoCo Playground's form. docs/python.md has an example.

``step`` calls MJX's kinematics, com_pos, crb, passive, rne, actuation, sensors and euler; the belt's elasticity, the
implicit solve and landing on the pulleys are this package's: MJX has no flex and no implicit step for one.
"""

from belt_sim.space.mjx import (
    READING,
    MjxData,
    MjxModel,
    PreparedCase,
    command,
    prepare,
    scene,
    stack_cases,
    step,
)
from belt_sim.space.mjx_run import simulate, simulate_batch
from belt_sim.space.run import Command
from belt_sim.space.steering import Ranges, SteeringEnvironment, SteeringState

__all__ = [
    "READING",
    "Command",
    "MjxData",
    "MjxModel",
    "PreparedCase",
    "Ranges",
    "SteeringEnvironment",
    "SteeringState",
    "command",
    "prepare",
    "scene",
    "simulate",
    "simulate_batch",
    "stack_cases",
    "step",
]
