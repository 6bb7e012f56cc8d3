"""CalculiX from outside: is it there, run a deck, read the numbers that it prints."""

import os
import shutil
import subprocess
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from belt_sim.case import Belt
from belt_sim.errors import SimulationError

PER_LINE = 12  # numbers in a line of a deck


@dataclass(frozen=True)
class Strip:
    """Rows of nodes: x (m,) and y (n,) [m] in the flat belt; ``quadratic`` (S8R: the middles of cells have no node)
    or not (S4). Node (i, j) stands at x[i], y[j]."""

    x: np.ndarray
    y: np.ndarray
    quadratic: bool

    def node(self, i: int, j: int) -> int:
        """Number of node (i, j)."""
        return 1 + (i % len(self.x)) * len(self.y) + j % len(self.y)

    def row(self, i: int) -> list[int]:
        """The places j across at which row i has a node."""
        odd = self.quadratic and i % len(self.x) % 2 == 1
        return list(range(0, len(self.y), 2 if odd else 1))

    @property
    def size(self) -> int:
        """No node number is above this."""
        return len(self.x) * len(self.y)

    @property
    def middle(self) -> int:
        """Place across of the centre line."""
        return (len(self.y) - 1) // 2

    def nodes(self) -> list[str]:
        """Lines of the node table."""
        return [
            f"{self.node(i, j)},{self.x[i]:.12g},{self.y[j]:.12g},0." for i in range(len(self.x)) for j in self.row(i)
        ]

    def elements(self) -> list[str]:
        """Lines of the element table, numbered from 1."""
        step = 2 if self.quadratic else 1
        corners = ((0, 0), (step, 0), (step, step), (0, step))
        edges = ((1, 0), (2, 1), (1, 2), (0, 1)) if self.quadratic else ()
        cells = [(i, j) for i in range(0, len(self.x) - 1, step) for j in range(0, len(self.y) - 1, step)]
        return [
            f"{k + 1}," + ",".join(str(self.node(i + a, j + b)) for a, b in (*corners, *edges))
            for k, (i, j) in enumerate(cells)
        ]

    def lines_along(self) -> list[int]:
        """Nodes of both edges and of the centre line."""
        across = (0, self.middle, len(self.y) - 1)
        return [self.node(i, j) for i in range(len(self.x)) for j in across if j in self.row(i)]


def strip(corners: Sequence[float] | np.ndarray, width: float, across: int, *, quadratic: bool) -> Strip:
    """Strip with element edges at ``corners`` along and ``across`` elements over ``width``."""
    ends = np.asarray(corners, float)
    if not quadratic:
        return Strip(ends, np.linspace(-width / 2, width / 2, across + 1), False)
    x = np.empty(2 * len(ends) - 1)
    x[::2], x[1::2] = ends, (ends[1:] + ends[:-1]) / 2
    return Strip(x, np.linspace(-width / 2, width / 2, 2 * across + 1), True)


def graded_lengths(length: float, finest: float, coarsest: float, growth: float = 1.25, even: int = 8) -> np.ndarray:
    """Lengths of elements that grow from both ends of ``length`` to its middle [m]; the first ``even`` are alike."""
    steps: list[float] = []
    while sum(steps) < length / 2:
        steps.append(min(finest * growth ** max(0, len(steps) + 1 - even), coarsest))
    half = np.array(steps) * (length / 2) / sum(steps)
    return np.concatenate([half, half[::-1]])


def node_set(name: str, numbers: Iterable[int]) -> list[str]:
    """A named set of nodes."""
    listed = [str(n) for n in numbers]
    return [f"*NSET,NSET={name}"] + [",".join(listed[k : k + PER_LINE]) + "," for k in range(0, len(listed), PER_LINE)]


def equation(terms: Sequence[tuple[int, int, float]]) -> list[str]:
    """Sum of coefficient x displacement (node, direction, coefficient) = 0; the first is the dependent one."""
    kept = [t for t in terms if t[2] != 0.0]
    written = [f"{node},{direction},{factor:.12g}" for node, direction, factor in kept]
    return [str(len(kept))] + [",".join(written[k : k + 4]) for k in range(0, len(written), 4)]


def steel(belt: Belt, elements: str, *, expands_along: bool = False) -> list[str]:
    """Material and shell section of the belt; expands_along: a temperature of 1 is a strain of 1 along x."""
    modulus, poisson = belt.youngs_modulus, belt.poisson_ratio
    expansion = ["*EXPANSION,TYPE=ORTHO,ZERO=0.", "1.,0.,0."] if expands_along else []
    return [
        "*MATERIAL,NAME=STEEL",
        "*ELASTIC",
        f"{modulus:.12g},{poisson:.12g}",
        *expansion,
        "*DENSITY",
        f"{belt.density:.12g}",
        f"*SHELL SECTION,ELSET={elements},MATERIAL=STEEL",
        f"{belt.thickness:.12g}",
    ]


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
