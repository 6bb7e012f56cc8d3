"""Every test sees the modules that stand beside this file (paper_cases), and JAX as the command line sets it up.

Tests use jax.numpy directly, so that float64 is set for the whole process as well; that the package does not need it
is shown in tests/guards/test_imports.py.
"""

from pathlib import Path

import jax
import pytest

from belt_sim.jax_setup import prepare

prepare()
jax.config.update("jax_enable_x64", True)

#: regions of memory of a process, of which Linux allows 65,530; a compiled program takes some hundred
REGIONS = 20_000


def pytest_collection_modifyitems(items):
    """One process runs all tests of a file, and all files that use small_campaign, which keeps its diagnoses
    (``--dist loadgroup``)."""
    for item in items:
        shares = any(getattr(x, "__module__", "") == "small_campaign" for x in vars(item.module).values())
        item.add_marker(pytest.mark.xdist_group("small_campaign" if shares else item.nodeid.partition("::")[0]))


@pytest.fixture(scope="module", autouse=True)
def drop_programs():
    """Drop what was compiled so far, after a file of tests at whose end this process has mapped much memory for it."""
    yield
    maps = Path("/proc/self/maps")
    if maps.exists() and len(maps.read_bytes().splitlines()) > REGIONS:
        jax.clear_caches()
