"""The loaded belt at rest: stations at equal chords round two pulleys and along two sagging spans."""

import math
from dataclasses import dataclass

import numpy as np

from belt_sim.case import Case
from belt_sim.errors import InputError

_CURVE_POINTS = 200  # per mean chord: the closed curve is interpolated linearly, error ~ chord / 8 R / 200^2
_EQUALISING_SWEEPS = 60  # chords become equal to rounding long before


@dataclass(frozen=True)
class Loop:
    """Stations in the order in which the upper span runs from head to tail.

    x, z [m], shape (n,); chord [m] between neighbours, loaded; radius_head, radius_tail [m]: circles of the
    stations on the pulleys, wider than the pulleys so that a chord stands for its arc.
    """

    x: np.ndarray
    z: np.ndarray
    chord: float
    radius_head: float
    radius_tail: float


def station_radius(radius: float, chord: float) -> float:
    """Radius of the circle on which chords of an equal-sided polygon turn by chord / radius each."""
    half = 0.5 * chord / radius
    return 0.5 * chord / math.sin(half)


def laid_loop(case: Case, dx: float) -> Loop:
    """The loop at the case's tension and gravity with stations about dx [m] apart.

    Raises InputError when a pulley would carry too few stations.
    """
    rig = case.rig
    smallest = min(float(rig.head_radius), float(rig.tail_radius))
    if dx > smallest / 3.0:
        raise InputError("options.dx", dx, "m", f"give at most a third of the pulley radius, {smallest / 3.0:.3f}")
    n = 2 * round(float(rig.belt_length) / dx / 2.0)
    chord = float(rig.belt_length) / n
    for _ in range(3):
        head, tail = (station_radius(float(r), chord) for r in (rig.head_radius, rig.tail_radius))
        x, z, chord = _equal_chords(*_curve(case, head, tail, n), n)
    return Loop(x=x, z=z, chord=chord, radius_head=head, radius_tail=tail)


def _curve(case: Case, head: float, tail: float, n: int) -> tuple[np.ndarray, np.ndarray]:
    """A fine closed curve: upper span (sagging parabola), tail arc, lower span, head arc."""
    a = float(case.rig.centre_distance)
    lean = math.asin((head - tail) / a)
    sag = float(case.sag_curvature)
    k = _CURVE_POINTS * n // 4
    u = np.arange(k) / k
    upper_from, upper_to = head * _top(lean), np.array([a, 0.0]) + tail * _top(lean)
    length = math.dist(upper_from, upper_to)
    dip = 0.5 * sag * length**2 * u * (1.0 - u)
    arc = lean + (math.pi - 2.0 * lean) * u
    back = math.pi - lean + (math.pi + 2.0 * lean) * u
    flip = np.array([1.0, -1.0])
    x = [
        upper_from[0] + (upper_to - upper_from)[0] * u,
        a + tail * np.sin(arc),
        (upper_to + (upper_from - upper_to) * u[:, None])[:, 0],
        head * np.sin(back),
    ]
    z = [
        upper_from[1] + (upper_to - upper_from)[1] * u - dip,
        tail * np.cos(arc),
        ((upper_to + (upper_from - upper_to) * u[:, None]) * flip)[:, 1] - dip,
        head * np.cos(back),
    ]
    return np.concatenate(x), np.concatenate(z)


def _top(lean: float) -> np.ndarray:
    return np.array([math.sin(lean), math.cos(lean)])


def _equal_chords(x: np.ndarray, z: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray, float]:
    """n points on the closed curve with equal chords, and the chord."""
    x, z = np.append(x, x[0]), np.append(z, z[0])
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(z)))])
    step = np.full(n, arc[-1] / n)
    for _ in range(_EQUALISING_SWEEPS):
        at = np.concatenate([[0.0], np.cumsum(step)[:-1]])
        px, pz = np.interp(at, arc, x), np.interp(at, arc, z)
        chords = np.hypot(np.roll(px, -1) - px, np.roll(pz, -1) - pz)
        step = step * chords.mean() / chords
        step *= arc[-1] / step.sum()
    return px, pz, float(chords.mean())
