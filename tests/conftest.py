"""Every test sees the modules that stand beside this file (paper_cases), and JAX as the command line sets it up.

Tests use jax.numpy directly, so that float64 is set for the whole process as well; that the package does not need it
is shown in tests/guards/test_imports.py. Programs are compiled with little effort here,
without notes for an optimiser, as most run once: XLA reads its flags once a process, so that they are set for its first
use alone. Processes that a test starts compile as usual.
"""

import os
from functools import cache

import jax
import pytest
from xdist.scheduler import LoadScopeScheduling

from belt_sim.io import ROOT
from belt_sim.jax_setup import LEAST_EFFORT, STEP_EFFORT, prepare
from belt_sim.space.quasi_static import run_batch

LITTLE_EFFORT = "--xla_backend_optimization_level=0"
if jax.__version_info__ < (0, 11):  # later ones have no fusion emitters to switch off
    LITTLE_EFFORT += " --xla_cpu_use_fusion_emitters=false"
    FOR_AN_OPTIMISER = "alias_scope", "noalias", "invariant_load"
    LITTLE_EFFORT += "".join(f" --xla_llvm_enable_{notes}_metadata=false" for notes in FOR_AN_OPTIMISER)

prepare()
usual = os.environ["XLA_FLAGS"]
os.environ["XLA_FLAGS"] = f"{usual} {LITTLE_EFFORT}"
jax.devices()
os.environ["XLA_FLAGS"] = usual
STEP_EFFORT.update(LEAST_EFFORT)
run_batch.effort = LEAST_EFFORT
jax.config.update("jax_enable_x64", True)


class ByFile(LoadScopeScheduling):
    """One process runs all tests of a file, and all files that share what is kept: the diagnoses of small_campaign, the
    searches of small_discovery, the programs of paper_cases."""

    def _split_scope(self, nodeid: str) -> str:
        return scope(nodeid.partition("::")[0])


@cache
def scope(file: str) -> str:
    text = (ROOT / file).read_text(encoding="utf-8")
    names = {"small_campaign": "", "small_discovery": "", "marched": "paper_cases", "affected": "paper_cases"}
    return next((shared or name for name, shared in names.items() if name in text), file)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    config.option.loadscopereorder = False  # as collected: the last files, of the virtual rig, are the shortest
    return ByFile(config, log)


def pytest_runtest_setup():
    """Output is that of a pipe, whatever the window or an earlier test's libraries have set."""
    for name in ("COLUMNS", "LINES", "FORCE_COLOR", "TTY_COMPATIBLE"):
        os.environ.pop(name, None)
