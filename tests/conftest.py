"""Every test sees the modules that stand beside this file (paper_cases), and JAX as the command line sets it up.

Tests use jax.numpy directly, so that float64 is set for the whole process as well; that the package does not need it
is shown in tests/guards/test_imports.py.
"""

import jax

from belt_sim.jax_setup import prepare

prepare()
jax.config.update("jax_enable_x64", True)
