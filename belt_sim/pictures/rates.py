"""Late rate of the lateral movement against tension, for several models (as in Fig. 13 of the paper)."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim import si
from belt_sim.pictures import style
from belt_sim.pictures.colours import CYCLE, MEASURED
from belt_sim.results.errors import SteadyError


@dataclass(frozen=True, kw_only=True)
class Rates:
    """Late rate [mm per m of travel] at each ``tension`` [N/mm2], both shape (t,); u: one sigma, if known."""

    tension: np.ndarray
    rate: np.ndarray
    u: np.ndarray | None = None


@style.picture
def rates_picture(
    path: str | os.PathLike,
    models: Mapping[str, Rates],
    title: str,
    measured: Rates | None = None,
    note: str = "",
) -> Path:
    """Draw late rates against tension: a line a model, named at its end; measured rates as dots with bars of 2u."""
    fig, [[ax]] = style.figure(8.4, 4.8)
    ends = []
    for k, (name, rates) in enumerate(models.items()):
        colour = CYCLE[k % len(CYCLE)]
        ax.plot(rates.tension, rates.rate, color=colour)
        ends.append((float(rates.rate[-1]), name, colour))
    if measured is not None:
        bars = None if measured.u is None else 2 * np.asarray(measured.u)
        dots: dict[str, Any] = {
            "fmt": "o",
            "color": MEASURED,
            "capsize": 3.0,
            "markersize": 5.5,
            "label": "measured",
        }
        ax.errorbar(measured.tension, measured.rate, bars, **dots)
        ax.legend(loc="best")
    last = max(float(r.tension[-1]) for r in models.values())
    ax.set_ylim(bottom=min(0.0, ax.get_ylim()[0]))
    low, high = ax.get_ylim()
    for at, (_, name, colour) in zip(_apart(ends, 0.055 * (high - low)), sorted(ends), strict=True):
        ax.annotate(name, (last, at), xytext=(6, 0), textcoords="offset points", color=colour, va="center")
    ax.margins(x=0.0)
    ax.set(xlabel="tension [N/mm$^2$]", ylabel="late rate dy/ds [mm per m of travel]")
    if note:
        ax.set_title(note, fontsize=style.FONT, fontweight="normal")
    style.title(fig, title)
    return style.save(fig, path)


def _apart(ends: list[tuple[float, str, str]], gap: float) -> list[float]:
    """Heights of the names, in rising order, at least ``gap`` from each other and near their lines."""
    heights: list[float] = []
    for height, _, _ in sorted(ends):
        heights.append(max(height, heights[-1] + gap) if heights else height)
    return heights


def steady_picture(path: str | os.PathLike | None, rows: Sequence[SteadyError], name: str, title: str) -> Path:
    """Draw measured and modelled late rates of the first measured point of a campaign; name: of the model."""
    point = min(r.point for r in rows)
    mine = sorted((r for r in rows if r.point == point), key=lambda r: r.tension)
    tension = np.array([r.tension for r in mine]) / si.N_PER_MM2
    modelled, measured, u = np.array([(r.modelled, r.measured, r.u) for r in mine]).T / si.MM_PER_M
    shown = {name: Rates(tension=tension, rate=modelled)}
    return rates_picture(path, shown, title, measured=Rates(tension=tension, rate=measured, u=u))
