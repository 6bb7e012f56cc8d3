"""A wrapped arc as a rational transfer function: Pade's approximation, or a chain of equal lags."""

from math import factorial

import numpy as np
from scipy import signal

from belt_sim.errors import InputError

KINDS = ("pade", "chain")


def rational_delay(length: float, order: int, kind: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """State space (a, b, c, d) of exp(-p length), ``length`` in m, p in 1/m.

    pade: of order (order, order), exact to p^(2 order) and of magnitude 1 at every wavenumber; chain: ``order`` lags
    of length/order each, which also damps. Raises InputError for an order outside 1..12 or an unknown kind.
    """
    if isinstance(order, bool) or not isinstance(order, int) or not 1 <= order <= 12:
        raise InputError("order", order, "", "use a whole number from 1 to 12")
    if kind not in KINDS:
        raise InputError("delay", kind, "", f"use one of {', '.join(KINDS)}")
    a, b, c, d = _pade(order) if kind == "pade" else _chain(order)
    return a / length, b / length, c, d


def _pade(order: int):
    """Of exp(-p): bottom sum c_k p^k, top sum c_k (-p)^k, c_k = (2n-k)! / (k! (n-k)!) (Baker & Graves-Morris 1996)."""
    c = np.array([factorial(2 * order - k) / (factorial(k) * factorial(order - k)) for k in range(order, -1, -1)])
    sign = (-1.0) ** np.arange(order, -1, -1)
    return signal.tf2ss(c * sign, c)


def _chain(order: int):
    a = order * (np.eye(order, k=-1) - np.eye(order))
    return a, order * np.eye(order, 1), np.eye(1, order, k=order - 1), np.zeros((1, 1))
