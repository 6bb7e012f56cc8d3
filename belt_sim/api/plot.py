"""Pictures and reports of results, and the files that results leave in a folder."""

import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from belt_sim.api.simulate import effects_of, models
from belt_sim.campaign import Campaign
from belt_sim.effects.base import library, title_of
from belt_sim.effects.load import save_effects
from belt_sim.errors import BeltError, InputError
from belt_sim.io import write_json, write_text
from belt_sim.results.simulation import Simulation
from belt_sim.results.words import count
from belt_sim.show.curves import curves_picture, map_picture, steady_picture, understood_picture
from belt_sim.show.style import save, svg_text
from belt_sim.units import N_PER_MM2

if TYPE_CHECKING:  # a curve does not wait for the types of comparisons and diagnoses
    import pandas as pd

    from belt_sim.results.diagnosis import Diagnosis, Discovery
    from belt_sim.results.errors import Comparison

    Result = Simulation | Comparison | Diagnosis | Discovery | Campaign

Draw = Callable[[Path | None], Any]


@dataclass(frozen=True, repr=False)
class Picture:
    """A picture that a notebook shows. figure: matplotlib's, of which everything can still be changed."""

    figure: Any

    @property
    def axes(self) -> list[Any]:
        return list(self.figure.axes)

    def save(self, path: str | os.PathLike[str], dpi: float | None = None) -> Path:
        """Write the picture to ``path`` (.png, .svg, .pdf); dpi: dots per inch of a PNG."""
        return save(self.figure, path, dpi=dpi)  # type: ignore[no-any-return]

    def _repr_png_(self) -> bytes:
        with tempfile.TemporaryDirectory() as scratch:
            return self.save(Path(scratch) / "picture.png").read_bytes()

    def __repr__(self) -> str:
        width, height = self.figure.get_size_inches()
        return f"a picture, {width:.1f} x {height:.1f} inches; .save(path), .axes"


def plot(
    result: "Result | Sequence[Simulation] | pd.DataFrame",
    path: str | os.PathLike[str] | None = None,
    *,
    kind: str | None = None,
    dpi: float | None = None,
) -> Picture:
    """A picture of ``result``, written to ``path`` (.png, .svg, .pdf) if one is given.

    result: one result, several simulations, whose curves are drawn together, or a campaign, whose readings are drawn;
    kind: "curves" of a simulation; "readings" of a campaign; "loop" of a closed loop; a column of a table of
    ``bs.sweep``; "overlay" (the default), "where", "drift" or "steady" of a comparison; "overlay", "headline", "where"
    or "drift" of a diagnosis; "unknown" or "law" of a discovery; dpi: dots per inch of a PNG.
    """
    there = pictures_by_kind(result)
    wanted = kind or next(iter(there), "")
    if wanted not in there:
        raise InputError("kind", wanted, "", f"use one of {', '.join(there) or 'none: this result has no picture'}")
    picture = Picture(there[wanted](None))
    if path is not None:
        picture.save(path, dpi)
    return picture


def pictures_by_kind(result: "Result | Sequence[Simulation] | pd.DataFrame") -> dict[str, Draw]:
    """What can be drawn of a result, the most telling picture first; each is drawn when called with a path."""
    there: dict[str, Draw] = {}
    pandas = sys.modules.get("pandas")  # who has a table has loaded it; a run of a model does not wait for it
    if pandas is not None and isinstance(result, pandas.DataFrame):
        axes = result.attrs.get("axes", {})
        if not 0 < len(axes) <= 2:
            raise InputError("result", f"{len(axes)} axes", "", "a table of bs.sweep is drawn over one or two axes")
        # a map marks no case: where some late rates have not settled, its first column is the steady rate
        steady, drawn = "steady_rate_mm_per_m", [c for c in result if c not in (*axes, "model", "settled")]
        if len(axes) == 2 and steady in drawn and not result.get("settled", np.array(True)).all():
            drawn.sort(key=lambda c: c != steady)
        for column in drawn:
            columns: Any = {c: result[c].to_numpy() for c in (*axes, column)}
            late = {"settled": "settled", "steady": steady} if column.startswith("rate") else {}
            beside = {name: result[c].to_numpy() for name, c in late.items() if c in result}
            there[column] = partial(map_picture, columns=columns, grid=tuple(axes.values()), **beside)
    elif isinstance(result, Sequence):
        curves: dict[str, Any] = {}
        for k, s in enumerate(result, start=1):
            if not isinstance(s, Simulation) or s.curves is None:
                remedy = "several results are drawn together if each is a simulation of curves"
                raise InputError("result", repr(s), "", remedy)
            name = s.title.replace("mm2", "mm²")  # numbered where two have the same
            curves[name if name not in curves else f"{name} ({k})"] = s.curves
        if curves:
            there["curves"] = partial(curves_picture, curves=curves, title="Points 1-4 against belt travel")
    elif isinstance(result, Simulation):
        simulated = " + ".join([_model_words(result.model), *(e.id for e in result.effects)])
        title = f"{simulated[:1].upper()}{simulated[1:]}, {float(result.case.settings.tension) / N_PER_MM2:g} N/mm²"
        if result.curves is not None:
            there["curves"] = partial(curves_picture, curves={result.model: result.curves}, title=title)
    elif (loop := getattr(result, "plot", None)) and hasattr(result, "margins"):  # a ClosedLoop draws itself
        there["loop"] = loop
    elif isinstance(result, Campaign):
        there["readings"] = partial(understood_picture, campaign=result)
    else:
        there = _pictures_of_inference(result)
    return there


