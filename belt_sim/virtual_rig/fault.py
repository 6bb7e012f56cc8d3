"""What a faultless line does not have: the hooks of a fault and the size of its parameters."""

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, ClassVar

import numpy as np

if TYPE_CHECKING:
    from belt_sim.virtual_rig.line import Line
    from belt_sim.virtual_rig.travel import Journey

TAIL = np.array([[1.0], [0.0]])  # a turn on the tail pulley only


@dataclass(frozen=True, kw_only=True)
class Size:
    """SI unit of a parameter, a typical size, and the largest one that a real machine would have."""

    unit: str
    typical: float
    limit: float


@dataclass(frozen=True, kw_only=True)
class Fault:
    """A departure from the faultless line; parameters are SI numbers or arrays (batch,), and 0 is no fault.

    A fault overrides the hooks that it needs; the others change nothing. ``sizes`` names its parameters, the
    leading ones first; ``positive``: negative sizes have no meaning.
    """

    id: ClassVar[str] = ""
    sizes: ClassVar[dict[str, Size]] = {}
    positive: ClassVar[bool] = False

    def set(self, line: "Line") -> "Line":
        """The line with its constants changed."""
        return line

    def prepared(self, line: "Line") -> "Fault":
        """The fault with what it needs to know of the line worked out, before a march."""
        return self

    def yaw(self, s: float, line: "Line"):
        """Angle added to the tail pulley's yaw at travel s [rad]."""
        return 0.0

    def turn(self, s: float, line: "Line", y, kappa):
        """Curvature added to kappa where the belt runs up [1/m]; y, kappa, result: shape (2, batch)."""
        return 0.0

    def slide(self, s: float, line: "Line"):
        """Factor on the lateral velocity where the belt runs up, scalar or (batch,)."""
        return 1.0

    def travelled(self, shown, line: "Line"):
        """True travel when the recorder shows ``shown`` [m]."""
        return shown

    def read(self, value, place: str, s, journey: "Journey"):
        """What a sensor at ``place`` shows instead of ``value``, at true travel s; all shape (n, batch)."""
        return value

    def parameters(self) -> dict[str, float]:
        """Parameter name -> value [SI]."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.init}


def overriding(faults, hook: str) -> list:
    """Those faults that override a hook."""
    return [f for f in faults if getattr(type(f), hook) is not getattr(Fault, hook)]
