"""Widgets of all pages: header, cards, notices, sliders, the list of effects, charts."""

import html
from collections.abc import Awaitable, Callable, Iterable, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import ui

from belt_sim.effects.base import library, title_of
from belt_sim.results.files import DRAWING_DIGITS, round_numbers
from belt_sim.results.words import in_print
from belt_sim.units import round_digits

PAGES = {"/": "Simulate", "/measurements": "My measurements"}
CSS = (Path(__file__).parent / "widgets.css").read_text(encoding="utf-8")


def frame(here: str) -> None:
    """The header of a page, with links to the others."""
    ui.add_css(CSS)
    ui.page_title(f"belt_sim: {PAGES[here]}")
    with ui.header(fixed=False).classes("top"), box("inner"):
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
        if why:
            soft(why)
        yield made


def soft(text: str) -> ui.label:
    """A line that need not be read."""
    return ui.label(in_print(text)).classes("soft small")


def notice(line: str, kind: str = "") -> None:
    """A line that has to be seen; kind: "" (a warning) or calm."""
    ui.label(in_print(line)).classes(f"told {kind}".strip()).props("role=status" if kind else "role=alert")


def facts(rows: Mapping[str, str], kind: str = "") -> None:
    """Numbers with their names beneath; kind "wide": long ones."""
    cells = (
        f'<div class="fact"><b>{html.escape(in_print(v))}</b><span>{html.escape(k)}</span></div>'
        for k, v in rows.items()
    )
    ui.html("".join(cells), sanitize=False).classes(f"facts {kind}")


def labelled_slider(
    label: str, values: dict[str, Any], key: str, ends: tuple[float, float], changed: Callable[[], Awaitable[None]], *,
    mark: str, step: float | None = None, shown: float = 1.0,
) -> None:  # fmt: skip
    """A slider with a field beside it, of ``values[key]`` between the ``ends``; ``changed`` hears of every new value.

    step: of the slider, a two-hundredth of its way if None; shown: units that people read in one of the value's.
    """
    low, high = (end * shown for end in ends)

    async def take(event: Any) -> None:
        if event.value is not None:  # nothing, or no number yet
            values[key] = min(max(float(event.value), low), high) / shown
            await changed()

    with box("asked"):
        ui.label(label).classes("label")
        slider = ui.slider(min=low, max=high, step=step or round_digits((high - low) / 200.0, 2))
        slider.props(f"data-name='slider-{mark}' aria-label='{mark}'")
        number = ui.number(value=round_digits(values[key] * shown, 4), min=low, max=high, format="%.6g", on_change=take)
        number.props("dense outlined hide-bottom-space debounce=400").props(f"aria-label='{mark} number'")
        slider.bind_value(number, forward=lambda v: None if v is None else round_digits(float(v), 4))


# ---- the list of effects

