"""The bonded-particle belt in LAMMPS (Debian package lammps), measured over a short piece on one core."""

import math
import os
import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from studies.bench.space.particles import Particles, script, write_particles
from studies.bench.space.task import Task

MISSING = "not installed: apt install lammps"
SPEEDS = (1.0, 2.0)  # [m/s]: that of the run whose late rate is known, and the product's
STEPS = 20000  # about 0.1 s of belt time
REPEATS = 2  # the best of so many
SAFE = 0.97  # of the largest stable step, at which pieces are timed
BEYOND = 1.3  # times the largest stable step must fail
BOUNDED = 100.0  # [J] of kinetic energy: the belt at 2 m/s has 5
_PROGRAM = ("lmp", "lmp_serial", "lmp_mpi")


def program() -> str | None:
    """The LAMMPS binary, or None."""
    return next((found for found in map(shutil.which, _PROGRAM) if found), None)


@dataclass(frozen=True)
class Piece:
    """A run of LAMMPS: CPU seconds of its loop, kinetic energy [J] at the end; stable: it came through."""

    seconds: float
    kinetic_energy: float
    stable: bool


def lammps_figures(task: Task, across: int) -> dict[str, Any] | None:
    """Milliseconds a step with and without pulleys, and CPU seconds for the whole travel at SPEEDS; None without it."""
    if program() is None:
        return None
    belt = Particles.from_case(task.case(), across)
    limit = belt.largest_step()
    dt = SAFE * limit
    timed = [lammps_run(belt, dt=dt, speed=SPEEDS[0], steps=STEPS) for _ in range(REPEATS)]
    bare = [lammps_run(belt, dt=dt, speed=SPEEDS[0], steps=STEPS, contact=False) for _ in range(REPEATS)]
    beyond = lammps_run(belt, dt=BEYOND * limit, speed=0.0, steps=STEPS // 10, contact=False)
    each, free = (1e3 * min(t.seconds for t in runs) / STEPS for runs in (timed, bare))
    return {
        "particles": len(belt.place),
        "bonds": len(belt.bonds),
        "largest_step_s": limit,
        "dt_s": dt,
        "stable_at_dt": all(t.stable for t in timed),
        f"stable_at_{BEYOND:g}_largest_step": beyond.stable,
        "belt_moves_at_m_per_s": float((2.0 * timed[0].kinetic_energy / belt.mass.sum()) ** 0.5),
        "ms_per_step": each,
        "ms_per_step_without_pulleys": free,
        "cpu_s": {f"{v:g}": 1e-3 * each * task.travel / (v * dt) for v in SPEEDS},
        "cpu_s_without_pulleys": {f"{v:g}": 1e-3 * free * task.travel / (v * dt) for v in SPEEDS},
    }


def lammps_run(belt: Particles, **settings: Any) -> Piece:
    """Run ``particles.script`` with these settings on one core; raises FileNotFoundError without LAMMPS."""
    binary = program()
    if binary is None:
        raise FileNotFoundError(MISSING)
    with tempfile.TemporaryDirectory() as folder:
        write_particles(Path(folder) / "belt.data", belt)
        (Path(folder) / "in.belt").write_text(script(belt, **settings), encoding="utf-8")
        done = subprocess.run(
            [binary, "-in", "in.belt", "-log", "none"],
            cwd=folder,
            env=os.environ | {"OMP_NUM_THREADS": "1"},
            capture_output=True,
            text=True,
            check=False,
        )
    return _read(done.stdout, settings["steps"])


def _read(said: str, steps: int) -> Piece:
    """What LAMMPS printed; a run that broke off has no energy at its last step."""
    taken = re.search(r"Loop time of (\S+) on 1 procs", said)
    use = re.search(r"([\d.]+)% CPU use", said)
    last = re.findall(rf"^\s*{steps}\s+(\S+)\s+\S+\s*$", said, re.MULTILINE)
    seconds = float(taken.group(1)) * float(use.group(1)) / 100.0 if taken and use else math.nan
    energy = float(last[-1]) if last else math.nan
    return Piece(seconds=seconds, kinetic_energy=energy, stable=energy < BOUNDED)
