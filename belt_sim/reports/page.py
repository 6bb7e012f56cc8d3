"""Write a diagnosis as one HTML page that needs nothing but a browser."""

import importlib.util
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from belt_sim.errors import BeltError
from belt_sim.files import write_text
from belt_sim.reports import figures
from belt_sim.results import words
from belt_sim.results.diagnosis import Diagnosis
from belt_sim.results.drawings import Panel
from belt_sim.results.found import Tried
from belt_sim.results.written import DIAGNOSIS

HERE = Path(__file__).parent


def write_report(path: str | os.PathLike, diagnosis: Diagnosis) -> Path:
    """Write ``path`` (.html) from a diagnosis and its drawings.

    The page holds plotly once and forbids itself the network (Content-Security-Policy). What the diagnosis does not
    have leaves its section out. Raises BeltError when the file cannot be written.
    """
    page = render(diagnosis)
    try:
        return write_text(Path(path), page)
    except OSError as cause:
        raise BeltError(f"report {path}: cannot be written ({cause.strerror}); choose another folder") from cause


def render(diagnosis: Diagnosis) -> str:
    """The page as text."""
    import jinja2

    loader = jinja2.FileSystemLoader(HERE)
    page = jinja2.Environment(loader=loader, autoescape=True, undefined=jinja2.StrictUndefined)
    page.trim_blocks = page.lstrip_blocks = True
    page.filters.update(number=words.number, milli=words.thousandths, plain=words.plain, degrees=words.degrees)
    page.filters.update(listed=words.listed, rows=words.rows)
    return page.get_template("report.html.j2").render(
        d=diagnosis,
        schema=DIAGNOSIS,
        plots=_plots(diagnosis),
        bars=bars(diagnosis.ranking),
        names=[panel.title for panel in diagnosis.drawings.overlays],
        plotly=_plotly(),
    )


def _plots(d: Diagnosis) -> dict:
    """Every figure of the page, by the id of its place; ``overlays`` is a list to choose from."""
    drawn = d.drawings
    return {
        "overlays": [figures.overlay(panel, d.base_model, d.final_model) for panel in drawn.overlays],
        "first": worst(drawn.overlays),
        "where": figures.where(drawn.maps) if drawn.maps else None,
        "drift": figures.drift(drawn.drifts) if drawn.drifts else None,
    }


def bars(ranking: Sequence[Tried]) -> list[dict]:
    """Lengths [%] of the gains and of chance on one scale, log2(1 + gain / threshold)."""
    ratios = [max(c.gain, 0.0) / c.threshold if c.threshold else 0.0 for c in ranking]
    full = float(np.log2(1.0 + max([1.0, *ratios])))
    lengths = [round(100.0 * float(np.log2(1.0 + ratio)) / full, 1) for ratio in ratios]
    chance = round(100.0 / full, 1)
    pairs = zip(ratios, lengths, strict=True)
    return [{"length": length, "chance": chance, "beyond_chance": ratio > 1.0} for ratio, length in pairs]


def worst(panels: Sequence[Panel]) -> int:
    """The panel whose model before is farthest out of its band: the one to show first."""
    if not panels:
        return 0
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = [np.abs(p.base - p.measured) / np.maximum(p.band, 1e-12) for p in panels]
    means = [float(np.mean(r[np.isfinite(r)])) if np.isfinite(r).any() else 0.0 for r in ratios]
    return int(np.argmax(means))


def _plotly() -> str:
    """plotly.js as the installed plotly package brings it (not imported: that takes a second)."""
    spec = importlib.util.find_spec("plotly")
    if spec is None or spec.origin is None:
        raise BeltError("report: plotly is not installed; run `make setup`")
    return (Path(spec.origin).parent / "package_data" / "plotly.min.js").read_text(encoding="utf-8")
