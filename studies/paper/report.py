"""The paper beside its computation: a page that needs no network, and the document docs/data/paper.md."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from html import escape
from pathlib import Path
from typing import Any

from belt_sim.io import PACKAGE, write_text, write_with
from studies.paper.drawing import Plate
from studies.paper.models import LOOKS
from studies.paper.statements import CONTRADICTED, REPRODUCED, SILENT, STATEMENTS, Judgement
from studies.paper.stored_runs import PLACE, stored_run


@dataclass(frozen=True)
class Table:
    """header (columns,), rows of as many cells each; a cell that begins with a verdict is coloured on the page."""

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def markdown(self) -> str:
        """A pipe table."""
        lines = [self.header, ("---",) * len(self.header), *self.rows]
        return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)

    def html(self) -> str:
        """A table that scrolls by itself where it is too wide."""
        lines = ["".join(f"<th>{escape(name)}</th>" for name in self.header)]
        for row in self.rows:
            kinds = [KINDS.get(text.partition(":")[0], "") for text in row]
            lines.append("".join(f'<td class="{k}">{escape(t)}</td>' for k, t in zip(kinds, row, strict=True)))
        return '<div class="scroll"><table>' + "".join(f"<tr>{line}</tr>" for line in lines) + "</table></div>"


KINDS = {REPRODUCED: "reproduced", CONTRADICTED: "contradicted", SILENT: "silent"}


def verdicts(judgements: Mapping[str, Mapping[str, Judgement]]) -> Table:
    """A row a statement, a column a model: the verdict and the number that it rests on."""
    models = list(next(iter(judgements.values())))
    rows = []
    for name, of in judgements.items():
        said = [f"{j.verdict}: {j.number}" if j.number else j.verdict for j in map(of.__getitem__, models)]
        rows.append((f"{name}: {STATEMENTS[name].about}", *said))
    return Table(("", *(LOOKS[m].words for m in models)), tuple(rows))


def criteria() -> Table:
    """What the paper says, and what a model has to do."""
    rows = [(s.name, s.says, s.criterion) for s in STATEMENTS.values()]
    return Table(("", "the paper", "criterion"), tuple(rows))


DECIDES = PLACE / "what_decides.json"  # by studies/what_decides.py
FURTHER_RUNS = 3  # further runs that are told


def what_decides() -> dict[str, Any]:
    """The stored answer of the diagnosis's next-run search."""
    found: dict[str, Any] = json.loads(DECIDES.read_text(encoding="utf-8"))
    return found


def answer(judgements: Mapping[str, Mapping[str, Judgement]]) -> list[str]:
    """Paragraphs: what the models say of the open question, and what would decide it."""
    slow, fast, read = (
        [m for m, j in judgements[name].items() if j.verdict == REPRODUCED] for name in ("M2", "M3", "M3, read early")
    )
    both, early = ([m for m in slow if m in others] for others in (fast, read))
    m4 = judgements["M4"]["strip"]
    strip = judgements["M3"]["strip"].number, judgements["M3, read early"]["strip"].number
    starts = "".join(f" (start at 7 and 10 N/mm2: {judgements['M2'][m].number})" for m in fast if m not in slow)
    d = what_decides()
    one, four, noise = d["one_run"], d["four_tensions"], d["noise"]
    best = "; ".join(f"{a['words']}: {a['least']:.0f} sigma" for a in one["actions"][:FURTHER_RUNS])
    return [
        "A slow start (M2) together with a steady rate that is a lot higher at low tension (M3): "
        + (f"{_names(both)}." if both else "no model here has both.")
        + f" With the slow start: {_names(slow)}. With the higher steady rate: {_names(fast)}{starts}.",
        f"A slow start together with a higher rate as a record of 10 to 15 m shows it: {_names(early)}. Of the "
        f"hanging strip the rates at 7 and 10 N/mm2 are {strip[0]} in the long run, but {strip[1]} over 10 to 15 m.",
        "So M2 and M3 agree with the strip law if the measured rates were read within the first swing of the belt, and "
        "M3 does not if they were steady. Which of the two it was is not in the paper's text, and computation cannot "
        "tell. "
        f"Of M4 the hanging strip says: {m4.verdict} ({m4.number}).",
        f"Compared were: {'; '.join(d['explanations'])}. Each has the smallest size that agrees with M2, M3 and M4 "
        "(docs/data/open_question.md, with all candidates that were tried).",
        f"One record at {d['slack_N_per_mm2']:g} N/mm2 (points 1 and 4, {d['length_m']:g} m) cannot decide: "
        f"{' and '.join(one['closest'])} are {one['least_measured']:.1f} sigma apart. Records at all four tensions "
        f"tell every pair apart by at least {four['least_measured']:.1f} sigma. The other explanation's numbers, the "
        "sensors' zero, and tension and yaw within their errors are refitted; noise "
        f"{noise['white_mm']:g} mm, wander {noise['wander_mm']:g} mm, zero "
        f"{noise['zero_mm']:g} mm, tension {100 * noise['tension_relative']:g} %, yaw {noise['yaw_urad']:g} urad.",
        f"Beside that one record, the further runs that add most are: {best}.",
        f"This says nothing of explanations that are not among these. ({d['command']}, commit {d['commit'][:7]}.)",
    ]


def _names(models: list[str]) -> str:
    return ", ".join(LOOKS[m].words for m in models) or "no model"


HERE = Path(__file__).resolve().parent
STYLES = (PACKAGE / "show" / "report.css", HERE / "page.css")


def write_page(
    folder: Path, plates: Sequence[Plate], left_out: Mapping[int, str], origin: str, table: str, question: str
) -> Path:
    """index.html in ``folder``; table, question: HTML of the statements and of the open question."""
    from jinja2 import Environment, FileSystemLoader
    from markupsafe import Markup

    engine = Environment(loader=FileSystemLoader(HERE), autoescape=True, trim_blocks=True, lstrip_blocks=True)
    css = Markup("\n".join(path.read_text(encoding="utf-8") for path in STYLES))
    origins = {p.number: [stored_run(name).origin for name in p.stored] for p in plates}
    page = engine.get_template("page.html.j2").render(
        css=css, plates=plates, origins=origins, left_out=sorted(left_out.items()), origin=origin,
        table=Markup(table), question=Markup(question),
    )  # fmt: skip
    return write_text(folder / "index.html", page)


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
    figures = Table(("figure", "title", "here"), tuple((f"{p.number}", p.title, p.caption) for p in plates))
    runs = []
    for name in sorted({name for p in plates for name in p.stored}):
        made, shown = stored_run(name).made, ", ".join(str(p.number) for p in plates if name in p.stored)
        runs.append((name, f"`{made['command']}`", str(made["commit"])[:7], f"{made['cpu_s']:.0f}", shown))
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
        figures.markdown(),
        "Not computed:",
        "\n".join(f"- Figure {number}: {why}" for number, why in sorted(left_out.items())),
        "## Stored runs in three dimensions",
        "Too long to repeat for a picture; `python -m studies.paper_store files=outputs/study/NAME.json` puts a run "
        "into `models/paper`.",
        Table(("run", "command", "commit", "CPU s", "in figure"), tuple(runs)).markdown(),
    ]
    return "\n\n".join(parts) + "\n"


def lay_pictures(target: Path, folder: Path, plates: Sequence[Plate]) -> None:
    """The document's own pictures beside it, from the run folder."""
    for plate in plates:
        if plate.number in SHOWN:
            picture = (folder / plate.file).read_bytes()
            place = target.parent / IMAGES / f"paper_{plate.number}.png"
            write_with(place, partial(Path.write_bytes, data=picture))
