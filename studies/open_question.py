"""What could make a slack belt run faster for good (M3): ``python -m studies.open_question``.

Late rates of point 1 by the hanging strip, alone and with each candidate at a stated size, against tension; and the
size at which the candidate would lift the rate at 10 N/mm2 to that at 40. A candidate whose share is the same for both
signs of yaw is told apart by a pair of opposite yaws: half the difference of both rates does not have it.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.optimize import brentq

from belt_sim.analytic.model import AnalyticModel, analytic_model
from belt_sim.case import Case, Schedule
from belt_sim.config import case_from
from belt_sim.curves import late_rates
from belt_sim.effects.base import Effect
from belt_sim.effects.belt_shape import Camber
from belt_sim.effects.contact import LiftOff
from belt_sim.effects.yaw import Cant, YawCompliance
from belt_sim.errors import InputError, SimulationError
from belt_sim.laws.span import sag_softening
from belt_sim.si import MM_PER_M, N_PER_MM2
from studies.application import application

SETTLED = 300.0  # [m]: what is left of the slowest transient, at 7 N/mm2, is below 1 %
SLACK, TIGHT = 10.0, 40.0  # [N/mm2], between which M3 is asked

Rate = Callable[[Case, float], float]  # case, size -> late dy/ds


@dataclass(frozen=True)
class Candidate:
    """Something that may act. size: what the table shows, in ``unit`` (factor to SI: scale); rate: late dy/ds [m/m]."""

    name: str
    size: float
    unit: str
    scale: float
    rate: Rate
    decides: str


def with_effect(model: AnalyticModel, effect: Callable[[float], Effect]) -> Rate:
    """Late rate by a long march with an effect of the given size."""

    def rate(case: Case, size: float) -> float:
        return float(late_rates(model.run(case, (effect(size),), travel=SETTLED), share=0.1)[0])

    return rate


def at_tension(model: AnalyticModel, change: Callable[[Case, float], float]) -> Rate:
    """Late rate at the tension that there is when the display shows that of the case: larger by change(case, size)."""

    def rate(case: Case, size: float) -> float:
        tension = case.settings.tension + change(case, size)
        return model.steady_rate(replace(case, settings=replace(case.settings, tension=tension)))

    return rate


def unlike_spans(model: AnalyticModel) -> Rate:
    """The drive pulls: upper span + size, lower span - size [Pa]; each span's 2 w1 - 1 counts half."""

    def rate(case: Case, size: float) -> float:
        pair = [
            replace(case, settings=replace(case.settings, tension=case.settings.tension + s)) for s in (size, -size)
        ]
        return float(np.mean([model.steady_rate(c) for c in pair]))

    return rate


def held_length(case: Case, pivot: float) -> float:
    """Change of tension [Pa] when the pulley turns about a point ``pivot`` [m] beside its middle at fixed length.

    Both spans grow by yaw x pivot; of the strain Lambda/(1 + Lambda) goes into less sag and not into stress.
    """
    grown = 2.0 * float(case.settings.yaw.last()) * pivot / case.rig.belt_length
    return case.belt.youngs_modulus * grown / (1.0 + sag_softening(case))


def with_supports(model: AnalyticModel) -> Rate:
    """A frictionless support every length / (1 + size) takes the sag: Z/(1 + size) in the strip, the span as it is."""

    def rate(case: Case, size: float) -> float:
        lighter = replace(case, rig=replace(case.rig, gravity=case.rig.gravity / (1.0 + size)))
        return model.steady_rate(lighter)

    return rate


def crossbow(case: Case, height: float) -> float:
    """Strength of the bending layer of a belt that is an arc of ``height`` [m] over its width.

    Its section resists bending like E h b height^2 4/45 besides D b, and l^2 grows in proportion.
    """
    belt = case.belt
    return 1.0 + belt.youngs_modulus * belt.thickness * height**2 * 4 / 45 / float(belt.plate_stiffness)


