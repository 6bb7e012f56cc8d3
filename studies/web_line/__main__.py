"""The span law and the wrap delay on a real web line: ``python -m studies.web_line``. No validation of an endless belt.

An open web runs over rollers (digitised.csv: plots of merlin-gogolin/2c_final_project at ea75723, read off by this
project; figures and dimensions quoted from there). A chain of spans and wraps gives each sensor from the one before
it. Per metre of travel, p = d/ds, with the run-up law p y = -alpha, p alpha = -kappa, the wrap law y_o = y e^(-p w),
alpha_o = alpha e^(-p w), and the curvature kappa = c0 (y - y_o) + c1 alpha_o + c2 alpha of the span law:

    y / y_o = (-c0 - c1 p) / (p^2 - c0 + c2 p).

Two unknowns for all records: the share f of the stated speed at which the web runs, and the travel w on a roller.
The source passed y4 and y5 through its own beam model without wraps before it drew them, which is undone here.
``document=FILE.md`` and ``picture=FILE.png`` write what docs/web_line.md shows.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import least_squares

from belt_sim.io import write_text
from belt_sim.line.span import Span, response
from belt_sim.show import style
from studies.application import application

WIDTH, THICKNESS, MODULUS, FORCE = 0.166, 0.2e-3, 3.5e9, 100.0  # [m], [m], [Pa], [N], as the source states
SPEED = 1.125  # [m/s], as stated
BENDING = MODULUS * WIDTH**3 * THICKNESS / 12.0  # [N m2]
STEP = 0.1  # [s] of the common time grid
PADDING = 600  # points before and after a record, so that the filter does not wrap round
EDGE = 10.0  # [s] left out at both ends of a record
DATA = Path(__file__).with_name("digitised.csv")


@dataclass(frozen=True)
class Section:
    """From one sensor to the next: signals, spans [m], wraps passed, and spans of the source's own beam to undo or add.

    sag: lag over the section by the source's identified model or by its plots [s] (docs/web_line.md).
    """

    name: str
    source: str
    target: str
    spans: tuple[float, ...]
    wraps: int
    undone: tuple[float, ...] = ()
    added: tuple[float, ...] = ()


SECTIONS = (
    Section("R4 to R5", "y4_after_beam", "y5", (0.491,), 1, undone=(0.491,)),
    Section("R5 to R7", "y5_after_beam", "y7", (0.237, 0.282), 2, undone=(0.237, 0.282)),
    Section("R1 to R4", "y1", "y4_after_beam", (0.378, 1.593, 2.161), 3, added=(0.491,)),
)
RUNS = (28, 29)
STEPS = {28: (60, 120, 240, 345, 440), 29: (60, 105, 190, 270, 350)}  # [s] that bound the four steps of each run


@cache
def curvature(length: float) -> np.ndarray:
    """c0 [1/m2], c1, c2 [1/m] of a span: curvature at its run-up per y - y_o, alpha_o and alpha (span law)."""
    span = Span(length=length, force=FORCE, bending=BENDING, torsion=1.0, sag_curvature=0.0)
    return np.asarray(response(span).runup, dtype=float)[:3]


def over_span(length: float, p: np.ndarray) -> np.ndarray:
    """y at the run-up of a span per y at its run-off, at the complex rates p [1/m]."""
    c0, c1, c2 = curvature(length)
    return (-c0 - c1 * p) / (p**2 - c0 + c2 * p)


def predict(section: Section, y: np.ndarray, speed: float, wrap: float) -> np.ndarray:
    """Reading [mm] at the section's end from that at its beginning, on a grid of STEP.

    speed: share f of the stated speed; wrap: travel w on each roller [m]. The trend between both ends of the record is
    filtered apart, by its delay alone.
    """
    ends = np.full(PADDING, y[:20].mean()), np.full(PADDING, y[-20:].mean())
    padded = np.concatenate([ends[0], y, ends[1]])
    trend = np.linspace(padded[0], padded[-1], len(padded))
    rate = 2j * np.pi * np.fft.rfftfreq(len(padded), STEP)  # [1/s]
    p, stated = rate / (speed * SPEED), rate / SPEED
    gain = np.exp(-p * section.wraps * wrap)
    for length in section.spans:
        gain = gain * over_span(length, p)
    for length in section.undone:
        gain = gain / over_span(length, stated)
    for length in section.added:
        gain = gain * over_span(length, stated)
    lag = lag_of(section, speed, wrap) - (sum(section.undone) - sum(section.added)) / SPEED
    moved = np.fft.irfft(np.fft.rfft(padded - trend) * gain, len(padded)) + trend - lag * (trend[1] - trend[0]) / STEP
    return moved[PADDING:-PADDING]


def lag_of(section: Section, speed: float, wrap: float) -> float:
    """Lag of slow changes over a section [s]: any span without slip takes L/v, whatever its stiffness, a wrap w/v."""
    return (sum(section.spans) + section.wraps * wrap) / (speed * SPEED)


@cache
def digitised() -> pd.DataFrame:
    """Columns run, signal, t_s, y_mm."""
    return pd.read_csv(DATA)


@cache
def record(run: int, section: Section) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time [s], readings at the section's beginning and end [mm]."""
    table = digitised()[digitised().run == run]
    first, last = (table[table.signal == name] for name in (section.source, section.target))
    begin, end = max(first.t_s.min(), last.t_s.min()), min(first.t_s.max(), last.t_s.max())
    time = np.arange(begin, end, STEP)
    return time, np.interp(time, first.t_s, first.y_mm), np.interp(time, last.t_s, last.y_mm)


