"""The paper beside its computation: a page that needs no network, and the document docs/data/paper.md."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

from belt_sim.files import PACKAGE, write_text, write_with
from studies.paper.models import LOOKS
from studies.paper.plate import Plate
from studies.paper.statements import CONTRADICTED, REPRODUCED, SILENT, STATEMENTS, Judgement
from studies.paper.stored_runs import PLACE, stored_run


@dataclass(frozen=True)
class Cell:
    """text, and what kind of cell it is on the page."""

    text: str
    kind: str = ""


@dataclass(frozen=True)
class Table:
    """header (columns,), rows of as many cells each."""

    header: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]

    def markdown(self) -> str:
        """A pipe table."""
        lines = [self.header, ("---",) * len(self.header), *(tuple(c.text for c in row) for row in self.rows)]
        return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)

    def html(self) -> str:
        """A table that scrolls by itself where it is too wide."""
        head = "".join(f"<th>{escape(name)}</th>" for name in self.header)
        body = "".join("<tr>" + "".join(_cell(c) for c in row) + "</tr>" for row in self.rows)
        return f'<div class="scroll"><table><tr>{head}</tr>{body}</table></div>'


def _cell(cell: Cell) -> str:
    kind = f' class="{cell.kind}"' if cell.kind else ""
    return f"<td{kind}>{escape(cell.text)}</td>"


def markdown_list(items: Sequence[str]) -> str:
    """A bulleted list."""
    return "\n".join(f"- {i}" for i in items)


KINDS = {REPRODUCED: "reproduced", CONTRADICTED: "contradicted", SILENT: "silent"}


def verdicts(judgements: Mapping[str, Mapping[str, Judgement]]) -> Table:
    """A row a statement, a column a model: the verdict and the number that it rests on."""
    models = list(next(iter(judgements.values())))
    rows = [
        (
            Cell(f"{name}: {STATEMENTS[name].about}"),
            *(Cell(_words(of[model]), KINDS[of[model].verdict]) for model in models),
        )
        for name, of in judgements.items()
    ]
    return Table(("", *(LOOKS[m].words for m in models)), tuple(rows))


def criteria() -> Table:
    """What the paper says, and what a model has to do."""
    rows = [(Cell(s.name), Cell(s.says), Cell(s.criterion)) for s in STATEMENTS.values()]
    return Table(("", "the paper", "criterion"), tuple(rows))


def _words(judgement: Judgement) -> str:
    return f"{judgement.verdict}: {judgement.number}" if judgement.number else judgement.verdict


DECIDES = PLACE / "what_decides.json"  # by studies/what_decides.py
FURTHER_RUNS = 3  # further runs that are told


def what_decides() -> dict[str, Any]:
    """The stored answer of the diagnosis's next-run search."""
    found: dict[str, Any] = json.loads(DECIDES.read_text(encoding="utf-8"))
    return found


def answer(judgements: Mapping[str, Mapping[str, Judgement]]) -> list[str]:
    """Paragraphs."""
    return [*_what_models_say(judgements), *_what_would_decide(what_decides())]


def _what_models_say(judgements: Mapping[str, Mapping[str, Judgement]]) -> list[str]:
    slow, fast, read = (_reproducing(judgements[name]) for name in ("M2", "M3", "M3, read early"))
    both = [m for m in slow if m in fast]
    early = [m for m in slow if m in read]
    m4 = judgements["M4"]["strip"]
    strip = judgements["M3"]["strip"].number, judgements["M3, read early"]["strip"].number
    return [
        "A slow start (M2) together with a steady rate that is a lot higher at low tension (M3): "
        + (f"{_names(both)}." if both else "no model here has both.")
        + f" With the slow start: {_names(slow)}. With the higher steady rate: {_names(fast)}"
        + "".join(f" (start at 7 and 10 N/mm2: {judgements['M2'][m].number})" for m in fast if m not in slow)
        + ".",
        f"A slow start together with a higher rate as a record of 10 to 15 m shows it: {_names(early)}. Of the "
        f"hanging strip the rates at 7 and 10 N/mm2 are {strip[0]} in the long run, but {strip[1]} over 10 to 15 m.",
        "So M2 and M3 agree with the strip law if the measured rates were read within the first swing of the belt, and "
        "M3 does not if they were steady. Which of the two it was is not in the paper's text, and computation cannot "
        "tell. "
        f"Of M4 the hanging strip says: {m4.verdict} ({m4.number}).",
    ]


