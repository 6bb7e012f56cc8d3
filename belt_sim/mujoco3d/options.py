"""How a three-dimensional run is discretised and driven."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from belt_sim.errors import InputError

#: The three belts: a limp chain, particles tied by bonds, a two-dimensional membrane.
BELTS = ("rope", "grid", "flex")
BONDS = ("longitudinal", "transverse", "diagonal")
#: A force on the sliding tail pulley, the belt's length at fixed pulleys, pulleys moved apart (machine/tensioning.py).
TENSIONINGS = ("force", "length", "koller")
#: What carries the belt on the pulleys: springs that hold landed nodes, or MuJoCo's contacts.
CONTACTS = ("held", "mujoco")
#: belt_speed of a run at its case's own speed
AS_THE_CASE = "case"


@dataclass(frozen=True, kw_only=True)
class Options:
    """Numerical settings of a run; the defaults are those of the error budget in docs/three_dimensions.md.

    dx [m]: distance of stations along the belt; across: nodes over the width (2 carry the exact EI and tension
    torsion); dt [s]; belt_speed [m/s] of the run, None = as fast as is accurate (machine/pace.py), "case" = that of
    the case; friction [1]: Coulomb coefficient between belt and pulleys, inf = sticking; bonds: which bonds tie the
    grid; tensioning: how the belt gets its tension, see TENSIONINGS; run_in [m]: travel before 0, straight;
    acceleration [m/s2]; settle [s]: time at rest for the sag, and half of it after a yaw step; yaw_time [s]: duration
    of a yaw step; damping [1/s]: drag of the free belt, across its travel, per unit of its mass (limp belts get more);
    hold_stiffness [N/m]: springs that hold a landed node; tail_mass [kg]: inertia of the tail pulley on its slide and
    about its axis; sample [m]: travel between points of the curves; frame [m]: travel between frames;
    steps: of engine=quasi_static, to a point of the curves.
    """

    dx: float = 0.025
    across: int = 2
    dt: float = 1e-3
    belt_speed: float | str | None = None
    friction: float = math.inf
    bonds: tuple[str, ...] = BONDS
    tensioning: str = "force"
    run_in: float = 1.5
    acceleration: float = 1.0
    settle: float = 1.0
    yaw_time: float = 0.3
    damping: float = 1.0
    hold_stiffness: float = 1e13
    tail_mass: float = 60.0
    sample: float = 0.025
    frame: float = 0.1
    steps: int = 2

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, float) and not (value > 0.0 or (value == 0.0 and field.name in _MAY_BE_ZERO)):
                raise InputError(f"options.{field.name}", value, "", "give a positive number")
        if self.across < 1 or int(self.across) != self.across:
            raise InputError("options.across", self.across, "nodes", "give 1 (rope), 2 or more")
        if self.steps < 1:
            raise InputError("options.steps", self.steps, "", "give 1 or more")
        if isinstance(self.belt_speed, str) and self.belt_speed != AS_THE_CASE:
            raise InputError("options.belt_speed", self.belt_speed, "", f"give m/s, {AS_THE_CASE}, or leave it out")
        if self.tensioning not in TENSIONINGS:
            raise InputError("options.tensioning", self.tensioning, "", f"choose one of {', '.join(TENSIONINGS)}")
        unknown = [b for b in self.bonds if b not in BONDS]
        if unknown or "longitudinal" not in self.bonds:
            raise InputError("options.bonds", self.bonds, "", f"longitudinal, and any of {', '.join(BONDS[1:])}")

    @staticmethod
    def of(settings: Mapping[str, Any]) -> "Options":
        """From the numbers of a configuration; None keeps the recommended value. Raises InputError for a wrong one."""
        known = {f.name: f.default for f in fields(Options)}
        given: dict[str, Any] = {}
        for key, value in settings.items():
            if key not in known:
                raise InputError(f"model.{key}", value, "", f"use one of {', '.join(known)}")
            if value is not None:
                given[key] = _converted(f"model.{key}", value, known[key])
        return Options(**given)

    @property
    def pace(self) -> float:
        """Belt speed [m/s] of options that were fitted to a case (run/fitted.py)."""
        assert isinstance(self.belt_speed, float)
        return self.belt_speed


def is_limp(belt: str, options: Options) -> bool:
    """Belts without in-plane bending stiffness in their spans."""
    return belt == "rope" or (belt == "grid" and "diagonal" not in options.bonds)


_MAY_BE_ZERO = ("friction", "run_in", "settle", "damping")


def _converted(name: str, value: Any, default: Any) -> Any:
    if isinstance(default, tuple):
        if not isinstance(value, (list, tuple)):
            raise InputError(name, value, "", "give a list")
        return tuple(str(v) for v in value)
    if isinstance(default, str) or (default is None and isinstance(value, str)):
        return str(value)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(name, value, "", "give a number")
    return int(value) if isinstance(default, int) else float(value)