def _pictures_of_inference(result: Any) -> dict[str, Draw]:
    """The same of a comparison, a diagnosis or a discovery: none of anything else."""
    from belt_sim.results.diagnosis import Diagnosis, Discovery
    from belt_sim.results.errors import Comparison
    from belt_sim.show import diagnosis as pictures

    there: dict[str, Draw] = {}
    if isinstance(result, Discovery):
        if result.courses:
            there["unknown"] = partial(pictures.unknown_picture, d=result)
        if result.law is not None and result.curve is not None and np.isfinite(result.curve.u).all():
            there["law"] = partial(pictures.law_picture, d=result)
    if not isinstance(result, Comparison | Diagnosis):
        return there

    words, names = _compared_words(result)
    titled, drawn = f"{words}: {result.campaign.title}", result.drawings
    if drawn.overlays or isinstance(result, Diagnosis):
        there["overlay"] = partial(pictures.overlay_picture, panels=drawn.overlays, title=titled, names=names)
    if drawn.maps or isinstance(result, Diagnosis):
        titled = f"Where {_model_words(result.base_model)} fails: {result.campaign.title}"
        there["where"] = partial(pictures.where_map_picture, maps=drawn.maps, title=titled)
        if drawn.drifts:
            titled = f"{drawn.drifts[0].parameter} fitted at each tension"
            there["drift"] = partial(pictures.drift_chart_picture, drifts=drawn.drifts, title=titled, names=names)
    if isinstance(result, Diagnosis):
        first = [p for p in drawn.overlays if p.run == result.where.worst.run][:2]
        there["headline"] = partial(pictures.overlay_picture, panels=first, title=words, names=names)
    elif result.steady:
        titled = f"Late rates: {result.campaign.title}"
        there["steady"] = partial(steady_picture, rows=result.steady, name=result.final_model, title=titled)
    return there


def _model_words(name: str) -> str:
    """A model in a few words, its name in brackets; the name where it is one of the user's own."""
    words = models().get(name, name)
    return f"{words} ({name})" if words != name else name


def _compared_words(result: "Comparison | Diagnosis") -> tuple[str, dict[str, str]]:
    """Which models a picture compares with the measurement, and their names for its legend."""
    ids = added = ", ".join(e.id for e in result.effects)
    from belt_sim.results.diagnosis import THE_LAW

    law = getattr(getattr(result, "discovery", None), "law", None)  # of a diagnosis
    if law is not None and not ids:
        ids = added = THE_LAW
    elif ids:
        spoken = []
        for e in result.effects:  # in a few words, with the id; the id alone where it is one of the user's own
            cls = library().get(e.id)
            words = e.id if cls is None else title_of(cls).partition(":")[0]
            spoken.append(f"{words} ({e.id})" if words.lower() != e.id else words)
        added = ", ".join(words[:1].lower() + words[1:] for words in spoken)
    base = _model_words(result.base_model)
    words = f"{base[:1].upper()}{base[1:]} {f'without and with {added}' if added else 'beside the measurement'}"
    return words, {"base": result.base_model, "final": f"with {ids}", "measured": result.campaign.readings}