def candidates(model: AnalyticModel) -> list[Candidate]:
    """All of them, at sizes that a rig may well have."""
    pair = "a pair of opposite yaws: the share stays when the yaw changes its sign"
    lifted = with_effect(model, lambda strength: LiftOff(strength=strength))

    def crossbow_rate(case: Case, height: float) -> float:
        return lifted(case, crossbow(case, height))

    def coil_set_rate(case: Case, curvature: float) -> float:
        return lifted(case, 1.0 - curvature * case.rig.tail_radius)

    return [
        Candidate("camber", 1.0, "1e-5 1/m", -1e-5, with_effect(model, lambda k: Camber(kappa_c=k)), pair),
        Candidate("cant of the tail pulley", 0.1, "mrad", -1e-3, with_effect(model, lambda g: Cant(gamma=g)), pair),
        Candidate("load cell reads too much", 1.0, "N/mm2", -N_PER_MM2, at_tension(model, lambda c, x: x),
                  "sag or natural frequency beside the load cell at each tension"),
        Candidate("yaw about a pivot, fixed length", 0.2, "m", 1.0, at_tension(model, held_length),
                  "the load cell before and after the yaw; either sign"),
        Candidate("drive pull, upper + lower -", 1.0, "N/mm2", N_PER_MM2, unlike_spans(model),
                  "both sags while it runs, and a run driven backwards"),
        Candidate("yaw compliance", 1.0, "urad/(N m)", 1e-6, with_effect(model, lambda c: YawCompliance(c_m=c)),
                  "a dial gauge on the axle during the yaw at 40 N/mm2"),
        Candidate("coil set towards the pulley", 1.0, "1/m", 1.0, coil_set_rate, "turn the belt over"),
        Candidate("crossbow", 1.0, "mm", 1e-3, crossbow_rate,
                  "a straight edge across the hanging belt; turn the belt over"),
        Candidate("one support a span", 1.0, "supports", 1.0, with_supports(model), "take the supports away"),
    ]  # fmt: skip


def size_needed(c: Candidate, cases: dict[float, Case]) -> float | None:
    """Size in the candidate's unit at which the slack belt is as fast as the tight one; None: not below 100 sizes."""

    def short(size: float) -> float:
        return abs(c.rate(cases[TIGHT], size * c.scale)) - abs(c.rate(cases[SLACK], size * c.scale))

    reach = [c.size * k for k in (1, 2, 4, 8, 16, 32, 64)]
    for low, high in zip([0.0, *reach], reach, strict=False):
        try:
            if short(high) <= 0.0:
                return float(brentq(short, low, high, rtol=1e-2)) if low else high
        except (InputError, SimulationError):  # so large that the law has no answer
            return None
    return None


def open_question(config: dict[str, Any]) -> None:
    """The table."""
    model = analytic_model(config["base"])
    tensions = [*config["tensions"]]
    cases = {t: case_from(config | {"tension": t}) for t in tensions}
    plain = {t: model.steady_rate(c) for t, c in cases.items()}
    table = Table("candidate", "of", *(f"{t:g}" for t in tensions), "sign of yaw", "10 as fast as 40 at", "decided by")
    table.add_row("the strip alone", "", *(f"{plain[t] / MM_PER_M:+.4f}" for t in tensions), "turns", "", "")
    for c in candidates(model):
        change = {t: (c.rate(case, c.size * c.scale) - c.rate(case, 0.0)) / MM_PER_M for t, case in cases.items()}
        back = replace(cases[SLACK], settings=replace(cases[SLACK].settings, yaw=_opposite(cases[SLACK])))
        other = (c.rate(back, c.size * c.scale) - c.rate(back, 0.0)) / MM_PER_M
        parity = "turns" if np.isclose(other, -change[SLACK], rtol=0.2) else "stays"
        size = size_needed(c, cases) if config["sizes"] else None
        reached = "–" if size is None else f"{size:.2g} {c.unit}"
        cells = [f"{change[t]:+.4f}" for t in tensions]
        table.add_row(c.name, f"{c.size:g} {c.unit}", *cells, parity, reached, c.decides)
    Console(width=190).print(table)


def _opposite(case: Case) -> Schedule:
    return Schedule.step(-float(case.settings.yaw.last()))


if __name__ == "__main__":
    application("open_question", open_question)
