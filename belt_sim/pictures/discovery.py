"""What was discovered: evidence by place, the unknown against travel and against its variable, the error that falls."""

import os
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.pictures import style
from belt_sim.pictures.style import AFTER, BEFORE, CYCLE, FAINT, INK
from belt_sim.results.discovery import Discovery, UnknownCourse

PLACES = 12  # shown, best first
MM = 1e3
#: unit of u -> factor and unit in which it is drawn
DRAWN = {"rad": (1e6, "µrad"), "m": (1e3, "mm"), "1/m": (1e6, "10⁻⁶/m"), "1": (100.0, "%")}
AXES = {"rad": (1e6, "µrad"), "m": (1e3, "mm"), "1/m": (1e6, "10⁻⁶/m"), "m/s": (1e3, "mm/s"), "1": (1.0, "m")}


@style.picture
def evidence_picture(path: str | os.PathLike[str], d: Discovery) -> Path:
    """A bar a place: log evidence of a smooth unknown there, over none."""
    shown = d.places[:PLACES]
    fig, [[ax]] = style.figure(8.6, 0.36 * len(shown) + 1.6)
    rows = np.arange(len(shown))[::-1]
    gains = [max(p.gain, 0.0) for p in shown]
    ax.barh(rows, gains, height=0.7, color=[AFTER if k == 0 else FAINT for k in range(len(shown))])
    for row, p in zip(rows, shown, strict=True):
        ax.annotate(f"{p.gain:.0f}, {p.pool}", (max(p.gain, 0.0), row), xytext=(4, 0), textcoords="offset points",
                    va="center")  # fmt: skip
    ax.set_yticks(rows, [p.words for p in shown])
    ax.set(xlabel="gain in log evidence over nothing missing", xlim=(0.0, 1.25 * max([*gains, 1.0])))
    ax.grid(False, axis="y")
    style.title(fig, "Where something is missing")
    return style.save(fig, path)


@style.picture
def unknown_picture(path: str | os.PathLike[str], d: Discovery) -> Path:
    """u against travel, a line a tension (or run) with two sigma about it."""
    factor, unit = DRAWN[d.unit]
    many = len(d.courses) > len(CYCLE)
    fig, [[ax]] = style.figure(8.0, 4.4)
    for k, c in enumerate(d.courses):
        _course(ax, c, factor, CYCLE[k % len(CYCLE)], many)
    ax.axhline(0.0, color=INK, linewidth=0.8)
    ax.set(xlabel="belt travel [m]", ylabel=f"u [{unit}]")
    if not many:
        fig.legend(loc="outside lower center", ncols=min(len(d.courses), 4))
    words = next((p.words for p in d.places if d.law is None or p.words in d.law.place), d.places[0].words)
    style.title(fig, f"What acts on the {words}")
    return style.save(fig, path)


def _course(ax, c: UnknownCourse, factor: float, colour: str, plain: bool) -> None:
    low, high = factor * (c.u - 2.0 * c.sd), factor * (c.u + 2.0 * c.sd)
    ax.fill_between(c.travel, low, high, color=colour, alpha=0.10 if plain else 0.18, linewidth=0)
    ax.plot(c.travel, factor * c.u, color=colour, label=c.label)


@style.picture
def law_picture(path: str | os.PathLike[str], d: Discovery) -> Path:
    """The unknown against the variable that it depends on: points as the data show them, the law as a line."""
    assert d.law is not None
    assert d.curve is not None
    by_travel = d.law.variable_unit == "1" or "yaw" in d.law.variable
    scale, unit = (1.0, "m") if by_travel else AXES[d.law.variable_unit]
    factor, of = DRAWN[d.unit]
    over_yaw = "yaw" in d.law.variable
    factor, of = (1.0, "share of the yaw" if d.unit == "rad" else f"{d.unit} per rad") if over_yaw else (factor, of)
    fig, [[ax]] = style.figure(8.0, 4.6)
    for k, a in enumerate(d.against):
        look: Any = {"linestyle": "none", "marker": "o", "markersize": 3.6, "markeredgewidth": 0.0, "alpha": 0.6}
        label = f"{a.tension / 1e6:g} N/mm²"
        ax.plot(scale * a.x, factor * a.u, color=CYCLE[k % len(CYCLE)], label=label, **look)
    ax.plot(scale * d.curve.x, factor * d.curve.u, color=INK, label="the law")
    name = "belt travel" if by_travel else d.law.variable
    ax.set(xlabel=f"{name} [{unit}]", ylabel=f"u [{of}]")
    fig.legend(loc="outside lower center", ncols=min(len(d.against) + 1, 5))
    style.title(fig, f"The law: {d.law.formula}")
    return style.save(fig, path)


@style.picture
def falling_error_picture(path: str | os.PathLike[str], d: Discovery) -> Path:
    """rms error before and after, on the fitted runs and on every condition when it is held out."""
    assert d.error is not None
    rows = {"fitted runs": d.error.fit, "held out, all": d.error.held_out}
    rows |= {f"held out: {n}".replace("mm2", "mm²"): c for n, c in d.error.by_condition.items()}
    there = {n: c for n, c in rows.items() if c is not None}
    fig, [[ax]] = style.figure(8.0, 0.5 * len(there) + 1.8)
    at = np.arange(len(there))[::-1]
    ax.barh(at + 0.19, [MM * c.before for c in there.values()], height=0.36, color=BEFORE, label="before")
    ax.barh(at - 0.19, [MM * c.after for c in there.values()], height=0.36, color=AFTER, label="with what was found")
    ax.axvline(MM * d.error.noise_floor, color=INK, linewidth=1.2, linestyle=(0, (4, 2)), label="noise alone")
    ax.set_yticks(at, list(there))
    ax.set(xlabel="rms error [mm]")
    ax.grid(False, axis="y")
    fig.legend(loc="outside lower center", ncols=3)
    style.title(fig, "The error, before and after")
    return style.save(fig, path)
