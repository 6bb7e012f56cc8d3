"""Measured curves with their bands, and the models before and after an effect was added."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from belt_sim.pictures import style
from belt_sim.pictures.colours import AFTER, BEFORE, FAINT, MEASURED
from belt_sim.results.drawings import Panel

COLUMNS = 3
#: [inch] around and between panels; a title stands above each
AROUND = {"left": 0.8, "right": 0.15, "top": 0.75, "bottom": 0.95, "across": 0.85, "down": 0.42}
DOTS = 100  # measured samples shown in one panel


@style.picture
def overlay_picture(
    path: str | os.PathLike,
    panels: Sequence[Panel],
    title: str,
    *,
    names: Mapping[str, str] | None = None,
) -> Path:
    """Small multiples of measured against modelled; names = {"base": ..., "final": ...} for the legend."""
    columns = min(COLUMNS, len(panels))
    rows = -(-len(panels) // columns)
    fig, axes = style.figure(max(4.0 * columns, 6.5), 2.6 * rows + 1.0, rows, columns, layout=None, sharex=True)
    flat = [ax for row in axes for ax in row]
    labels = {"base": "model before", "final": "model after", **(names or {})}
    for ax, panel in zip(flat, panels, strict=False):
        _panel(ax, panel, labels)
    for ax in flat[len(panels) :]:
        ax.set_visible(False)
    for ax in flat[max(0, len(panels) - columns) : len(panels)]:
        ax.set_xlabel("belt travel [m]")
        ax.tick_params(labelbottom=True)
    entries = {}
    for ax in flat[: len(panels)]:
        entries.update(dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True)))
    fig.legend(entries.values(), entries.keys(), loc="lower center", ncols=len(entries))
    style.place(fig, rows, columns, **AROUND)
    style.title(fig, title)
    return style.save(fig, path)


def _panel(ax, panel: Panel, labels: Mapping[str, str]) -> None:
    """One run and signal."""
    centre = panel.base if panel.final is None else panel.final
    ax.fill_between(
        panel.travel,
        centre - panel.band,
        centre + panel.band,
        color=FAINT,
        alpha=0.35,
        linewidth=0,
        label="cannot say",
    )
    dots: dict[str, Any] = {
        "linestyle": "none",
        "marker": "o",
        "markersize": 3.2,
        "markeredgewidth": 0.0,
        "color": MEASURED,
    }
    every = max(1, len(panel.travel) // DOTS)
    ax.plot(panel.travel[::every], panel.measured[::every], label="measured", alpha=0.55, **dots)
    ax.plot(panel.travel, panel.base, color=BEFORE, linestyle=(0, (4, 2)), label=labels["base"])
    if panel.final is not None:
        ax.plot(panel.travel, panel.final, color=AFTER, label=labels["final"])
    ax.set_title(panel.title)
    ax.set_ylabel(f"[{panel.unit}]")
    ax.margins(x=0.02)