def report_pictures(d: "Diagnosis") -> dict[str, str]:
    """The pictures of a report as SVG text, by kind: each is drawn once, for the page and for the run's folder, of the
    numbers as the folder keeps them, so that a report that is written again has the same ones."""
    from belt_sim.results.files import diagnosis_of, file_json
    from belt_sim.show.diagnosis import AROUND, MOST_PANELS, RESIDUAL, RESIDUAL_GAP, overlay_picture

    d, made = diagnosis_of(file_json(d), file_json(d.drawings), "diagnosis.json"), dict[str, str]()
    if d.drawings.overlays:
        words, names = _compared_words(d)
        fig: Any = overlay_picture(None, d.drawings.overlays, words, names=names, most=MOST_PANELS)
        svg, (width, height) = svg_text(fig), fig.get_size_inches()
        for k, ax in enumerate(ax for ax in fig.axes if ax.get_visible()):  # the group panel-0 ... says where it stands
            place = ax.get_position()
            left, top = place.x0 * width - AROUND["left"] + 0.05, (1.0 - place.y1) * height - 0.35
            right = place.x1 * width + AROUND["right"]
            bottom = (1.0 - place.y0 + (RESIDUAL + RESIDUAL_GAP) * place.height) * height + 0.5
            box = " ".join(f"{72.0 * v:.1f}" for v in (left, top, right - left, bottom - top))
            svg = svg.replace(f'<g id="panel-{k}"', f'<g id="panel-{k}" data-box="{box}"', 1)
        made["overlay"] = svg
    there = _pictures_of_inference(d) if d.drawings.maps else {}
    there = {kind: there[kind] for kind in ("where", "drift") if kind in there}
    if d.discovery is not None and d.discovery.found:
        law = _pictures_of_inference(d.discovery)
        there |= {kind: law[kind] for kind in ("unknown", *(["law"] if d.law_holds else [])) if kind in law}
    return made | {kind: svg_text(draw(None)) for kind, draw in there.items()}


def report(diagnosis: "Diagnosis | str | os.PathLike[str]", path: str | os.PathLike[str]) -> Path:
    """Write the report of a diagnosis (or of the run folder of one) to ``path`` (.html), which needs no network."""
    from belt_sim.results.files import read_diagnosis
    from belt_sim.show.report import render

    found = read_diagnosis(Path(diagnosis)) if isinstance(diagnosis, str | os.PathLike) else diagnosis
    return write_text(Path(path), render(found, report_pictures(found)))


# ---- files in the folder of a run


def draw_all(folder: Path, result: "Simulation | Comparison") -> None:
    """Every picture of a result, named by its kind."""
    for kind, drawn in pictures_by_kind(result).items():
        with numbers_first(f"{kind}.svg"):
            drawn(folder / f"{kind}.svg")


@contextmanager
def numbers_first(what: str) -> Iterator[None]:
    """Around the drawing of ``what``: a picture that cannot be drawn is told, and the numbers are kept."""
    try:
        yield
    except BeltError:
        raise
    except Exception as error:
        reason = (str(error).strip().splitlines() or [""])[0]
        print(f"belt-sim: {what}: not drawn ({type(error).__name__}: {reason})", file=sys.stderr)


def write_diagnosis(folder: Path, d: "Diagnosis", draw: Callable[[], dict[str, str]] | None = None) -> None:
    """diagnosis.json, drawings.json, effects.yaml; what was discovered; report.html and the pictures that ``draw``
    gives, as ``report_pictures``."""
    from belt_sim.results.files import file_json

    write_json(folder / "drawings.json", file_json(d.drawings))
    spread = {e.id: {n: p.u for n, p in e.parameters.items()} for e in d.effects}
    held = ""
    if d.tied:
        first, *others = (" + ".join([*d.certain_effects, *t.effects]) or "nothing" for t in d.tied)
        held = f"# This file holds one of {count(len(d.tied))} explanations that these runs cannot tell apart, "
        held += f"{first}; the others, with other sizes: {'; '.join(others)}\n"
    write_text(folder / "effects.yaml", held + save_effects(effects_of(d.effects), spread))
    if d.discovery is not None and d.discovery.found:
        if d.discovery.law_file:
            write_text(folder / "found_law.yaml", d.discovery.law_file)
        write_json(folder / "discovery.json", file_json(d.discovery))
    write_json(folder / "diagnosis.json", file_json(d))
    write_page(folder, d, draw)


def write_page(folder: Path, d: "Diagnosis", draw: Callable[[], dict[str, str]] | None = None) -> Path:
    """report.html, and its pictures as SVG files; each is drawn once."""
    from belt_sim.show.report import render

    drawn: dict[str, str] = {}
    with numbers_first("the pictures of the report"):
        drawn = draw() if draw else {}
    for kind, svg in drawn.items():
        write_text(folder / f"{kind}.svg", svg)
    return write_text(folder / "report.html", render(d, drawn))