def _what_would_decide(d: Mapping[str, Any]) -> list[str]:
    one, four, noise = d["one_run"], d["four_tensions"], d["noise"]
    best = "; ".join(f"{a['words']}: {a['least']:.0f} sigma" for a in one["actions"][:FURTHER_RUNS])
    return [
        f"Compared were: {'; '.join(d['explanations'])}. Each has the smallest size that agrees with M2, M3 and M4 "
        "(docs/data/open_question.md, with all candidates that were tried).",
        f"One record at {d['slack_N_per_mm2']:g} N/mm2 (points 1 and 4, {d['length_m']:g} m) cannot decide: "
        f"{' and '.join(one['closest'])} are {one['least_measured']:.1f} sigma apart. Records at all four tensions "
        f"tell every pair apart by at least {four['least_measured']:.0f} sigma. The other explanation's numbers, the "
        "sensors' zero, and tension and yaw within their errors are refitted; noise "
        f"{noise['white_mm']:g} mm, wander {noise['wander_mm']:g} mm, zero "
        f"{noise['zero_mm']:g} mm, tension {100 * noise['tension_relative']:g} %, yaw {noise['yaw_urad']:g} urad.",
        f"Beside that one record, the further runs that add most are: {best}.",
        f"This says nothing of explanations that are not among these. ({d['command']}, commit {d['commit'][:7]}.)",
    ]


def _reproducing(of: Mapping[str, Judgement]) -> list[str]:
    return [name for name, j in of.items() if j.verdict == REPRODUCED]


def _names(models: list[str]) -> str:
    return ", ".join(LOOKS[m].words for m in models) or "no model"


HERE = Path(__file__).resolve().parent
STYLES = (PACKAGE / "show" / "report.css", HERE / "page.css")


def write_page(
    folder: Path, plates: Sequence[Plate], left_out: Mapping[int, str], origin: str, parts: Mapping[str, str]
) -> Path:
    """index.html in ``folder``; parts: HTML of the "table" of statements and of the "question", where they are told."""
    from jinja2 import Environment, FileSystemLoader
    from markupsafe import Markup

    engine = Environment(loader=FileSystemLoader(HERE), autoescape=True, trim_blocks=True, lstrip_blocks=True)
    css = Markup("\n".join(path.read_text(encoding="utf-8") for path in STYLES))
    told: dict[str, Any] = {name: Markup(html) for name, html in parts.items()}
    page = engine.get_template("page.html.j2").render(
        css=css, plates=[_plate_fields(p) for p in plates], left_out=sorted(left_out.items()), origin=origin, **told
    )
    return write_text(folder / "index.html", page)


def _plate_fields(plate: Plate) -> dict[str, Any]:
    return {
        "number": plate.number,
        "title": plate.title,
        "caption": plate.caption,
        "file": plate.file,
        "origins": [stored_run(name).origin for name in plate.stored],
    }


IMAGES, SHOWN = "../images", (12, 13, 14)  # pictures that stand in the document, in a folder beside it

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
        "Verdicts are those of these criteria (`studies/paper/statements.py`):",
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
        made, shown = stored_run(name).made, [str(p.number) for p in plates if name in p.stored]
        cells = (name, f"`{made['command']}`", str(made["commit"])[:7], f"{made['cpu_s']:.0f}", ", ".join(shown))
        rows.append(tuple(Cell(c) for c in cells))
    return Table(("run", "command", "commit", "CPU s", "in figure"), tuple(rows))
