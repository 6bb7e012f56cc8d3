"""One look for all pages: header, cards, lines of text, tables."""

import html
from collections.abc import Iterable, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from nicegui import ui

PAGES = {"/": "Simulate", "/measurements": "My measurements"}
CSS = (Path(__file__).parent / "look.css").read_text(encoding="utf-8")
SCHEMES = {None: ("brightness_auto", "as the system"), False: ("light_mode", "light"), True: ("dark_mode", "dark")}
NEXT = {None: False, False: True, True: None}


def frame(here: str) -> None:
    """Header with the pages and the choice of light or dark."""
    ui.add_css(CSS)
    ui.page_title(f"belt_sim: {PAGES[here]}")
    dark = ui.dark_mode(None)
    with ui.header(fixed=False).classes("top"), ui.element("div").classes("inner"):
        ui.label("belt_sim").classes("name")
        for path, name in PAGES.items():
            ui.link(name, path).classes("here" if path == here else "")
        ui.element("div").classes("space")
        switch = ui.button(icon=SCHEMES[None][0]).props("flat round dense color=grey aria-label='light or dark'")

    def turn() -> None:
        dark.value = NEXT[dark.value]
        icon, name = SCHEMES[dark.value]
        switch.props(f"icon={icon}").tooltip(name)

    switch.on_click(turn)


@contextmanager
def card(title: str = "", why: str = "") -> Any:
    """A card with a heading and a line beneath it."""
    with ui.element("section").classes("card") as made:
        if title:
            ui.html(f"<h2>{html.escape(title)}</h2>", sanitize=False)
        if why:
            ui.label(why).classes("soft small")
        yield made


def told(line: str, kind: str = "") -> None:
    """A line that has to be seen; kind: "" (a warning), calm or good."""
    ui.label(line).classes(f"told {kind}".strip()).props("role=status" if kind else "role=alert")


def facts(rows: Mapping[str, str], kind: str = "") -> None:
    """Numbers with their names beneath; kind "wide": long ones."""
    cells = "".join(
        f'<div class="fact"><b>{html.escape(v)}</b><span>{html.escape(k)}</span></div>' for k, v in rows.items()
    )
    ui.html(cells, sanitize=False).classes(f"facts {kind}")


def table(
    columns: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    title: str = "",
    left: Sequence[str] = (),
    marked: Sequence[int] = (),
) -> None:
    """A plain table that scrolls within its card."""
    sides = [' class="left"' if c in left else "" for c in columns]
    head = "".join(f"<th{s}>{html.escape(c)}</th>" for c, s in zip(columns, sides, strict=True))
    body = ""
    for k, row in enumerate(rows):
        cells = "".join(f"<td{s}>{html.escape(str(c))}</td>" for c, s in zip(row, sides, strict=True))
        body += f"<tr{' class=marked' if k in marked else ''}>{cells}</tr>"
    caption = f"<caption>{html.escape(title)}</caption>" if title else ""
    ui.html(f"<table>{caption}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>", sanitize=False).classes(
        "scroll"
    )