def residual(run: int, section: Section, speed: float, wrap: float) -> np.ndarray:
    """Readings less prediction [mm], the zero between both sensors of the run taken off, EDGE left out."""
    time, source, target = record(run, section)
    inside = (time > time[0] + EDGE) & (time < time[-1] - EDGE)
    rest = (target - predict(section, source, speed, wrap))[inside]
    return rest - rest.mean()


def step_mask(run: int, section: Section, left_out: int | None) -> np.ndarray:
    """Which readings count: all, or all but those about one of the run's four steps."""
    time, _, _ = record(run, section)
    time = time[(time > time[0] + EDGE) & (time < time[-1] - EDGE)]
    if left_out is None:
        return np.ones(len(time), bool)
    low, high = STEPS[run][left_out], STEPS[run][left_out + 1]
    return (time < low) | (time > high)


def fit(
    sections: tuple[Section, ...], free: tuple[bool, bool] = (True, True), without: tuple[int, int] | None = None
) -> np.ndarray:
    """Least-squares f and w over both runs; a number that is not free stays at 1 and 0.

    without: a run and one of its steps that are left out.
    """

    def rest(values: np.ndarray) -> np.ndarray:
        found = np.array([1.0, 0.0])
        found[list(free)] = values
        parts = []
        for run in RUNS:
            for section in sections:
                step = without[1] if without and without[0] == run else None
                parts.append(residual(run, section, *found)[step_mask(run, section, step)])
        return np.concatenate(parts)

    start, low = np.array([0.9, 0.2])[list(free)], np.array([0.3, -0.5])[list(free)]
    best = least_squares(rest, start, bounds=(low, np.array([2.0, 1.5])[list(free)])).x
    found = np.array([1.0, 0.0])
    found[list(free)] = best
    return found


def jackknife(sections: tuple[Section, ...], free: tuple[bool, bool]) -> tuple[np.ndarray, np.ndarray]:
    """f and w, and their standard errors by leaving out each of the eight steps."""
    each = np.array([fit(sections, free, (run, k)) for run in RUNS for k in range(4)])
    count = len(each)
    return fit(sections, free), np.sqrt((count - 1) / count * ((each - each.mean(axis=0)) ** 2).sum(axis=0))


def explained(run: int, section: Section, speed: float, wrap: float) -> float:
    """Fit in percent, 100 (1 - |residual| / |readings - mean|), as the source prints it."""
    time, _, target = record(run, section)
    inside = (time > time[0] + EDGE) & (time < time[-1] - EDGE)
    spread = target[inside] - target[inside].mean()
    return float(100.0 * (1.0 - np.linalg.norm(residual(run, section, speed, wrap)) / np.linalg.norm(spread)))


SHORT, ALL = SECTIONS[:2], SECTIONS
HYPOTHESES: Mapping[str, tuple[tuple[Section, ...], tuple[bool, bool]]] = {
    "spans only, as stated": (SHORT, (False, False)),
    "wraps": (SHORT, (False, True)),
    "another speed": (SHORT, (True, False)),
    "wraps and another speed": (SHORT, (True, True)),
    "wraps and another speed, R1 to R4 too": (ALL, (True, True)),
}


def table() -> tuple[str, dict[str, np.ndarray]]:
    """The hypotheses: numbers with standard errors, lag and fit of each section; and the numbers themselves."""
    lines = ["| | f | w m | " + " | ".join(f"{s.name}: lag s, fit %" for s in SECTIONS) + " |", "|" + " --- |" * 6]
    found = {}
    for name, (sections, free) in HYPOTHESES.items():
        values, u = (np.array([1.0, 0.0]), np.zeros(2)) if not any(free) else jackknife(sections, free)
        found[name] = values
        numbers = [
            f"{v:.2f} +- {e:.2f}" if is_free else f"{v:g}" for v, e, is_free in zip(values, u, free, strict=True)
        ]
        cells = [
            f"{lag_of(s, *values):.2f}, " + " and ".join(f"{explained(run, s, *values):.1f}" for run in RUNS)
            for s in SECTIONS
        ]
        lines.append("| " + " | ".join([name, *numbers, *cells]) + " |")
    return "\n".join(lines), found


def web_line(config: dict[str, Any]) -> None:
    """Print or write the table, and draw the picture."""
    text, found = table()
    if config["document"]:
        print(write_text(Path(config["document"]), text + "\n"))
    else:
        print(text)
    if config["picture"]:
        print(draw(Path(config["picture"]), found))


@style.picture
def draw(path: Path, found: Mapping[str, np.ndarray]) -> Path:
    """One step at each section's end: measured, spans only, and with wraps."""
    fig, axes = style.figure(11.0, 3.6, columns=3)
    for ax, section, window in zip(axes, SECTIONS, ((64, 82), (64, 84), (62, 84)), strict=True):
        time, source, target = record(28, section)
        shown = (time > window[0]) & (time < window[1])
        ax.plot(time[shown], target[shown], color=style.INK, lw=2.0, label="measured")
        for name, colour in (("spans only, as stated", style.RED), ("wraps", style.BLUE)):
            y = predict(section, source, *found[name])
            y = y + (target - y).mean()
            ax.plot(time[shown], y[shown], color=colour, lw=1.4, label=name)
        ax.set(title=f"{section.name}, run 28", xlabel="time [s]")
    axes[0].set_ylabel("lateral position [mm]")
    axes[0].legend(loc="lower right")
    return style.save(fig, path)


if __name__ == "__main__":
    application("web_line", web_line)
