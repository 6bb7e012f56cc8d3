"""Steady drift in closed form: linear spans (physics sheet, section 4) and Ritzinger's edge ropes (paper eq. 16-18)."""

import math
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case
from belt_sim.errors import InputError
from belt_sim.jax_setup import in_float64, jit_float64
from belt_sim.line.spans import Composition, span_responses

LIMPEST = 20.0  # chord over twice the catenary's parameter: such a rope hangs 10^7 chords deep

_responses = jit_float64(span_responses, brief=True)  # uncompiled it takes a second


@in_float64
def runup_weights(case: Case, model: Composition) -> tuple[float, float]:
    """Return w1 of y_u - y_o = L (w0 theta_o + w1 theta_u), w0 + w1 = 1, with kappa = 0 at the run-up [1].

    For the span that runs up the tail pulley, and the one that runs up the head pulley. Rope 1, beam of first order
    2/3, beam of second order Shelton's curvature factor, for both.
    """
    span = model.span(case)
    if span.limp:
        return 1.0, 1.0
    tail, head = _w1(np.asarray(_responses(case, model.built_in, span).runup), span.length)
    return float(tail), float(head)


def _w1(runup, length):
    """Return w1 of both spans, shape (2,), from the rows (2, 5) of their responses at the run-up."""
    ky, _, ku, _, _ = runup.T
    return -ku / (ky * length)


def steady_rate(case: Case, model: Composition) -> float:
    """Return the late drift w = dy/ds of all four points [m/m] for the last yaw of both schedules, without effects.

    w = L (w1 - w0)(beta - beta_h) / (2 L + W_t + W_h), which is the sheet's formula for equal pulleys; w1 - w0 of one
    span and of the other, should they be unlike, count half each.
    """
    return float(_rate(case, sum(runup_weights(case, model)) / 2.0))


def steady_traced(case: Case, model: Composition):
    """Like ``steady_rate``, for use inside jit and vmap."""
    span = model.span(case)
    w1 = 1.0 if span.limp else jnp.mean(_w1(span_responses(case, model.built_in, span).runup, span.length))
    return _rate(case, w1)


def _rate(case: Case, w1):
    rig, settings = case.rig, case.settings
    yaw = settings.yaw.last() - settings.yaw_head.last()
    return rig.span_length * (2 * w1 - 1) * yaw / (2 * rig.span_length + rig.wrap_tail + rig.wrap_head)


@dataclass(frozen=True, kw_only=True)
class RitzingerFormula:
    """Ritzinger's model of the steady rate (a belt_sim.model.SteadyModel): two catenary edge ropes."""

    name: str = "ritzinger"
    title: str = "Ritzinger's edge ropes"

    def refusal(self, effect) -> str | None:
        """Return why it cannot represent an effect: it reads none."""
        return f"model {self.name} is a formula for the steady rate and reads no effects"

    def steady_rate(self, case: Case) -> float:
        """Return the late drift w = dy/ds of all four points [m/m]."""
        return ritzinger_rate(case)


def ritzinger_rate(case: Case) -> float:
    """Return w_ext = w_Th1 T_requ/T_belt [m/m] (paper eq. 18); the moments are even in yaw, so the sign is w_Th1's.

    The belt's two edges are independent elastic catenaries. Yawing the pulley by beta lengthens one chord by b beta/2
    and shortens the other; the difference of their tensions makes T_requ (eq. 16), to be compared with the beam's
    T_belt = 4 E I beta/a (eq. 17).

    The paper says that each rope carries half the weight, and nothing of its force and section. We read: the full
    force and the full section. Then the rate is 1.5 w_Th1/(1 + Lambda/4), which is what the paper says of it: like
    the beam of 2nd order at medium tension, much lower below. With half of both it would be 0.75 w_Th1/(1 + Lambda),
    half of that beam at 40 N/mm2.
    """
    rig, belt = case.rig, case.belt
    if not float(rig.gravity) > 0.0:
        raise InputError("rig.gravity", f"{float(rig.gravity):g}", "m/s2", "Ritzinger's formula compares hanging edges")
    beta = float(case.settings.yaw.last() - case.settings.yaw_head.last())
    length = float(rig.span_length)
    first_order = length * beta / 3.0 / (2 * length + float(rig.wrap_head + rig.wrap_tail))
    if beta == 0.0:
        return 0.0
    return first_order * required_moment(case, abs(beta)) / (4 * belt.bending_stiffness * abs(beta) / length)


def required_moment(case: Case, beta: float) -> float:
    """Return T_requ = (F1 - F2) b/2 [N m] for a yaw beta > 0 [rad] (paper eq. 16)."""
    tight, slack = edge_tensions(case, beta)
    return (tight - slack) * case.belt.width / 2.0


def edge_tensions(case: Case, beta: float) -> tuple[float, float]:
    """Return the horizontal tensions F1, F2 [N] of the edge that a yaw beta > 0 [rad] lengthens, and of the other."""
    weight = float(case.weight_per_length) / 2.0
    stiffness = case.belt.youngs_modulus * case.belt.area
    force, chord, b = float(case.tension_force), float(case.rig.span_length), case.belt.width
    unstretched = _rope_length(force, chord, weight) / (1.0 + force / stiffness)
    tight = _tension(unstretched, chord + b * beta / 2, weight, stiffness, force)
    slack = _tension(unstretched, chord - b * beta / 2, weight, stiffness, force)
    return tight, slack


def _rope_length(force: float, chord: float, weight: float) -> float:
    """Return the length of a catenary [m] with horizontal tension ``force`` over ``chord``."""
    c = force / weight
    if chord / (2.0 * c) > LIMPEST:
        raise InputError("tension", f"{force:g}", "N an edge", f"no rope hangs so over {chord:g} m; raise the tension")
    return 2.0 * c * math.sinh(chord / (2.0 * c))


def _tension(unstretched: float, chord: float, weight: float, stiffness: float, guess: float) -> float:
    """Return the horizontal tension [N] of an elastic catenary of given unstretched length."""
    from scipy.optimize import brentq  # slow to import, and only this model needs it

    def mismatch(force: float) -> float:
        return _rope_length(force, chord, weight) - unstretched * (1.0 + force / stiffness)

    lowest = max(guess * 0.02, chord * weight / (2.0 * LIMPEST))
    highest = guess * 50.0 + stiffness * 1e-3
    if mismatch(lowest) * mismatch(highest) > 0.0:
        remedy = "an edge cannot hang in equilibrium after this yaw; raise the tension or turn the pulley less"
        raise InputError("tension", f"{guess:g}", "N an edge", remedy)
    return float(brentq(mismatch, lowest, highest, xtol=1e-9 * guess))
