"""CalculiX from outside: is it there, run a deck, read the numbers that it prints."""

import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from belt_sim.errors import SimulationError

MISSING = "ccx is not installed: run studies/shell/install.sh (Debian package calculix-ccx), then again"
_UNREAD = ("frd", "cvg", "12d", "dat", "sta")


@dataclass(frozen=True)
class PrintedTable:
    """One table of a .dat file: quantity ("displacements", "forces"), node set, total time; values (3,) by node."""

    quantity: str
    nodes: str
    time: float
    values: dict[int, np.ndarray]


def is_installed() -> bool:
    return shutil.which("ccx") is not None


def run(folder: Path, name: str, deck: str, limit: float = 1800.0) -> list[PrintedTable]:
    """What CalculiX prints for ``deck``, on one core; files NAME.* stay in ``folder``.

    A run that breaks off, or takes more than ``limit`` seconds, gives what it had printed; if none, SimulationError.
    """
    if not is_installed():
        raise SimulationError(MISSING)
    folder.mkdir(parents=True, exist_ok=True)
    for ending in _UNREAD:
        (folder / f"{name}.{ending}").unlink(missing_ok=True)
    (folder / f"{name}.inp").write_text(deck, encoding="ascii")
    alone = dict(os.environ, OMP_NUM_THREADS="1", CCX_NPROC_STIFFNESS="1", NUMBER_OF_CPUS="1")
    with (folder / f"{name}.log").open("w") as log:
        try:
            subprocess.run(["ccx", name], cwd=folder, env=alone, stdout=log, stderr=log, timeout=limit, check=False)
        except subprocess.TimeoutExpired:
            log.write(f"\nstopped after {limit:g} s\n")
    for ending in ("frd", "cvg", "12d"):  # large, and nothing reads them
        (folder / f"{name}.{ending}").unlink(missing_ok=True)
    printed = read(folder / f"{name}.dat")
    if not printed:
        raise SimulationError(f"CalculiX gave nothing for {name}; its words are in {folder / name}.log")
    return printed


def read(path: Path) -> list[PrintedTable]:
    """The tables of a .dat file, in the order of their times."""
    tables: list[PrintedTable] = []
    if not path.exists():
        return tables
    for line in path.read_text(encoding="ascii").splitlines():
        words = line.split()
        if "for set" in line:
            tables.append(PrintedTable(words[0], line.split("for set")[1].split()[0], float(words[-1]), {}))
        elif len(words) == 4 and tables and words[0].isdigit():
            tables[-1].values[int(words[0])] = np.array(words[1:], float)
    return [t for t in tables if t.values]
