"""Widgets of all pages: header, cards, notices, tables, sliders, the sketch of the points, the list of effects; figures
as plain plotly data."""

import html
from collections.abc import Awaitable, Callable, Iterable, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import ui

from belt_sim.campaign import Campaign, Run
from belt_sim.effects.base import library, title_of
from belt_sim.results.errors import UNITS
from belt_sim.results.files import DIGITS, round_numbers
from belt_sim.results.simulation import Simulation
from belt_sim.results.words import KILO, Table, in_print
from belt_sim.show.report import environment
from belt_sim.units import N_PER_MM2, round_digits

PAGES = {"/": "Simulate", "/measurements": "My measurements"}
CSS = (Path(__file__).parent / "widgets.css").read_text(encoding="utf-8")


def frame(here: str) -> None:
    """The header of a page, with links to the others."""
    ui.add_css(CSS)
    ui.page_title(f"belt_sim: {PAGES[here]}")
    with ui.header(fixed=False).classes("top"), ui.element("div").classes("inner"):
        ui.label("belt_sim").classes("name")
        for path, name in PAGES.items():
            ui.link(name, path).classes("here" if path == here else "")


def box(*classes: str) -> ui.element:
    """An element that lays out what stands in it."""
    return ui.element("div").classes(" ".join(classes))


def quiet_button(text: str, on_click: Any) -> ui.button:
    """A button beside others."""
    return ui.button(text, on_click=on_click).props("flat no-caps dense")


@contextmanager
def card(title: str, why: str = "") -> Any:
    """A card with a heading and a line beneath it."""
    with ui.element("section").classes("card") as made:
        ui.html(f"<h2>{html.escape(title)}</h2>", sanitize=False)
        soft(why) if why else None
        yield made


def soft(text: str) -> ui.label:
    """A line that need not be read."""
    return ui.label(in_print(text)).classes("soft small")


def notice(line: str, kind: str = "") -> None:
    """A line that has to be seen; kind: "" (a warning), calm or good."""
    ui.label(in_print(line)).classes(f"told {kind}".strip()).props("role=status" if kind else "role=alert")


def facts(rows: Mapping[str, str], kind: str = "") -> None:
    """Numbers with their names beneath; kind "wide": long ones."""
    cells = (
        f'<div class="fact"><b>{html.escape(in_print(v))}</b><span>{html.escape(k)}</span></div>'
        for k, v in rows.items()
    )
    ui.html("".join(cells), sanitize=False).classes(f"facts {kind}")


def table(t: Table) -> None:
    """A table that scrolls in its own box."""
    ui.html(t.html(), sanitize=False).classes("scroll")


def labelled_slider(
    label: str, value: float, ends: tuple[float, float], to: Callable[[float], Awaitable[None]], *,
    mark: str, step: float | None = None, shown: float = 1.0,
) -> None:  # fmt: skip
    """A slider with a field beside it; ``to`` hears of every new value between the ``ends``.

    step: of the slider, a two-hundredth of its way if None; shown: units that people read in one of the value's.
    """
    low, high = (end * shown for end in ends)

    async def take(event: Any) -> None:
        if event.value is not None:  # nothing, or no number yet
            await to(min(max(float(event.value), low), high) / shown)

    with box("asked"):
        ui.label(label).classes("label")
        slider = ui.slider(min=low, max=high, step=step or round_digits((high - low) / 200.0, 2))
        slider.props(f"data-name='slider-{mark}' aria-label='{mark}'")
        number = ui.number(value=round_digits(value * shown, 4), min=low, max=high, format="%.6g", on_change=take)
        number.props("dense outlined hide-bottom-space debounce=400").props(f"aria-label='{mark} number'")
        slider.bind_value(number, forward=lambda v: None if v is None else round_digits(float(v), 4))


#: where sensors stand: place -> its centre on the sketch of the machine
SPOTS = {"point_1": (520, 36), "point_2": (520, 144), "point_3": (120, 144), "point_4": (120, 36)}
SPOTS |= {"upper_mid_span": (320, 36), "lower_mid_span": (320, 124)}


