"""Every test sees the modules that stand beside this file (paper_cases), and JAX as the command line sets it up.

Tests use jax.numpy directly, so that float64 is set for the whole process as well; that the package does not need it
is shown in tests/guards/test_imports.py.
"""

from functools import partial

import jax

from belt_sim import jax_setup

#: tests compile many programs and run each a few times: those of least effort round alike and are sooner there
jax_setup.jit_float64 = partial(jax_setup.jit_float64, brief=True)
jax_setup.prepare()
jax.config.update("jax_enable_x64", True)
