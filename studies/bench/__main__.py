"""What commands cost: ``python -m studies.bench [only=WORDS] [base=CHECKOUT] [picture=FILE]``.

base: a checkout of an earlier version, which answers the same rows beside this one; only: the rows whose names contain
one of these words (``only=slack,fault``). The table is also written to outputs/bench/bench.json.
"""

import os
import platform
import sys
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from belt_sim.io import ROOT, provenance, write_json
from belt_sim.jax_setup import prepare
from studies.application import show_help
from studies.bench.commands import ROWS, measure

SCHEMA = "belt-bench/2"
TICKS = (0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30, 100)  # [s]
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
        _draw(Path(options["picture"]), found)


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
    """Draw the CPU time of every row as a dot, that of the earlier version (if measured) as a ring beside it."""
    from belt_sim.show import style

    names = [row.name for row in ROWS if any(f["row"] == row.name for f in found)][::-1]
    now, before = ({f["row"]: f["cpu_s"] for f in found if (f["tree"] == str(ROOT)) == own} for own in (True, False))
    with style.in_look():
        figure, [axes] = style.figure(7.5, 0.34 * len(names) + 1.5)
        for k, name in enumerate(names):
            ends = [now[name], before.get(name, now[name])]
            axes.plot(ends, [k, k], color=style.FAINT_INK, linewidth=1.2, zorder=1)
            for x in {*ends}:
                shift, align = (-7, "right") if x < max(ends) else (7, "left")
                axes.annotate(f"{x:.3g} s", (x, k), (shift, 0), textcoords="offset points", ha=align, va="center")
        axes.plot(
            [*before.values()], [names.index(n) for n in before], "o", mfc="none", color=style.INK, label="before"
        )
        axes.plot([*now.values()], [names.index(n) for n in now], "o", color=style.AFTER_COLOUR, label="this version")
        axes.set_yticks(range(len(names)), names)
        axes.set(xscale="log", xlabel="CPU time of the whole process tree [s]", ylim=(-0.6, len(names) - 0.4))
        axes.set_xticks(TICKS, [f"{t:g}" for t in TICKS])
        axes.set_xticks([], minor=True)
        axes.set_xlim(min(now.values()) / 15.0, 4.0 * max([*now.values(), *before.values()]))
        figure.legend(loc="outside lower center", ncols=2)
        style.save(figure, path)


if __name__ == "__main__":
    show_help(__doc__)
    main()
