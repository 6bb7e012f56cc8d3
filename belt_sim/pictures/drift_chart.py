"""A parameter fitted tension by tension: if the model is right, it does not move."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.pictures import style
from belt_sim.pictures.colours import AFTER, BEFORE, FAINT, INK
from belt_sim.results.drawings import Drift


@style.picture
def drift_chart_picture(path: str | os.PathLike, drifts: Sequence[tuple[Drift, Drift | None]], title: str) -> Path:
    """A plot a parameter: (before, after) the effect was added; after is None if none was."""
    fig, axes = style.figure(4.6 * len(drifts) + 0.6, 4.0, 1, len(drifts))
    for ax, (before, after) in zip(axes[0], drifts, strict=True):
        _drift(ax, before, after)
    entries = dict(zip(*reversed(axes[0][0].get_legend_handles_labels()), strict=True))
    fig.legend(entries.values(), entries.keys(), loc="outside lower center", ncols=len(entries))
    style.title(fig, title)
    return style.save(fig, path)


def _drift(ax, before: Drift, after: Drift | None) -> None:
    """One parameter against tension; bars are +-2 u."""
    if before.stated is not None:
        low, high = before.stated - 2 * before.u_stated, before.stated + 2 * before.u_stated
        ax.axhspan(low, high, color=FAINT, alpha=0.3, linewidth=0)
        ax.axhline(before.stated, color=INK, linewidth=1.0, label="data sheet")
    pairs = [(before, BEFORE, "o", 0.985, "before"), (after, AFTER, "s", 1.015, "after")]
    for drift, colour, marker, aside, label in pairs:
        if drift is not None:
            bars: dict[str, Any] = {
                "fmt": marker,
                "color": colour,
                "capsize": 3.0,
                "markersize": 5.5,
                "elinewidth": 1.4,
            }
            ax.errorbar(np.asarray(drift.tension) * aside, drift.value, 2 * np.asarray(drift.u), label=label, **bars)
    ax.set_xscale("log")
    ticks = np.unique(before.tension)
    ax.set_xticks(ticks, [f"{t:g}" for t in ticks])
    ax.set_xticks([], minor=True)
    unit = f" [{before.unit}]" if before.unit not in ("", "1") else ""
    ax.set(xlabel="tension [N/mm$^2$]", ylabel=f"{before.parameter}{unit}, bars 2u", title=before.parameter)
