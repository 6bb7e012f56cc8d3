"""JAX as this project uses it: float64, the CPU, compiled code kept on disk between calls.

Fused multiply-adds are off: which sums they land on depends on what else is compiled in, so that an effect of
no strength would change the last bit of a result. Without them it does not, for some 15 % of the speed.
"""

import logging
import os
from pathlib import Path

os.environ.setdefault("JAX_PLATFORMS", "cpu")
if "xla_cpu_max_isa" not in os.environ.get("XLA_FLAGS", ""):
    os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} --xla_cpu_max_isa=AVX".strip()

import jax

CACHE = Path(os.environ.get("BELT_SIM_CACHE", Path.home() / ".cache" / "belt_sim" / "jax"))

logging.getLogger("jax").setLevel(logging.WARNING)
jax.config.update("jax_enable_x64", True)
jax.config.update("jax_compilation_cache_dir", str(CACHE))
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