EFFECT_GROUPS = ("Pulleys", "Belt, rollers and loads", "Steering and tension", "Sensors", "Models")
#: words that people say -> effects whose own words lack them
SPOKEN_WORDS = {
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
#: of the tree of effects: a node is found by all words that are written
FOUND = "(node, text) => text.toLowerCase().split(' ').every((word) => (node.words ?? '').includes(word))"


def effect_groups() -> list[dict[str, Any]]:
    """Nodes of a tree: the parts of the machine, with the effects there and the words by which each is found."""
    groups: dict[str, list[dict[str, Any]]] = {part: [] for part in EFFECT_GROUPS}
    for i, cls in sorted(library().items(), key=lambda pair: title_of(pair[1])):
        part = "Pulleys" if cls.cause and {*cls.cause.parts} & {"tail", "head"} else "Belt, rollers and loads"
        part = {"sensor": "Sensors", "drive": "Steering and tension"}.get(cls.law, part)
        if cls.cause is None or cls.cause.of_model:
            part = "Models"
        meanings = [p.meaning for p in cls.parameters.values()][:6]
        said = [i.replace("_", " "), title_of(cls), cls.cause.phrase if cls.cause else "", *meanings]
        said += [words for words, ids in SPOKEN_WORDS.items() if i in ids.split()]
        groups[part].append({"id": i, "label": title_of(cls), "words": " ".join(said).lower()})
    shut = {"noTick": True, "selectable": False}
    return [{"id": part, "label": part, "children": nodes} | shut for part, nodes in groups.items()]


def effect_list(label: str, chosen: Iterable[str], to: Callable[[list[str]], Any]) -> None:
    """Effects to tick, in groups by the part of the machine, with a field that finds them; ``to`` hears of the list."""
    groups = effect_groups()
    ticked = [node["id"] for group in groups for node in group["children"] if node["id"] in {*chosen}]

    def unfold() -> None:
        """Show all that is found, else the groups of what is ticked."""
        now = {*tree.props["ticked"]}
        tree.collapse().expand([g["id"] for g in groups if search.value or now & {n["id"] for n in g["children"]}])

    def pick(event: Any) -> Any:
        """Press the words of an effect as its box."""
        if event.value is None:
            return None
        tree.props["ticked"] = sorted({*tree.props["ticked"]} ^ {event.value})
        tree.deselect()
        return to(tree.props["ticked"])

    search = ui.input(label, placeholder="conical, misaligned, hot, thick ...", on_change=unfold)
    search.props("dense outlined clearable data-name=find").classes("w-full")
    tree = ui.tree(groups, on_select=pick, on_tick=lambda event: to(sorted(event.value))).props("dense").tick(ticked)
    tree.props["no-results-label"] = "Nothing found. Try another word, or clear the field to see all effects."
    tree.props[":filter-method"] = FOUND
    search.bind_value_to(tree, "filter", lambda text: (text or "").strip())
    unfold()


# ---- figures, in colours that are read on light and on dark ground alike

GREY, FAINT_LINE, CLEAR_GROUND = "#7d8a97", "rgba(125,138,151,0.28)", "rgba(0,0,0,0)"
PLOT_COLOURS = ("#1f86cc", "#d98e00", "#0f9d76", "#e0632a")  # points 1-4
AXIS_LOOK = {"gridcolor": FAINT_LINE, "zerolinecolor": GREY, "linecolor": FAINT_LINE, "automargin": True}
LAYOUT = {
    **{"paper_bgcolor": CLEAR_GROUND, "plot_bgcolor": CLEAR_GROUND, "hovermode": "x unified", "showlegend": True},
    "font": {"family": "system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif", "size": 13, "color": GREY},
    "margin": {"l": 56, "r": 10, "t": 34, "b": 44},
    "legend": {"orientation": "h", "yanchor": "bottom", "y": 1.02, "x": 0, "font": {"size": 12}},
    "hoverlabel": {"bgcolor": "rgba(40,48,56,0.92)", "font": {"color": "#ffffff"}},
}


def chart(data: list[dict[str, Any]], y: str, height: int) -> dict[str, Any]:
    """A figure against belt travel, with labelled axes and its legend above."""
    axes = {"xaxis": AXIS_LOOK | {"title": {"text": "belt travel [m]"}}, "yaxis": AXIS_LOOK | {"title": {"text": y}}}
    config = {"displaylogo": False, "displayModeBar": False, "responsive": True}
    return {"data": data, "layout": {**LAYOUT, **axes, "height": height}, "config": config}


def line(x: Any, y: Any, name: str, colour: str, look: Mapping[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    """A curve, null where it is not finite; look: of its line; ``more`` as plotly takes it."""
    x, y = (round_numbers(np.asarray(values, float).tolist(), DRAWING_DIGITS) for values in (x, y))
    drawn = {"color": colour, "width": 2, "simplify": False, **(look or {})}
    return {"type": "scatter", "mode": "lines", "x": x, "y": y, "name": name, "line": drawn, **more}
