"""Closed forms that tests and figures compare with: offsets of a steady belt, textbook beams, tapered pulleys, tilt."""

import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case
from belt_sim.line.spans import Composition, edge_tensions, runup_weights


def steady_offsets(case: Case, model: Composition) -> tuple[float, float]:
    """Return the steady offsets, run-up minus run-off [m], of the upper and the lower span.

    y_1 - y_4 = L (w1 beta + w0 beta_h - w), y_3 - y_2 = L (-w1 beta_h - w0 beta - w), for travel direction +1.
    """
    w, (up, low), length = model.steady_rate(case), runup_weights(case, model), case.rig.span_length
    tail, head = float(case.settings.yaw.last()), float(case.settings.yaw_head.last())
    return length * (up * tail + (1 - up) * head - w), length * (-low * head - (1 - low) * tail - w)


def shelton_factor(kl):
    """Return Kc = (KL cosh KL - sinh KL)/(KL (cosh KL - 1)), w1 of the beam under tension (Shelton 1968)."""
    kl = np.asarray(kl, dtype=float)
    return (kl * np.cosh(kl) - np.sinh(kl)) / (kl * (np.cosh(kl) - 1.0))


def sievers_coefficients(kl):
    """Return (f1, f2, f3) of the open web, kappa L = -f1 y/L + f2 theta_u + f3 theta_o (Sievers et al. 1988)."""
    kl = np.asarray(kl, dtype=float)
    d = kl * np.sinh(kl) + 2 * (1 - np.cosh(kl))
    f1 = kl**2 * (np.cosh(kl) - 1) / d
    f2 = kl * (kl * np.cosh(kl) - np.sinh(kl)) / d
    return f1, f2, kl * (np.sinh(kl) - kl) / d


def taper_gain(kl):
    """Return g of w = kappa_t g L^2/(2 (L + pi R)), one tapered pulley (physics sheet, section 7); 1/6 at KL = 0."""
    return (kl * (1 + jnp.cosh(kl)) - 2 * jnp.sinh(kl)) / (kl**2 * jnp.sinh(kl))


def edge_tilt(case: Case, beta: float) -> float:
    """Return the tilt [rad] at mid-span by the unlike sags q L^2/(8 F1), q L^2/(8 F2) of both edge ropes."""
    tight, slack = edge_tensions(case, beta)
    weight = float(case.weight_per_length) / 2.0 * float(case.rig.span_length) ** 2
    return weight / 8.0 * (1.0 / slack - 1.0 / tight) / case.belt.width