def sketch(taken: Mapping[str, str], choose: Callable[[str], Any]) -> None:
    """The machine of a report with a button at every place; taken: place -> what stands there; ``choose`` hears the
    place."""
    drawn = environment().get_template("sketch.svg.j2").render(marked=(), marks=(), spots=())
    with box("sketch").props("data-name=sketch"):
        ui.html(drawn, sanitize=False)
        for place, (x, y) in SPOTS.items():
            spot = ui.button(place[-1] if place.startswith("point") else "tilt", on_click=partial(choose, place))
            spot.props(f"dense rounded no-caps {'' if place in taken else 'outline'} data-name='spot-{place}'")
            spot.classes("spot").style(f"left: {x / 6.4}%; top: {y / 1.9}%")
            spot.tooltip(f"{place.replace('_', ' ')}: {taken.get(place, 'free')}")


PARTS = ("Pulleys", "Belt, rollers and loads", "Steering and tension", "Sensors", "Models")
#: words that people say -> effects whose own words lack them
SYNONYMS = {
    "misaligned askew crooked skewed out of square schief": "yaw_offset_tail yaw_offset_head cant wobble idler_skew",
    "conical cone konisch": "taper build_up taper_drift thickness_wedge",
    "hot heat warm thermal": "temperature_difference taper_drift yaw_drift warm_up",
    "thick thickness": "thickness_wedge crown taper",
    "worn wear": "taper crown edge_profile slip",
    "banana bow sabre": "camber weld",
    "scraper skirt cleaner": "side_drag off_centre_load",
    "slack loose load cell": "tension_bias unequal_tension",
    "wet oil water slippery": "traction_loss slip",
    "dirt cake": "build_up",
    "lag late": "sensor_delay delay",
    "splice joint seam": "weld",
    "warped wavy": "camber edge_profile flatness",
    "wind draught": "machine_tilt",  # another even push to one side
    "gap clearance": "edge_guide yaw_backlash",
}


def part_of(effect_id: str) -> str:
    """The part of the machine under which an effect is listed."""
    cls = library()[effect_id]
    if cls.cause is None or cls.cause.of_model:
        return "Models"
    if cls.law in ("sensor", "drive"):
        return "Sensors" if cls.law == "sensor" else "Steering and tension"
    return "Pulleys" if {*cls.cause.parts} & {"tail", "head"} else "Belt, rollers and loads"


def search_words(effect_id: str) -> str:
    """All words by which an effect is found, in lower case."""
    cls = library()[effect_id]
    meanings = [p.meaning for p in cls.parameters.values()][:6]
    said = [effect_id.replace("_", " "), title_of(cls), cls.cause.phrase if cls.cause else "", *meanings]
    return " ".join([*said, *(words for words, ids in SYNONYMS.items() if effect_id in ids.split())]).lower()


def effect_list(label: str, chosen: Iterable[str], to: Callable[[list[str]], Any]) -> None:
    """Effects to tick, in groups by the part of the machine, with a field that finds them; ``to`` hears of the list."""
    ticked, boxes, groups = dict.fromkeys(chosen), dict[str, Any](), dict[str, Any]()

    async def tick(effect_id: str, event: Any) -> None:
        ticked.pop(effect_id, None)
        ticked.update({effect_id: None} if event.value else {})
        if (heard := to([*ticked])) is not None:
            await heard

    def find(event: Any) -> None:
        wanted = str(event.value or "").lower().split()
        hits = {i for i in boxes if all(word in search_words(i) for word in wanted)}
        for i, found in boxes.items():
            found.set_visibility(i in hits)
        nothing.set_visibility(not hits)
        for part, group in groups.items():
            group.set_visibility(any(part_of(i) == part for i in hits))
            group.set_value(bool(wanted) or any(part_of(i) == part for i in ticked))

    search = ui.input(label, placeholder="conical, misaligned, hot, thick ...", on_change=find)
    search.props("dense outlined clearable data-name=find").classes("w-full")
    nothing = soft("Nothing found. Try another word, or clear the field to see all effects.")
    nothing.set_visibility(False)
    for part in PARTS:
        groups[part] = ui.expansion(part, value=any(part_of(i) == part for i in ticked)).classes("w-full dense")
    for i in sorted(library(), key=lambda i: title_of(library()[i])):
        with groups[part_of(i)]:
            boxes[i] = ui.checkbox(title_of(library()[i]), value=i in ticked, on_change=lambda e, i=i: tick(i, e))
            boxes[i].props("dense").classes("w-full small")


# ---- figures, in colours that are read on light and on dark ground alike

