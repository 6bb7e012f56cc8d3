"""Judge the paper's statements M2, M3, M4 and M6 together, over all places where rates may have been read.

``python -m studies.reading_windows`` runs the hanging strip alone and with each candidate and prints a row for each:
M2 from the start, M3 and M4 at the steady rate, the share of reading windows in which M3 and M4 hold in one window,
and M6. A window is a piece of travel over which a rate is read as a mean slope. The paper does not say which one its
authors used. The criteria are those of studies/paper/statements.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from belt_sim.analytic.model import AnalyticModel, analytic_model
from belt_sim.case import Case
from belt_sim.config import case_from
from belt_sim.curves import late_rates
from belt_sim.effects.base import Effect
from belt_sim.effects.belt_shape import Camber
from belt_sim.effects.contact import LiftOff
from belt_sim.effects.span_stiffness import Flatness
from belt_sim.pictures import style
from belt_sim.pictures.style import CYCLE, INK
from belt_sim.si import N_PER_MM2
from studies.application import application

TENSIONS = (7.0, 10.0, 20.0, 40.0)  # [N/mm2], at which the paper measured
SLACK, MIDDLE, TIGHT = TENSIONS[:2], 20.0, 40.0
START, SLOWER = 3.0, 0.9  # M2: y_1 after so many m, over that at 40, is at most this share of the beam's ratio
A_LOT = 1.2  # M3: rate over that at 40
QUITE = 0.2  # M4: of the rate of the beam of 2nd order
OUTSIDE = 0.01  # M6: of the rope's largest y
LATE = 0.2  # of the travel: where the steady rate is read
DRAWN = ("strip alone", "long edges, 8 N/mm2", "camber, 2e-05 1/m", "load cell +3 N/mm2")
STEP, SHORTEST, LONGEST = 0.5, 2.0, 20.0  # [m]: of windows

Change = Callable[[Case], tuple[Case, tuple[Any, ...]]]  # the case as it really is, and the effects that act


@dataclass(frozen=True)
class Record:
    """Point 1 at the four tensions. y {tension: (n,)} over a grid of STEP [m], towards where the yaw drives it;
    rate {tension: steady rate [m/m]}."""

    y: dict[float, np.ndarray]
    rate: dict[float, float]

    def slope(self, tension: float, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Mean slopes over windows given by their first and last place on the grid."""
        return (self.y[tension][end] - self.y[tension][begin]) / (STEP * (end - begin))


def candidates() -> dict[str, Change]:
    """The explanations, each at a size that a rig may have."""

    def tension(case: Case, change: float) -> Case:
        return replace(case, settings=replace(case.settings, tension=case.settings.tension + change * N_PER_MM2))

    def acting(effect: Effect) -> Change:
        return lambda case: (case, (effect,))

    found: dict[str, Change] = {"strip alone": lambda case: (case, ())}
    for residual in (4.0, 6.0, 8.0):
        found[f"long edges, {residual:g} N/mm2"] = acting(Flatness(amplitude=residual * N_PER_MM2))
    found["long middle, 10 N/mm2"] = acting(Flatness(amplitude=-10.0 * N_PER_MM2))
    for curvature in (1e-5, 2e-5, 3e-5):
        found[f"camber, {curvature:g} 1/m"] = acting(Camber(kappa_c=-curvature))
    found["load cell +3 N/mm2"] = lambda case: (tension(case, -3.0), ())
    found["load cell -3 N/mm2"] = lambda case: (tension(case, 3.0), ())
    found["bending layer"] = acting(LiftOff())
    return found


def record(model: AnalyticModel, cases: dict[float, Case], change: Change, travel: float) -> Record:
    """All four tensions with a candidate."""
    grid, y, rate = np.arange(0.0, travel + 0.5 * STEP, STEP), {}, {}
    for tension, case in cases.items():
        real, effects = change(case)
        curves = model.run(real, effects, travel=travel)
        towards = np.sign(float(case.settings.yaw.last()))
        y[tension] = towards * np.interp(grid, np.asarray(curves.travel), np.asarray(curves.y)[0])
        rate[tension] = towards * float(late_rates(curves, share=LATE)[0])
    return Record(y, rate)


def windows(length: float, places: int) -> tuple[np.ndarray, np.ndarray]:
    """First and last places on the grid of every window that ends by ``length`` [m]."""
    last = min(places - 1, round(length / STEP))
    begin, end = np.triu_indices(last + 1, k=round(SHORTEST / STEP))
    short = end - begin <= round(LONGEST / STEP)
    return begin[short], end[short]


