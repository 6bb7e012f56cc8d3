"""Ritzinger's steady rate of a low-tensioned belt: two catenary edge ropes (paper eq. 16-18)."""

import math
from dataclasses import dataclass

from belt_sim.case import Case


@dataclass(frozen=True, kw_only=True)
class RitzingerFormula:
    """A model of the steady rate alone (belt_sim.model.SteadyModel)."""

    name: str = "ritzinger"
    title: str = "Ritzinger's edge ropes"

    def refusal(self, effect) -> str | None:
        """It reads no effects."""
        return f"model {self.name} is a formula for the steady rate and reads no effects"

    def steady_rate(self, case: Case) -> float:
        """Late drift w = dy/ds of all four points [m/m]."""
        return ritzinger_rate(case)


def ritzinger_rate(case: Case) -> float:
    """w_ext = w_Th1 T_requ/T_belt [m/m] (paper eq. 18); the moments are even in yaw, so the sign is w_Th1's.

    The belt's two edges are independent elastic catenaries with half its weight and half its section each. Yawing
    the pulley by beta lengthens one chord by b beta/2 and shortens the other; the difference of their tensions
    makes T_requ (eq. 16), to be compared with the beam's T_belt = 4 E I beta/a (eq. 17).
    """
    rig, belt = case.rig, case.belt
    beta = float(case.settings.yaw.last() - case.settings.yaw_head.last())
    length = float(rig.span_length)
    first_order = length * beta / 3.0 / (2 * length + float(rig.wrap_head + rig.wrap_tail))
    if beta == 0.0:
        return 0.0
    return first_order * required_moment(case, abs(beta)) / (4 * belt.bending_stiffness * abs(beta) / length)


def required_moment(case: Case, beta: float) -> float:
    """T_requ = (F1 - F2) b/2 [N m] for a yaw beta > 0 [rad] (paper eq. 16)."""
    tight, slack = edge_tensions(case, beta)
    return (tight - slack) * case.belt.width / 2.0


def edge_tilt(case: Case, beta: float) -> float:
    """Tilt [rad] at mid-span that the unlike sags q L^2/(8 F1), q L^2/(8 F2) of both edge ropes make over the width."""
    tight, slack = edge_tensions(case, beta)
    weight = float(case.weight_per_length) / 2.0 * float(case.rig.span_length) ** 2
    return weight / 8.0 * (1.0 / slack - 1.0 / tight) / case.belt.width


def edge_tensions(case: Case, beta: float) -> tuple[float, float]:
    """Horizontal tensions F1, F2 [N] of the edge whose chord a yaw beta > 0 [rad] lengthens, and of the other."""
    weight = float(case.weight_per_length) / 2.0
    stiffness = case.belt.youngs_modulus * case.belt.area / 2.0
    force, chord, b = float(case.tension_force) / 2.0, float(case.rig.span_length), case.belt.width
    unstretched = _rope_length(force, chord, weight) / (1.0 + force / stiffness)
    tight = _tension(unstretched, chord + b * beta / 2, weight, stiffness, force)
    slack = _tension(unstretched, chord - b * beta / 2, weight, stiffness, force)
    return tight, slack


def _rope_length(force: float, chord: float, weight: float) -> float:
    """Length of a catenary [m] with horizontal tension ``force`` over ``chord``."""
    c = force / weight
    return 2.0 * c * math.sinh(chord / (2.0 * c))


def _tension(unstretched: float, chord: float, weight: float, stiffness: float, near: float) -> float:
    """Horizontal tension [N] of an elastic catenary of given unstretched length."""
    from scipy.optimize import brentq  # slow to import, and only this model needs it

    def mismatch(force: float) -> float:
        return _rope_length(force, chord, weight) - unstretched * (1.0 + force / stiffness)

    return float(brentq(mismatch, near * 0.02, near * 50.0 + stiffness * 1e-3, xtol=1e-9 * near))