GREY, FAINT, CLEAR = "#7d8a97", "rgba(125,138,151,0.28)", "rgba(0,0,0,0)"
POINTS = ("#1f86cc", "#d98e00", "#0f9d76", "#e0632a")  # points 1-4
POINT_NAMES = ("1 upper, tail", "2 lower, tail", "3 lower, head", "4 upper, head")
AXIS = {"gridcolor": FAINT, "zerolinecolor": GREY, "linecolor": FAINT, "automargin": True}
LAYOUT = {
    **{"paper_bgcolor": CLEAR, "plot_bgcolor": CLEAR, "hovermode": "x unified", "showlegend": True},
    "font": {"family": "system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif", "size": 13, "color": GREY},
    "margin": {"l": 56, "r": 10, "t": 34, "b": 44},
    "legend": {"orientation": "h", "yanchor": "bottom", "y": 1.02, "x": 0, "font": {"size": 12}},
    "hoverlabel": {"bgcolor": "rgba(40,48,56,0.92)", "font": {"color": "#ffffff"}},
}


def chart(data: list[dict[str, Any]], y: str, height: int, **layout: Any) -> dict[str, Any]:
    """A figure against belt travel, with labelled axes and its legend above."""
    axes = {"xaxis": AXIS | {"title": {"text": "belt travel [m]"}}, "yaxis": AXIS | {"title": {"text": y}}}
    axes |= {name: axes[name] | layout.pop(name, {}) for name in axes}
    config = {"displaylogo": False, "displayModeBar": False, "responsive": True}
    return {"data": data, "layout": {**LAYOUT, **axes, "height": height, **layout}, "config": config}


def line(x: Any, y: Any, name: str, colour: str, look: Mapping[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    """A curve, null where it is not finite; look: of its line; ``more`` as plotly takes it."""
    x, y = (round_numbers(np.asarray(values, float).tolist(), DIGITS) for values in (x, y))
    drawn = {"color": colour, "width": 2, "simplify": False, **(look or {})}
    return {"type": "scatter", "mode": "lines", "x": x, "y": y, "name": name, "line": drawn, **more}


def lateral(shown: Simulation, beside: Simulation | None) -> dict[str, Any]:
    """Lateral position of points 1-4 against travel; another model beside it, dotted."""
    data = []
    for s in filter(None, (shown, beside)):
        for k, y in enumerate(KILO * np.asarray(s.curves.y) if s.curves is not None else ()):
            label, look = (POINT_NAMES[k], {}) if s is shown else (f"{k + 1} by {s.model}", {"dash": "dot"})
            more = {"legendgroup": str(k), "showlegend": s is shown}
            data.append(line(s.curves.travel, y, label, POINTS[k], look, **more))  # type: ignore[union-attr]
    return chart(data, "lateral position [mm]", 420)


def edges(shown: Simulation) -> dict[str, Any] | None:
    """Tension of the slacker edge where each span runs up; below zero it is slack. None where a model has none."""
    if shown.curves is None or shown.curves.edge_stress is None:
        return None
    stress = np.asarray(shown.curves.edge_stress) / N_PER_MM2
    spans = zip(("upper span", "lower span"), (POINTS[0], POINTS[3]), stress, strict=True)
    data = [line(shown.curves.travel, own, name, colour) for name, colour, own in spans]
    below = {"type": "rect", "xref": "paper", "x0": 0, "x1": 1, "y1": 0, "layer": "below", "line": {"width": 0}}
    below |= {"y0": min(2.0 * float(stress.min()), -0.5), "fillcolor": "rgba(224,99,42,0.16)"}
    return chart(data, "slacker edge [N/mm²]", 240, shapes=[below], yaxis={"rangemode": "tozero"})


def measured_figure(campaign: Campaign, run: Run) -> dict[str, Any]:
    """The signals of a run as they were recorded."""
    sheets, look = {s.name: s for s in campaign.signals}, {"mode": "lines+markers", "marker": {"size": 4}}
    units = " or ".join(sorted({UNITS[sheets[name].kind] for name in run.signals}))
    data = [
        line(run.travel, KILO * y, f"{name} ({sheets[name].at.replace('_', ' ')})", POINTS[k % 4], {"width": 1}, **look)
        for k, (name, y) in enumerate(run.signals.items())
    ]
    return chart(data, f"reading [{units}]", 320)
