"""The gallery as one page that needs no network: pictures beside it, light and dark, narrow and wide."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from belt_sim.files import write_text
from belt_sim.paths import PACKAGE
from studies.paper.plate import Plate
from studies.paper.stored import stored

HERE = Path(__file__).resolve().parent
STYLES = (PACKAGE / "reports" / "report.css", HERE / "page.css")


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
        css=css, plates=[_shown(p) for p in plates], left_out=sorted(left_out.items()), origin=origin, **told
    )
    return write_text(folder / "index.html", page)


def _shown(plate: Plate) -> dict[str, Any]:
    return {
        "number": plate.number,
        "title": plate.title,
        "caption": plate.caption,
        "file": plate.file,
        "origins": [stored(name).origin for name in plate.stored],
    }
