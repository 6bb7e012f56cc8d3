"""Write a diagnosis as one HTML page that needs nothing but a browser."""

import importlib.util
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from belt_sim.errors import BeltError
from belt_sim.pictures.drift_chart import Drift
from belt_sim.pictures.overlay import Panel
from belt_sim.pictures.where import FailureMap
from belt_sim.report import figures, words

HERE = Path(__file__).parent


@dataclass(frozen=True, kw_only=True)
class Figures:
    """What the report draws; the same shapes as the pictures take. Anything may be empty.

    overlays: one Panel a run and signal; maps: E/u_val by signal and yaw sign; drifts: (before, after) each.
    """

    overlays: Sequence[Panel] = ()
    maps: Sequence[FailureMap] = ()
    drifts: Sequence[tuple[Drift, Drift | None]] = ()


def write_report(path: str | os.PathLike, diagnosis: Mapping, drawn: Figures | None = None) -> Path:
    """Write ``path`` (.html) from a diagnosis (diagnosis.json's contents) and its figures.

    The page holds plotly once and forbids itself the network (Content-Security-Policy). Keys that the
    diagnosis does not have leave their section out. Raises BeltError when the file cannot be written.
    """
    path = Path(path)
    draft = path.with_name(f".{path.name}.{os.getpid()}.part")
    page = render(diagnosis, drawn or Figures())
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        draft.write_text(page, encoding="utf-8")
        os.replace(draft, path)
    except OSError as cause:
        raise BeltError(f"report {path}: cannot be written ({cause.strerror}); choose another folder") from cause
    return path


def render(diagnosis: Mapping, drawn: Figures) -> str:
    """The page as text."""
    import jinja2

    loader = jinja2.FileSystemLoader(HERE)
    page = jinja2.Environment(loader=loader, autoescape=True, undefined=jinja2.ChainableUndefined)
    page.trim_blocks = page.lstrip_blocks = True
    page.filters.update(number=words.number, mm=words.millimetres, plain=words.plain)
    page.filters.update(listed=words.listed, rows=words.rows)
    page.globals.update(with_u=words.with_u)
    return page.get_template("report.html.j2").render(
        d=_plain(diagnosis),
        headline=words.HEADLINES.get(str(diagnosis.get("verdict")), str(diagnosis.get("verdict"))),
        sentence=words.verdict_sentence(diagnosis),
        rejected=diagnosis.get("verdict") in words.REJECTED,
        plots=_plots(diagnosis, drawn),
        bars=bars(diagnosis.get("ranking") or []),
        names=[panel.title for panel in drawn.overlays],
        plotly=_plotly(),
    )


def _plots(diagnosis: Mapping, drawn: Figures) -> dict:
    """Every figure of the page, by the id of its place; ``overlays`` is a list to choose from."""
    base = str(diagnosis.get("base_model", "model"))
    final = " + ".join([base, *[str(e["id"]) for e in diagnosis.get("effects") or []]])
    overlays = [figures.overlay(panel, base, final) for panel in drawn.overlays]
    plots: dict = {"overlays": overlays, "first": worst(drawn.overlays)}
    if drawn.maps:
        plots["where"] = figures.where(drawn.maps)
    if drawn.drifts:
        plots["drift"] = figures.drift(drawn.drifts)
    return plots


def bars(ranking: Sequence[Mapping]) -> list[dict]:
    """Lengths [%] of the gains and of chance on one scale, log2(1 + gain / threshold)."""
    ratios = [max(float(r["gain"]), 0.0) / float(r["threshold"]) if r.get("threshold") else 0.0 for r in ranking]
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


def _plain(value):
    """NumPy numbers and arrays as Python's own, so that the page can print them."""
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def _plotly() -> str:
    """plotly.js as the installed plotly package brings it (not imported: that takes a second)."""
    spec = importlib.util.find_spec("plotly")
    if spec is None or spec.origin is None:
        raise BeltError("report: plotly is not installed; run `make setup`")
    return (Path(spec.origin).parent / "package_data" / "plotly.min.js").read_text(encoding="utf-8")
