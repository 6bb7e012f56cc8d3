"""``python -m studies.bench.space parts=[product,lammps]``: tables on the screen, outputs/bench/space.json beside them.

Parts: product, explicit, lammps, workers (all by default, some five minutes). full_travel=60 runs the full rig over
its whole 60 m instead of a piece.
"""

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from typing import Any

from rich.console import Console

from belt_sim.errors import InputError
from belt_sim.io import ROOT, provenance, write_json
from belt_sim.show.observers import progress
from studies.application import application
from studies.bench.space.explicit import explicit_figures
from studies.bench.space.lammps import lammps_figures
from studies.bench.space.tables import contenders, cost, sweeps
from studies.bench.space.task import SHORT
from studies.bench.space.workers import workers_figures

SCHEMA = "belt-bench-space/1"
PARTS = ("product", "explicit", "lammps", "workers")
LONG_STEP = 2e-3  # [s], the longest step that the short rig admits at 2 m/s
ACROSS = (3, 2)  # particles over the width
#: LAMMPS, 25 mm x 3, 25 m at 1 m/s, on another machine and with another script: CPU [s], late rate off the law [1]
ELSEWHERE = {"cpu_s": 609.0, "off_the_strip_law": 0.19}


def bench_space(config: dict[str, Any]) -> None:
    """Measure, print, write."""
    unknown = set(config["parts"]) - set(PARTS)
    if unknown:
        raise InputError("parts", ", ".join(sorted(unknown)), "", f"choose from {', '.join(PARTS)}")
    found = measure(config["parts"], float(config["full_travel"]))
    console = Console()
    for table in (cost(found.get("product")), contenders(found, SHORT), sweeps(found.get("workers"))):
        if table is not None:
            console.print(table)
    machine = {"cores": os.cpu_count(), "load": os.getloadavg()[0]}
    content = {"schema": SCHEMA, **found, "machine": machine, "provenance": provenance()}
    console.print(str(write_json(ROOT / "outputs" / "bench" / "space.json", content)))


def measure(parts: Sequence[str], full_travel: float) -> dict[str, Any]:
    """The figures of the parts asked for."""
    work = {
        "product": lambda: {
            "short": _piece("short", SHORT.travel),
            "short_long_step": _piece("short", SHORT.travel, LONG_STEP),
            "full": _piece("full", full_travel),
        },
        "explicit": lambda: explicit_figures(SHORT),
        "lammps": lambda: {str(m): lammps_figures(SHORT, m) for m in ACROSS} | {"elsewhere": ELSEWHERE},
        "workers": workers_figures,
    }
    found = {}
    with progress(len(parts), "3D bench") as done:
        for part in parts:
            done(0.0, part)
            found[part] = work[part]()
            done(1.0, f"{part} done")
    return found


def _piece(*arguments: Any) -> dict[str, Any]:
    """A run in a process of its own."""
    command = [sys.executable, "-m", "studies.bench.space.piece", *map(str, arguments)]
    done = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    return json.loads(done.stdout.splitlines()[-1])


if __name__ == "__main__":
    application("bench_space", bench_space)
