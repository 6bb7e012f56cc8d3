"""``python -m belt_sim.bench.space [PART ...] [--long]``: tables on the screen, outputs/bench/space.json beside them.

Parts: product, explicit, lammps, workers (all by default, some five minutes). --long runs the full rig over its whole
60 m instead of a piece.
"""

import argparse
import json
import os
import subprocess
import sys
from typing import Any

from rich.console import Console

from belt_sim.bench.space.explicit import explicit_figures
from belt_sim.bench.space.lammps import lammps_figures
from belt_sim.bench.space.tables import contenders, cost, sweeps
from belt_sim.bench.space.task import FULL, SHORT
from belt_sim.bench.space.workers import workers_figures
from belt_sim.files import write_json
from belt_sim.paths import ROOT
from belt_sim.provenance import provenance
from belt_sim.watch.progress import progress

SCHEMA = "belt-bench-space/1"
PARTS = ("product", "explicit", "lammps", "workers")
PIECE = 3.0  # [m] of the full rig; from 2 m on it runs at full speed
LONG_STEP = 2e-3  # [s], the longest step that the short rig admits at 2 m/s
ACROSS = (3, 2)  # particles over the width
#: LAMMPS, 25 mm x 3, 25 m at 1 m/s, on another machine and with another script: CPU [s], late rate off the law [1]
ELSEWHERE = {"cpu_s": 609.0, "off_the_strip_law": 0.19}


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}")
    parser.add_argument("--long", action="store_true", help="the full rig over 60 m (3 to 8 minutes more)")
    a = parser.parse_args()
    unknown = set(a.parts) - set(PARTS)
    if unknown:
        parser.error(f"unknown part {', '.join(sorted(unknown))}: choose from {', '.join(PARTS)}")
    found = measure(a.parts or PARTS, FULL.travel if a.long else PIECE)
    console = Console()
    for table in (cost(found.get("product")), contenders(found, SHORT), sweeps(found.get("workers"))):
        if table is not None:
            console.print(table)
    machine = {"cores": os.cpu_count(), "load": os.getloadavg()[0]}
    content = {"schema": SCHEMA, **found, "machine": machine, "provenance": provenance()}
    console.print(str(write_json(ROOT / "outputs" / "bench" / "space.json", content)))


def measure(parts: tuple[str, ...] | list[str], full_travel: float) -> dict[str, Any]:
    """The figures of the parts asked for."""
    work = {
        "product": lambda: {
            "short": _piece("short", SHORT.travel),
            "short_long_step": _piece("short", SHORT.travel, "--dt", str(LONG_STEP)),
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
    command = [sys.executable, "-m", "belt_sim.bench.space.piece", *map(str, arguments)]
    done = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    return json.loads(done.stdout.splitlines()[-1])


if __name__ == "__main__":
    main()
