"""The paper beside its computation as a document in Markdown."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from belt_sim.files import write_with
from studies.paper.plate import Plate
from studies.paper.statements.told import criteria
from studies.paper.stored import stored
from studies.paper.tables import Cell, Table, markdown_list

IMAGES, SHOWN = "images", (12, 13, 14)  # pictures that stand in the document, in a folder beside it

INTRODUCTION = """# The paper, figure by figure

Written by `{command}`, which also leaves `index.html` with all pictures and `paper.json` with the numbers behind
them. `fast=true` leaves the belt in three dimensions out, `figures=[12,13]` picks some. Coordinates are the paper's (x
from the tail pulley, y to its left: a yaw of -0.042 degrees moves the belt towards +y). Young's modulus (210 GPa) and
density (7850 kg/m3) are assumed; the paper's measured curves are not in its text, and none is drawn."""


def document(
    plates: Sequence[Plate], left_out: Mapping[int, str], command: str, table: Table, question: Sequence[str]
) -> str:
    """All of it but the pictures."""
    parts = [
        INTRODUCTION.format(command=command),
        "## What the paper measured, and what each model says of it",
        table.markdown(),
        "Verdicts are those of these criteria, one file each in `studies/paper/statements`:",
        criteria().markdown(),
        "## The open question",
        "\n\n".join(question),
        "## Figures",
        *(f"![Figure {p.number}: {p.title}]({IMAGES}/paper_{p.number}.png)" for p in plates if p.number in SHOWN),
        _figures(plates).markdown(),
        "Not computed:",
        markdown_list([f"Figure {number}: {why}" for number, why in sorted(left_out.items())]),
        "## Stored runs in three dimensions",
        "Too long to repeat for a picture; `python -m studies.paper_store files=outputs/study/NAME.json` puts a run "
        "into `models/paper`.",
        _runs(plates).markdown(),
    ]
    return "\n\n".join(parts) + "\n"


def lay_pictures(target: Path, folder: Path, plates: Sequence[Plate]) -> None:
    """The document's own pictures beside it, from the run folder."""
    for plate in plates:
        if plate.number in SHOWN:
            _copy(folder / plate.file, target.parent / IMAGES / f"paper_{plate.number}.png")


def _copy(source: Path, target: Path) -> None:
    write_with(target, lambda draft: draft.write_bytes(source.read_bytes()))


def _figures(plates: Sequence[Plate]) -> Table:
    rows = [(Cell(f"{p.number}"), Cell(p.title), Cell(p.caption)) for p in plates]
    return Table(("figure", "title", "here"), tuple(rows))


def _runs(plates: Sequence[Plate]) -> Table:
    names = sorted({name for p in plates for name in p.stored})
    rows = []
    for name in names:
        made, shown = stored(name).made, [str(p.number) for p in plates if name in p.stored]
        cells = (name, f"`{made['command']}`", str(made["commit"])[:7], f"{made['cpu_s']:.0f}", ", ".join(shown))
        rows.append(tuple(Cell(c) for c in cells))
    return Table(("run", "command", "commit", "CPU s", "in figure"), tuple(rows))
