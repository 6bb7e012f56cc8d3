"""Widgets of all pages: header, cards, notices, tables, sliders; figures as plain plotly data."""

import html
from collections.abc import Awaitable, Callable, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import ui

from belt_sim.campaign import Campaign, Run
from belt_sim.results.errors import UNITS
from belt_sim.results.files import DIGITS, round_numbers
from belt_sim.results.simulation import Simulation
from belt_sim.results.words import KILO, Table
from belt_sim.units import N_PER_MM2, round_digits

PAGES = {"/": "Simulate", "/measurements": "My measurements"}
CSS = (Path(__file__).parent / "widgets.css").read_text(encoding="utf-8")


def frame(here: str) -> None:
    ui.add_css(CSS)
    ui.page_title(f"belt_sim: {PAGES[here]}")
    with ui.header(fixed=False).classes("top"), ui.element("div").classes("inner"):
        ui.label("belt_sim").classes("name")
        for path, name in PAGES.items():
            ui.link(name, path).classes("here" if path == here else "")


@contextmanager
def card(title: str, why: str = "") -> Any:
    """A card with a heading and a line beneath it."""
    with ui.element("section").classes("card") as made:
        ui.html(f"<h2>{html.escape(title)}</h2>", sanitize=False)
        if why:
            ui.label(why).classes("soft small")
        yield made


def notice(line: str, kind: str = "") -> None:
    """A line that has to be seen; kind: "" (a warning), calm or good."""
    ui.label(line).classes(f"told {kind}".strip()).props("role=status" if kind else "role=alert")


def facts(rows: Mapping[str, str], kind: str = "") -> None:
    """Numbers with their names beneath; kind "wide": long ones."""
    cells = "".join(
        f'<div class="fact"><b>{html.escape(v)}</b><span>{html.escape(k)}</span></div>' for k, v in rows.items()
    )
    ui.html(cells, sanitize=False).classes(f"facts {kind}")


def table(t: Table) -> None:
    ui.html(t.html(), sanitize=False).classes("scroll")


OFTEN = 0.08  # [s] between two values that a moving slider sends


def labelled_slider(
    label: str, value: float, low: float, high: float, step: float, to: Callable[[float], Awaitable[None]], *, mark: str
) -> None:
    """``to`` hears of every new value between ``low`` and ``high``."""
    with ui.element("div").classes("asked"):
        ui.label(label).classes("label")
        slider = (
            ui.slider(min=low, max=high, step=step, value=value)
            .props(f"data-name='slider-{mark}'")
            .props(f"aria-label='{mark}'")
        )
        number = ui.number(value=round_digits(value, 4), format="%.6g").props(
            "dense outlined hide-bottom-space debounce=400"
        )
        number.props(f"data-name='number-{mark}'").props(f"aria-label='{mark} number'")

    async def on_slide(event: Any) -> None:
        number.set_value(round_digits(float(event.args), 4))
        await to(float(event.args))

    async def on_type(event: Any) -> None:
        if event.args in (None, ""):
            return
        try:
            wanted = min(max(float(event.args), low), high)
        except ValueError:
            return
        slider.set_value(wanted)
        await to(wanted)

    slider.on("update:model-value", on_slide, throttle=OFTEN, leading_events=False)
    number.on("update:model-value", on_type)


GREY, FAINT = "#7d8a97", "rgba(125,138,151,0.28)"
POINTS = ("#1f86cc", "#d98e00", "#0f9d76", "#e0632a")  # points 1-4, as colours.POINTS
POINT_NAMES = ("1 upper, tail", "2 lower, tail", "3 lower, head", "4 upper, head")
SPANS = (POINTS[0], POINTS[3])  # upper, lower
FONT = {"family": "system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif", "size": 13}
CLEAR = "rgba(0,0,0,0)"
AXIS = {"gridcolor": FAINT, "zerolinecolor": GREY, "linecolor": FAINT, "automargin": True}
LEGEND = {"orientation": "h", "yanchor": "bottom", "y": 1.02, "x": 0, "font": {"size": 12}}
MARGIN = {"l": 56, "r": 10, "t": 34, "b": 44}
CONFIG = {"displaylogo": False, "displayModeBar": False, "responsive": True}


