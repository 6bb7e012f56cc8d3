"""What 5 % in tension or in Young's modulus does to M2 and M3: ``python -m studies.sensitivity``.

M2 is the slow start of a slack belt, M3 its rate once it moves (docs/open_question.md). Lambda ~ E/sigma^3 drives both.
Bands are the extremes of the hanging strip with its bending layer over +-5 % of the one and of the other.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from belt_sim.case import Case
from belt_sim.model import analytic_model
from belt_sim.settings import case_from
from belt_sim.show import style
from belt_sim.show.style import CYCLE, INK
from belt_sim.units import MM, MM_PER_M
from studies.application import application

READ = ((10.0, 15.0), (15.0, 25.0))  # [m] of travel over which a record of 15 to 25 m is read


@dataclass(frozen=True)
class YawResponse:
    """A belt after its yaw step: travel (n,) [m], y of point 1 (n,) [m], late: rate in closed form [m/m]."""

    travel: np.ndarray
    y: np.ndarray
    late: float

    def slope(self, begin: float, end: float) -> float:
        """Mean dy/ds between two places [m/m]."""
        return float(np.interp(end, self.travel, self.y) - np.interp(begin, self.travel, self.y)) / (end - begin)

    @property
    def figures(self) -> np.ndarray:
        """y_1 at 1 and 3 m [m], rates read over READ and the late rate [m/m], shape (5,)."""
        starts = [float(np.interp(s, self.travel, self.y)) for s in (1.0, 3.0)]
        return np.array([*starts, *(self.slope(*places) for places in READ), self.late])


def yaw_response(case: Case, model: str, travel: float) -> YawResponse:
    """The case run by an analytic model."""
    engine = analytic_model(model)
    curves = engine.run(case, travel=travel)
    return YawResponse(np.asarray(curves.travel), np.asarray(curves.y)[0], engine.steady_rate(case))


def band(case: Case, model: str, travel: float, share: float, what: str) -> tuple[YawResponse, YawResponse]:
    """The case with ``what`` ("tension" or "modulus") lower and higher by ``share``."""
    low, high = (yaw_response(_scale(case, what, 1 + sign * share), model, travel) for sign in (-1, 1))
    return low, high


def _scale(case: Case, what: str, factor: float) -> Case:
    if what == "tension":
        return replace(case, settings=replace(case.settings, tension=case.settings.tension * factor))
    return replace(case, belt=replace(case.belt, youngs_modulus=case.belt.youngs_modulus * factor))


def sensitivity(config: dict[str, Any]) -> None:
    """Table and picture."""
    names = ("y_1 at 1 m", "y_1 at 3 m", "rate read over 10-15 m", "over 15-25 m", "late rate")
    title = f"changes in % by -{100 * config['share']:g} / +{100 * config['share']:g} %; mm and mm/m"
    table = Table("N/mm2", "of", *names, title=title)
    curves = {}
    for tension in config["tensions"]:
        case = case_from(config | {"tension": tension})
        middle = yaw_response(case, config["base"], config["travel"])
        table.add_row(f"{tension:g}", "", *(f"{v / MM:.4f}" for v in middle.figures))
        for what in ("tension", "modulus"):
            pair = band(case, config["base"], config["travel"], config["share"], what)
            change = [100 * (m.figures / middle.figures - 1) for m in pair]
            table.add_row("", what, *(f"{a:+.1f} / {b:+.1f}" for a, b in zip(*change, strict=True)))
            curves[tension, what] = pair
        curves[tension, ""] = (middle, middle)
    Console(width=130).print(table)
    if config["picture"]:
        rates = {t: _rates(config, t) for t in np.geomspace(5.0, 60.0, 23)}
        print(picture(config["picture"], curves, rates, config["share"]))


def _rates(config: dict[str, Any], tension: float) -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Rates read over READ and late [m/m]: lowest, middle, highest, by what is uncertain."""
    case = case_from(config | {"tension": float(tension)})
    middle = yaw_response(case, config["base"], READ[-1][1]).figures[2:]
    rates = {}
    for what in ("tension", "modulus"):
        both = np.array([m.figures[2:] for m in band(case, config["base"], READ[-1][1], config["share"], what)])
        rates[what] = (np.minimum(both.min(axis=0), middle), middle, np.maximum(both.max(axis=0), middle))
    return rates


@style.picture
def picture(path: str | Path, curves: dict[Any, Any], rates: dict[float, Any], share: float) -> Path:
    """M2: point 1 over the first metres; M3: rates over tension; bands of tension (wide) and modulus (lines)."""
    fig, [[start, rate]] = style.figure(11.0, 4.6, 1, 2)
    tensions = sorted({t for t, _ in curves})
    for colour, tension in zip(CYCLE, tensions, strict=False):
        low, high = curves[tension, "tension"]
        start.fill_between(low.travel, low.y / MM, high.y / MM, color=colour, alpha=0.3, linewidth=0)
        for edge in curves[tension, "modulus"]:
            start.plot(edge.travel, edge.y / MM, "--", color=colour, linewidth=0.8)
        middle = curves[tension, ""][0]
        start.plot(middle.travel, middle.y / MM, color=colour, label=f"{tension:g} N/mm$^2$")
    start.set(xlabel="belt travel [m]", ylabel="y of point 1 [mm]", xlim=(0, 15), title="M2: the start")
    start.set_ylim(min(float(np.interp(15.0, m.travel, m.y)) for p in curves.values() for m in p) / MM, 0.0)
    start.legend()
    at = np.array(list(rates))
    for k, (name, colour) in enumerate(zip(("read over 10-15 m", "read over 15-25 m", "late"), CYCLE, strict=False)):
        low, middle, high = (np.array([rates[t]["tension"][n][k] for t in rates]) / MM_PER_M for n in range(3))
        rate.fill_between(at, -low, -high, color=colour, alpha=0.3, linewidth=0)
        rate.plot(at, -middle, color=colour, label=name)
        for n in (0, 2):
            edge = np.array([rates[t]["modulus"][n][k] for t in rates]) / MM_PER_M
            rate.plot(at, -edge, "--", color=colour, linewidth=0.8)
    rate.axhline(0.0, color=INK, linewidth=0.8)
    rate.set(
        xscale="log", xlabel="tension [N/mm$^2$]", ylabel="rate of point 1, towards -y [mm/m]", title="M3: the rate"
    )
    rate.set_xticks([5, 7, 10, 20, 40, 60], ["5", "7", "10", "20", "40", "60"])
    rate.minorticks_off()
    rate.legend()
    percent = f"{100 * share:g} %"
    style.title(fig, f"±{percent} of tension (bands) and of Young's modulus (dashes)")
    return style.save(fig, path)


if __name__ == "__main__":
    application("sensitivity", sensitivity)