def judge(own: Record, beam: Record, rope: np.ndarray, first: np.ndarray, length: float) -> dict[str, Any]:
    """M2 (two numbers), M3, M4 at the steady rate, shares of windows with M3, with M3 and M4, and M6."""
    at = round(START / STEP)
    start = [(own.y[t][at] / own.y[TIGHT][at]) / (beam.y[t][at] / beam.y[TIGHT][at]) for t in SLACK]
    steady = [own.rate[t] / own.rate[TIGHT] for t in SLACK]
    off = [own.rate[t] / beam.rate[t] - 1.0 for t in (MIDDLE, TIGHT)]
    begin, end = windows(length, len(rope))
    slopes = {t: own.slope(t, begin, end) for t in TENSIONS}
    fast = (slopes[TIGHT] > 0) & np.all([slopes[t] >= A_LOT * slopes[TIGHT] for t in SLACK], axis=0)
    like = np.all([abs(slopes[t] / beam.slope(t, begin, end) - 1) <= QUITE for t in (MIDDLE, TIGHT)], axis=0)
    like_steady = np.all([abs(slopes[t] / beam.rate[t] - 1) <= QUITE for t in (MIDDLE, TIGHT)], axis=0)
    outside = max(max((y - rope).max(), (first - y).max(), 0.0) for y in own.y.values()) / rope.max()
    return {
        "M2": start, "M3": steady, "M4": off, "M3 read": float(fast.mean()),
        "both, same window": float((fast & like).mean()), "both, steady beam": float((fast & like_steady).mean()),
        "M6": outside, "slopes": slopes, "windows": (begin, end),
    }  # fmt: skip


def reading_windows(config: dict[str, Any]) -> None:
    """Table and picture."""
    cases = {t: case_from(config | {"tension": t}) for t in TENSIONS}
    travel, length, strip = float(config["travel"]), float(config["length"]), analytic_model("strip")
    by_beam = {n: record(analytic_model(n), cases, lambda c: (c, ()), travel) for n in ("rope", "beam_th1", "beam_th2")}
    beam, rope, first = by_beam["beam_th2"], by_beam["rope"].y[TIGHT], by_beam["beam_th1"].y[TIGHT]
    title = f"windows of {SHORTEST:g} to {LONGEST:g} m that end by {length:g} m; bold: the statement holds"
    table = Table("candidate", "M2 7, 10", "M3 steady", "M4 20, 40 %", "M3 in windows", "with M4, same window",
                  "with M4, steady beam", "M6 outside %", title=title)  # fmt: skip
    found = {}
    for name, change in candidates().items():
        j = judge(record(strip, cases, change, travel), beam, rope, first, length)
        found[name] = j
        table.add_row(
            name,
            _bold(" ".join(f"{v:.2f}" for v in j["M2"]), max(j["M2"]) <= SLOWER),
            _bold(" ".join(f"{v:.2f}" for v in j["M3"]), min(j["M3"]) >= A_LOT),
            _bold(" ".join(f"{100 * v:+.0f}" for v in j["M4"]), max(map(abs, j["M4"])) <= QUITE),
            *(f"{100 * j[k]:.1f} %" for k in ("M3 read", "both, same window", "both, steady beam")),
            _bold(f"{100 * j['M6']:.0f}", j["M6"] <= OUTSIDE),
        )
    Console(width=150).print(table)
    if config["picture"]:
        draw(found, Path(config["picture"]))


def _bold(text: str, holds: bool) -> str:
    return f"[bold]{text}[/bold]" if holds else text


@style.picture
def draw(found: dict[str, Any], path: Path) -> Path:
    """Rates at 7 and 10 over that at 40 N/mm2, read over windows of 5 m, against where the window ends."""
    fig, [axes] = style.figure(9.5, 4.0, columns=len(SLACK), sharey=True)
    for ax, tension in zip(axes, SLACK, strict=True):
        for colour, (name, j) in zip(CYCLE, [(n, found[n]) for n in DRAWN], strict=False):
            begin, end = j["windows"]
            some = end - begin == round(5.0 / STEP)
            order = np.argsort(end[some])
            ratio = (j["slopes"][tension] / j["slopes"][TIGHT])[some][order]
            ax.plot(STEP * end[some][order], ratio, color=colour, label=name)
        ax.axhline(A_LOT, color=INK, lw=1.0, ls=":")
        ax.set(title=f"Rate at {tension:g} over that at 40 N/mm2", xlabel="end of a window of 5 m [m]", ylim=(-1, 6))
    axes[0].set_ylabel("ratio of rates")
    axes[1].legend(loc="upper right")
    return style.save(fig, path)


if __name__ == "__main__":
    application("reading_windows", reading_windows)
