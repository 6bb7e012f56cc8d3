"""JAX as this project uses it: float64, the CPU, compiled code kept on disk between calls."""

import logging
import os
from pathlib import Path

os.environ.setdefault("JAX_PLATFORMS", "cpu")

import jax

CACHE = Path(os.environ.get("BELT_SIM_CACHE", Path.home() / ".cache" / "belt_sim" / "jax"))

logging.getLogger("jax").setLevel(logging.WARNING)
jax.config.update("jax_enable_x64", True)
jax.config.update("jax_compilation_cache_dir", str(CACHE))
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
