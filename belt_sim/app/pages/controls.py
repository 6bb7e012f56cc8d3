"""A slider with its number beside it, which may be typed as well."""

from collections.abc import Awaitable, Callable
from typing import Any

from nicegui import ui

OFTEN = 0.08  # [s] between two values that a moving slider sends


def labelled_slider(
    label: str,
    value: float,
    low: float,
    high: float,
    step: float,
    to: Callable[[float], Awaitable[None]],
    *,
    mark: str,
) -> None:
    """``to`` hears of every new value between ``low`` and ``high``."""
    with ui.element("div").classes("asked"):
        ui.label(label).classes("label")
        slider = (
            ui.slider(min=low, max=high, step=step, value=value)
            .props(f"data-name='slider-{mark}'")
            .props(f"aria-label='{mark}'")
        )
        number = ui.number(value=_short(value), format="%.6g").props("dense outlined hide-bottom-space debounce=400")
        number.props(f"data-name='number-{mark}'").props(f"aria-label='{mark} number'")

    async def slid(event: Any) -> None:
        number.set_value(_short(float(event.args)))
        await to(float(event.args))

    async def typed(event: Any) -> None:
        if event.args in (None, ""):
            return
        try:
            wanted = min(max(float(event.args), low), high)
        except ValueError:
            return
        slider.set_value(wanted)
        await to(wanted)

    slider.on("update:model-value", slid, throttle=OFTEN, leading_events=False)
    number.on("update:model-value", typed)


def _short(value: float) -> float:
    return float(f"{value:.4g}")
