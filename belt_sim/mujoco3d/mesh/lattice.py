"""Bond stiffnesses at which a rectangular lattice of particles stretches, bends and shears like the real strip.

A cell is ``chord`` long and w wide, with a longitudinal bond on either side, a transverse bond and both diagonals
(length l, cos = chord / l, sin = w / l). For a lengthwise strain e and a lateral strain t of the cell the diagonals
stretch by e cos^2 + t sin^2, for a shear g by +- g sin cos. With EA of a bond written K (stiffness times length):

- shear: a row of n cells carries 2 n K_d sin^2 cos g, set equal to 5/6 G b h g;
- free lateral strain: t = -nu' e, nu' = 2 K_d l sin^2 cos^2 / (K_t w + 2 K_d l sin^4);
- stretch: EA = K + n D, D = 2 K_d cos (cos^2 - nu' sin^2), K the sum over the lines;
- bending: EI = b'^2 / 12 (K (1 + 2 / n^2) + n D (1 - 1 / n^2)), b' = n w the width of the lattice.

Two lines (n = 1): the diagonals do not stretch in pure bending, and K b'^2 / 4 = EI.
"""

import math
from dataclasses import dataclass

from belt_sim.rig import Belt

_SHEAR_FACTOR = 5.0 / 6.0  # of a rectangular section
_SWEEPS = 40  # the width changes by less than rounding after a dozen


@dataclass(frozen=True)
class Lattice:
    """width b' [m]; lines K, transverse K_t (a bond), diagonal K_d (a bond) [N]: EA; poisson_ratio nu' [1]."""

    width: float
    lines: float
    transverse: float
    diagonal: float
    poisson_ratio: float


def calibrate(belt: Belt, chord: float, across: int, bonds: tuple[str, ...]) -> Lattice:
    """The lattice with these bonds that stands for ``belt``; bonds that are left out carry nothing.

    chord [m]: distance of stations; across: nodes over the width, 2 or more. Without diagonals EA and EI (for
    sections that stay square) still hold, and there is no shear stiffness.
    """
    n = across - 1
    stretch, bend = float(belt.youngs_modulus) * float(belt.area), float(belt.bending_stiffness)
    shear = _SHEAR_FACTOR * float(belt.shear_modulus) * float(belt.area) if "diagonal" in bonds else 0.0
    tie = float(belt.youngs_modulus) * float(belt.thickness) * chord if "transverse" in bonds else 0.0
    width, lines, diagonal, poisson = float(belt.width), stretch, 0.0, 0.0
    for _ in range(_SWEEPS):
        w = width / n
        length = math.hypot(chord, w)
        cos, sin = chord / length, w / length
        diagonal = shear / (2.0 * n * sin**2 * cos)
        if diagonal:
            poisson = 2.0 * diagonal * length * (sin * cos) ** 2 / (tie * w + 2.0 * diagonal * length * sin**4)
        share = 2.0 * diagonal * cos * (cos**2 - poisson * sin**2)
        lines = stretch - n * share
        width = math.sqrt(12.0 * bend / (lines * (1.0 + 2.0 / n**2) + n * share * (1.0 - 1.0 / n**2)))
    return Lattice(width=width, lines=lines, transverse=tie, diagonal=diagonal, poisson_ratio=poisson)
