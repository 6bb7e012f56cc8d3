"""How far the end of a wrapped belt turns where friction alone holds its moment: equilibrium, integrated once.

Along a zone that slides, friction has the size mu F/(R b) per area and lies against the way of each point across the
width, (eta theta', theta). It gives a couple m and a side force f per metre, M' = m + S, S' = -f, theta' = M/EI, from
nothing where the belt still sticks (M = theta = 0) to where nothing pushes it aside any more (S = 0). In widths, and
with mu F/R = EI = 1, one number is left: S at the beginning.
"""

from functools import cache

import numpy as np

from belt_sim.virtual_rig.line import Line

_BEGINNINGS = np.geomspace(1e-3, 30.0, 60)  # of S
_STEPS = 400  # in a width
_AGAIN = 12  # times that the zone of what is left is worked out
_FAINT = 1e-30  # of a curvature [1/m], instead of none


def slip_turn(kappa, stiff, line: Line, held) -> tuple[np.ndarray, np.ndarray]:
    """Angle [rad] by which a step of curvature ``kappa`` [1/m] turns the belt on the tail and on the head pulley, and
    how far [m] its end goes aside; shape (2, batch).

    stiff: curvature that a radian takes away [1/m]; held: where nothing slides.
    """
    radius, wrap = np.stack([line.tail_radius, line.head_radius]), np.stack([line.wrap_tail, line.wrap_head])
    with np.errstate(divide="ignore"):
        couple = 4 * radius * line.bending / (line.friction * line.force * line.width)
    zone = 0.0 * kappa
    for _ in range(_AGAIN):
        left = kappa / (1 + stiff * zone / 2)
        longest = couple * np.abs(left)
        share, aside = (np.interp(longest / line.width, *rows) for rows in _zones())
        zone = np.where(held, 0.0, np.minimum(longest * share, wrap))
    return left * zone / 2, aside * left * zone**2 / 2


@cache
def _zones():
    """(length were there no side force, in widths; share of it that slides) and (the same; way aside over turn times
    zone), as rows to interpolate."""
    side = _BEGINNINGS.copy()
    moment, angle, aside = np.zeros((3, len(side)))
    found = np.zeros((3, len(side)))
    step = 1.0 / _STEPS
    while (open_ := side > 0).any():
        before = moment, angle, aside
        first = _slopes(moment, angle, side)
        middle = _slopes(*(x + step / 2 * dx for x, dx in zip((moment, angle, side), first, strict=True)))
        moment, angle, side_after = (x + step * dx for x, dx in zip((moment, angle, side), middle, strict=True))
        aside = aside + step * (before[1] + angle) / 2
        ends = open_ & (side_after <= 0)
        part = np.where(ends, side / np.where(ends, side - side_after, 1.0), 0.0)
        at_end = [a + part * (b - a) for a, b in zip(before, (moment, angle, aside), strict=True)]
        found = np.where(ends, at_end, found)
        side = np.where(open_, side_after, side)
    moment, angle, aside = found
    longest, zone = 4 * moment, 2 * angle / moment
    return (longest, zone / longest), (longest, aside / (angle * zone))


def _slopes(moment, angle, side):
    """Per width: of M, theta and S."""
    far = np.abs(angle) / np.maximum(np.abs(moment), _FAINT)  # theta/theta'
    reach = np.sqrt(0.25 + far**2)
    lean = far * np.arcsinh(0.5 / np.maximum(far, _FAINT))
    return 0.5 * reach - far * lean + side, moment, -2 * lean
