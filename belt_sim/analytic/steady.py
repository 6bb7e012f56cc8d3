"""Steady drift in closed form (physics sheet, section 4)."""

import jax.numpy as jnp
import numpy as np

from belt_sim.analytic.composition import Composition
from belt_sim.analytic.spans import held_answers
from belt_sim.case import Case
from belt_sim.jax_setup import compiled, in_float64

_answers = compiled(held_answers)  # op by op it would take a second


@in_float64
def runup_weights(case: Case, model: Composition) -> tuple[float, float]:
    """w1 of y_u - y_o = L (w0 theta_o + w1 theta_u), w0 + w1 = 1, with kappa = 0 at the run-up [1].

    For the span that runs up the tail pulley, and the one that runs up the head pulley. Rope 1, beam of first order
    2/3, beam of second order Shelton's curvature factor, for both.
    """
    span = model.span(case)
    if span.limp:
        return 1.0, 1.0
    tail, head = _w1(np.asarray(_answers(case, model.built_in, span).runup), span.length)
    return float(tail), float(head)


def _w1(runup, length):
    """w1 of both spans, shape (2,), from the rows (2, 5) of their answers at the run-up."""
    ky, _, ku, _, _ = runup.T
    return -ku / (ky * length)


def steady_rate(case: Case, model: Composition) -> float:
    """Late drift w = dy/ds of all four points [m/m] for the last yaw of both schedules, without effects.

    w = L (w1 - w0)(beta - beta_h) / (2 L + W_t + W_h), which is the sheet's formula for equal pulleys; w1 - w0 of one
    span and of the other, should they be unlike, count half each.
    """
    return float(_rate(case, sum(runup_weights(case, model)) / 2.0))


def steady_traced(case: Case, model: Composition):
    """The same for use inside jit and vmap."""
    span = model.span(case)
    w1 = 1.0 if span.limp else jnp.mean(_w1(held_answers(case, model.built_in, span).runup, span.length))
    return _rate(case, w1)


def _rate(case: Case, w1):
    rig, settings = case.rig, case.settings
    yaw = settings.yaw.last() - settings.yaw_head.last()
    return rig.span_length * (2 * w1 - 1) * yaw / (2 * rig.span_length + rig.wrap_tail + rig.wrap_head)


def steady_offsets(case: Case, model: Composition) -> tuple[float, float]:
    """Steady offsets of the belt in the direction of travel, run-up minus run-off [m]: upper span, lower span.

    y_1 - y_4 = L (w1 beta + w0 beta_h - w), y_3 - y_2 = L (-w1 beta_h - w0 beta - w), for travel direction +1.
    """
    w, (up, low), length = steady_rate(case, model), runup_weights(case, model), case.rig.span_length
    tail, head = float(case.settings.yaw.last()), float(case.settings.yaw_head.last())
    return length * (up * tail + (1 - up) * head - w), length * (-low * head - (1 - low) * tail - w)


def shelton_factor(kl):
    """Kc = (KL cosh KL - sinh KL)/(KL (cosh KL - 1)), w1 of the beam under tension (Shelton 1968)."""
    kl = np.asarray(kl, dtype=float)
    return (kl * np.cosh(kl) - np.sinh(kl)) / (kl * (np.cosh(kl) - 1.0))


def sievers_coefficients(kl):
    """(f1, f2, f3) of the open web, kappa L = -f1 y/L + f2 theta_u + f3 theta_o (Sievers, Balas, von Flotow 1988)."""
    kl = np.asarray(kl, dtype=float)
    d = kl * np.sinh(kl) + 2 * (1 - np.cosh(kl))
    f1 = kl**2 * (np.cosh(kl) - 1) / d
    f2 = kl * (kl * np.cosh(kl) - np.sinh(kl)) / d
    return f1, f2, kl * (np.sinh(kl) - kl) / d


def taper_gain(kl):
    """g of w = kappa_t g L^2/(2 (L + pi R)), one tapered pulley (physics sheet, section 7); 1/6 at KL = 0."""
    return (kl * (1 + jnp.cosh(kl)) - 2 * jnp.sinh(kl)) / (kl**2 * jnp.sinh(kl))
