"""Widgets of all pages: header, cards, notices, tables, sliders."""

import html
from collections.abc import Awaitable, Callable, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from nicegui import ui

from belt_sim.results.display import Table
from belt_sim.si import round_digits

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
