"""What commands cost: ``python -m studies.bench [only=WORDS] [base=CHECKOUT] [picture=FILE]``.

base: a checkout of an earlier version, which answers the same rows beside this one; only: the rows whose names contain
these words. The table is also written to outputs/bench/bench.json.
"""

import os
import platform
import sys
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from belt_sim.io import ROOT, provenance, write_json, write_with
from belt_sim.jax_setup import prepare
from studies.application import show_help
from studies.bench.commands import ROWS, measure

SCHEMA = "belt-bench/2"
FILE = ROOT / "outputs" / "bench" / "bench.json"


def main() -> None:
    """Measure, print, write."""
    options = dict(argument.split("=", 1) for argument in sys.argv[1:])
    prepare()
    console, only = Console(width=150), options.get("only", "")
    trees = (ROOT, *([Path(options["base"]).resolve()] if "base" in options else []))
    found: list[dict[str, Any]] = []
    for row in measure(only, trees):
        found.append(row)
        print(f"{row['row']}: {row['cpu_s']:.2f} CPU s ({row['tree']})", file=sys.stderr)
    console.print(_commands(found))
    content: dict[str, Any] = {"schema": SCHEMA, "commands": found}
    content["machine"] = {"cores": os.cpu_count(), "load": os.getloadavg()[0], "processor": platform.processor()}
    console.print(str(write_json(FILE, content | {"provenance": provenance()})))
    if "picture" in options:
        write_with(Path(options["picture"]), lambda path: _draw(path, found))


def _commands(found: list[dict[str, Any]]) -> Table:
    """Costs of every row, this version first, the earlier one behind it."""
    table = Table("command", "wall [s]", "wanted", "CPU [s]", "wanted", "memory [GB]", "programs traced, compiled")
    for row in ROWS:
        both = [f for f in found if f["row"] == row.name]
        if both:
            cells = [" / ".join(f"{f[name]:.2f}" for f in both) for name in ("wall_s", "cpu_s", "memory_gb")]
            wanted = ["" if limit is None else f"{limit:g}" for limit in (row.wall, row.cpu)]
            programs = " / ".join(f"{f['traced']}, {f['compiled']}" for f in both)
            table.add_row(row.name, cells[0], wanted[0], cells[1], wanted[1], cells[2], programs)
    return table


def _draw(path: Path, found: list[dict[str, Any]]) -> None:
    """Draw the CPU time of every row, the earlier version (if measured) as a grey bar behind it."""
    from matplotlib.figure import Figure

    names = [row.name for row in ROWS if any(f["row"] == row.name for f in found)][::-1]
    figure = Figure(figsize=(7.5, 0.36 * len(names) + 1.5), layout="constrained")
    axes = figure.subplots()
    for tree, colour, height in ((False, "0.8", 0.8), (True, "#1f5fa8", 0.45)):
        of_tree = {f["row"]: f["cpu_s"] for f in found if (f["tree"] == str(ROOT)) == tree}
        label = "this version" if tree else "before"
        axes.barh(names, [of_tree.get(n, 0.0) for n in names], height, color=colour, label=label)
        for k, name in enumerate(names if tree else ()):
            axes.text(of_tree[name] * 1.08, k, f"{of_tree[name]:.3g} s", va="center", fontsize=8)
    axes.set(xscale="log", xlabel="CPU time of the whole process tree [s]")
    axes.legend(frameon=False, loc="lower right")
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path)


if __name__ == "__main__":
    show_help(__doc__)
    main()