def numbers(values: Any) -> list[Any]:
    """An array as JSON numbers, null where it is not finite."""
    return round_numbers(np.asarray(values, float).tolist(), DIGITS)  # type: ignore[no-any-return]


def figure(data: list[dict[str, Any]], x: str, y: str, height: int, **layout: Any) -> dict[str, Any]:
    """A figure with labelled axes and its legend above."""
    common = {"paper_bgcolor": CLEAR, "plot_bgcolor": CLEAR, "font": {**FONT, "color": GREY}, "height": height}
    axes = {"xaxis": {**AXIS, "title": _title(x)}, "yaxis": {**AXIS, "title": _title(y)}}
    look = {"margin": MARGIN, "legend": LEGEND, "hovermode": "x unified"}
    look["hoverlabel"] = {"bgcolor": "rgba(40,48,56,0.92)", "font": {"color": "#ffffff"}}
    return {"data": data, "layout": {**common, **axes, **look, "showlegend": True, **layout}, "config": CONFIG}


def _title(text: str) -> dict[str, Any]:
    return {"text": text, "font": {"size": 13}}


def line(x: Any, y: Any, name: str, colour: str, **more: Any) -> dict[str, Any]:
    """A curve; ``more`` as plotly takes it."""
    look = {"color": colour, "width": 2, "simplify": False, **more.pop("line", {})}
    return {"type": "scatter", "mode": "lines", "x": numbers(x), "y": numbers(y), "name": name, "line": look, **more}


def lateral(shown: Simulation, beside: Simulation | None) -> dict[str, Any]:
    """Lateral position of points 1-4 against travel; another model beside it, dashed."""
    data = []
    for simulation, dashed in ((shown, False), (beside, True)):
        if simulation is None or simulation.curves is None:
            continue
        look = {"line": {"dash": "dot", "width": 1.6}, "opacity": 0.9} if dashed else {}
        for k, name in enumerate(POINT_NAMES):
            label = f"{k + 1} by {simulation.model}" if dashed else name
            y = KILO * np.asarray(simulation.curves.y)[k]
            more = {**look, "legendgroup": str(k), "showlegend": not dashed}
            data.append(line(simulation.curves.travel, y, label, POINTS[k], **more))
    return figure(data, "belt travel [m]", "lateral position [mm]", 420)


def edges(shown: Simulation) -> dict[str, Any] | None:
    """Tension of the slacker edge where each span runs up; below zero it is slack. None where a model has none."""
    if shown.curves is None or shown.curves.edge_stress is None:
        return None
    stress = np.asarray(shown.curves.edge_stress) / N_PER_MM2
    data = [line(shown.curves.travel, stress[k], f"{name} span", SPANS[k]) for k, name in enumerate(("upper", "lower"))]
    low = min(0.0, float(stress.min()))
    below = {"type": "rect", "xref": "paper", "x0": 0, "x1": 1, "y0": min(2.0 * low, -0.5), "y1": 0, "layer": "below"}
    below |= {"fillcolor": "rgba(224,99,42,0.16)", "line": {"width": 0}}
    up = {**AXIS, "rangemode": "tozero", "title": _title("slacker edge [N/mm²]")}
    return figure(data, "belt travel [m]", "", 240, shapes=[below], yaxis=up)


def measured_figure(campaign: Campaign, run: Run) -> dict[str, Any]:
    """The signals of a run as they were recorded."""
    sheets = {s.name: s for s in campaign.signals}
    units = sorted({UNITS[sheets[name].kind] for name in run.signals})
    data = []
    for k, (name, values) in enumerate(run.signals.items()):
        at = sheets[name].at.replace("_", " ")
        more = {"mode": "lines+markers", "marker": {"size": 4}, "line": {"width": 1}}
        data.append(line(run.travel, KILO * values, f"{name} ({at})", POINTS[k % len(POINTS)], **more))
    end = float(run.travel[-1]) if len(run.travel) else 1.0
    along = {**AXIS, "range": [-0.01 * end, 1.01 * end], "title": _title("belt travel [m]")}
    return figure(data, "", f"reading [{' or '.join(units)}]", 320, xaxis=along)
