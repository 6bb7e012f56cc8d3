"""Widgets of all pages: header, cards, notices, sliders, the list of effects, pictures."""

import html
from collections.abc import Awaitable, Callable, Iterable, Mapping
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import Any

from nicegui import ui
from yaml import safe_load

from belt_sim.api.plot import plot
from belt_sim.effects.base import library, title_of
from belt_sim.results.words import in_print
from belt_sim.show.report import inline_svg
from belt_sim.show.style import svg_text
from belt_sim.units import round_digits

PAGES = {"/": "Simulate", "/measurements": "My measurements"}
CSS = (Path(__file__).parent / "widgets.css").read_text(encoding="utf-8")


def frame(here: str) -> None:
    """The header of a page, with links to the others."""
    ui.add_css(CSS)
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


#: words that people say -> effects whose own words lack them
SPOKEN_WORDS: dict[str, str] = safe_load((Path(__file__).parent / "spoken_words.yaml").read_text(encoding="utf-8"))


def effect_words() -> dict[str, str]:
    """The words by which each effect is found, in the order of their titles."""
    found = {}
    for i, cls in sorted(library().items(), key=lambda pair: title_of(pair[1])):
        meanings = [p.meaning for p in cls.parameters.values()][:6]
        said = [i.replace("_", " "), title_of(cls), cls.cause.phrase if cls.cause else "", *meanings]
        said += [words for words, ids in SPOKEN_WORDS.items() if i in ids.split()]
        found[i] = " ".join(said).lower()
    return found


def effect_list(label: str, chosen: Iterable[str], to: Callable[[list[str]], Any]) -> None:
    """Effects to tick, with a field that finds them by all words written there; ``to`` hears of the list."""
    ticks: dict[str, ui.checkbox] = {}

    def tell() -> Any:
        return to([i for i, tick in ticks.items() if tick.value])

    search = ui.input(label, placeholder="conical, misaligned, hot, thick ...")
    search.props("dense outlined clearable data-name=find").classes("w-full")
    with box("scroll"):
        for i, words in effect_words().items():
            ticks[i] = ui.checkbox(title_of(library()[i]), value=i in chosen, on_change=tell).props("dense")
            found = lambda text, words=words: all(word in words for word in (text or "").lower().split())  # noqa: E731
            ticks[i].classes("w-full").bind_visibility_from(search, "value", found)


ONE_PICTURE = Lock()  # Matplotlib draws one picture at a time


def page_picture(result: Any) -> str:
    """What ``bs.plot`` draws of a result, in the colours of the page."""
    with ONE_PICTURE:
        return str(inline_svg(svg_text(plot(result).figure)))
