"""Importing the package changes nothing outside it, and it computes in float64 whatever the caller's JAX is set to."""

import io
import json
import os
import subprocess
import sys

import numpy as np
import pytest
from paper_cases import paper_case

from belt_sim.api.simulate import model_named
from belt_sim.commands import cli
from belt_sim.commands.cli import use_one_blas_thread
from belt_sim.effects.base import library
from belt_sim.io import ROOT

ROUNDING = 1e-9  # relative: without prepare() XLA fuses multiply-adds, which shifts last bits; float32 would give 1e-4

IMPORT_ALL = """
import importlib, json, logging, os, pkgutil, sys, warnings
import jax, numpy as np, omegaconf
import belt_sim
def outside():
    return [dict(os.environ), dict(jax.config.values), list(map(str, warnings.filters)), np.geterr(),
            {n: logging.getLogger(n).level for n in ("", "jax", "hydra")}, sys.getrecursionlimit()]
def load(name):
    try:
        importlib.import_module(name)
    except ModuleNotFoundError as missing:
        if missing.name.startswith("belt_sim"):
            raise
names = [m.name for m in pkgutil.walk_packages(belt_sim.__path__, "belt_sim.") if not m.name.endswith("__main__")]
for other in ("mujoco", "matplotlib", "pandas", "hydra", "rerun", "scipy.stats", "nicegui", "threadpoolctl"):
    importlib.import_module(other)  # what these do to the process is their own business
for name in ("fcntl", "resource", "termios", "pwd", "grp"):
    sys.modules[name] = None  # as on Windows
before = json.dumps(outside(), default=str)
for name in names:
    load(name)
after = json.dumps(outside(), default=str)
os.environ["XLA_FLAGS"] = "--xla_force_host_platform_device_count=3"  # unheard once JAX has computed, as prepare()
idle = len(jax.devices("cpu")) == 3
from belt_sim.commands.cli import run_command
status = run_command(["new", f"hydra.run.dir={sys.argv[1]}"])
changed = [a for a, b in zip(before.split(","), after.split(","), strict=True) if a != b]
print(json.dumps([len(names), changed, idle, status]))
"""

RUN_UNPREPARED = """
import json
from paper_cases import paper_case
from belt_sim.effects.base import library
from belt_sim.api.simulate import model_named
import jax.numpy as jnp
play = library()["yaw_backlash"](half=1e-4)
gain = library()["sensor_gain"](g1=0.1)
curves = model_named("rope").run(paper_case(10), (play, gain), travel=5.0)
print(json.dumps([str(jnp.ones(1).dtype), str(curves.y.dtype), curves.y[:, -1].tolist()]))
"""


def _said(program: str, *arguments: str):
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
        env={"PATH": "/usr/bin:/bin", "PYTHONPATH": f"{ROOT}:{ROOT / 'tests'}", "HOME": "/nonexistent"},
    )
    return json.loads(done.stdout.splitlines()[-1])


def test_every_module_loads_where_posix_is_not_and_changes_nothing_global(tmp_path):
    count, differences, idle, status = _said(IMPORT_ALL, str(tmp_path))
    assert count > 100
    assert differences == []
    assert idle
    assert status == 0
    assert list(tmp_path.rglob("campaign.yaml"))


def test_signs_that_a_pipe_cannot_write_end_no_command(monkeypatch):
    narrow = io.TextIOWrapper(io.BytesIO(), encoding="cp1252")
    monkeypatch.setattr(sys, "stdout", narrow)
    monkeypatch.setattr(cli, "run_command", lambda arguments: print("σ → 1·10⁻⁵ mm²"))
    with pytest.raises(SystemExit):
        cli.main()
    assert narrow.buffer.getvalue().decode("cp1252").split() == ["?", "?", "1·10??", "mm²"]


def test_a_run_is_in_float64_without_any_set_up_and_leaves_jax_as_it_was():
    outside, inside, ends = _said(RUN_UNPREPARED)
    assert (outside, inside) == ("float32", "float64")
    effects = (library()["yaw_backlash"](half=1e-4), library()["sensor_gain"](g1=0.1))
    prepared = model_named("rope").run(paper_case(10), effects, travel=5.0)
    np.testing.assert_allclose(ends, prepared.y[:, -1], rtol=ROUNDING)


def test_the_command_line_says_how_many_threads_before_linear_algebra_is_loaded(monkeypatch):
    loaded = "import json, sys, belt_sim.commands.cli; "
    loaded += "print(json.dumps([m for m in ('numpy', 'scipy') if m in sys.modules]))"
    assert _said(loaded) == []
    monkeypatch.setattr(os, "environ", {"MKL_NUM_THREADS": "3"})
    use_one_blas_thread()
    assert os.environ == {"MKL_NUM_THREADS": "3", "OPENBLAS_NUM_THREADS": "1"}


def test_a_run_of_a_model_loads_no_libraries_that_it_does_not_use(tmp_path):
    heavy = ("pandas", "mujoco", "belt_sim.campaign.sheet", "belt_sim.diagnosis.forward")
    heavy += tuple(f"scipy.{part}" for part in ("interpolate", "optimize", "signal", "stats", "ndimage"))
    program = "import json, sys; from belt_sim.commands.cli import run_command"
    program += "; run_command(['simulate', 'model=rope', 'travel=5', sys.argv[1]])"
    program += f"; print(json.dumps([m for m in {heavy} if m in sys.modules]))"
    assert _said(program, f"hydra.run.dir={tmp_path}") == []
