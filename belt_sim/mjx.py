"""engine=mjx: the 3D belt on MuJoCo MJX, many cases at once in time.

For control loops of one's own: ``prepare``, ``command``, ``step``, ``stacked`` (examples/batch_on_mjx.ipynb).
"""

import io
from contextlib import redirect_stdout

with redirect_stdout(io.StringIO()):  # it prints that Warp is not installed, which is not needed
    import mujoco.mjx  # noqa: F401

from belt_sim.space.mjx_engine import simulate, simulate_batch
from belt_sim.space.mjx_interface import stack_cases
from belt_sim.space.mjx_model import READING, MjxData, MjxModel, PreparedCase, command, prepare
from belt_sim.space.mjx_step import step
from belt_sim.space.run import Command

__all__ = [
    "READING",
    "Command",
    "MjxData",
    "MjxModel",
    "PreparedCase",
    "command",
    "prepare",
    "simulate",
    "simulate_batch",
    "stack_cases",
    "step",
]
