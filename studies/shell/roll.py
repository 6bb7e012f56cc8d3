"""The run-up law by shell elements: ``python -m studies.shell.roll``, a belt that rolls onto a yawed pulley.

Contact and friction lay the belt. The run-up law says that it keeps, lying, the in-plane curvature kappa which the free
part has where it comes to lie, dalpha/ds = kappa, and goes where it points, dy/ds = alpha. Read off the shell alone:
the curvature of the belt that lies, right behind the front, over that of the free part led on to the front. Beside it:
the beam of the measured y and angle, and the angle that the free part is ahead by, which the bending layer claims.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from belt_sim.case import Case, Rig
from belt_sim.line.span import torsional_stiffness
from belt_sim.settings import case_from
from studies.application import application
from studies.closed_forms import sievers_coefficients
from studies.shell import ccx
from studies.shell.mesh import Strip
from studies.shell.roll_deck import Roll, roll_deck
from studies.shell.span_deck import layer

SHEAR_FACTOR = 5 / 6
BEHIND, AHEAD = 0.03, 0.04  # [m]: where the curvature of the belt that lies, and of the free part, is read
BEFORE_ROLLING = 3.0  # steps of the deck, a second each
UM, URAD = 1e-6, 1e-6


@dataclass(frozen=True)
class Front:
    """Where the belt just comes to lie, of one moment. arc [m]; y [m]; angle [rad] of the belt that lies there.

    laid, free: in-plane curvature [1/m] of the belt behind the front, and of the free part, led on to the front by a
    cubic; jump [rad]: by how much the free part is led on to another angle; tilt [rad] of the free part's beginning;
    drift [rad]: slope of the line that it lies on, less the angle of its cross-sections, in the middle of what is read;
    sheared [rad]: n Q/(G b h), by how much the side force Q that the free part hands over there shears the belt.
    """

    arc: float
    y: float
    angle: float
    laid: float
    free: float
    jump: float
    tilt: float
    drift: float
    sheared: float


def front(case: Case, roll: Roll, belt: Strip, turned: float, shape: dict[int, np.ndarray]) -> Front:
    """Read off the turns of the belt's cross-sections when the pull has ``turned`` [rad]."""
    radius, arc = case.rig.tail_radius, turned * case.rig.tail_radius - layer(case)
    rows = []
    for i in range(2, len(belt.x)):
        one, middle, other = (
            np.array([belt.x[i], belt.y[j], 0.0]) + shape[belt.node(i, j)] for j in (0, belt.middle, -1)
        )
        around = min(np.arctan2(middle[0], middle[2] + radius), turned)
        along, out = (np.cos(around), 0.0, -np.sin(around)), (np.sin(around), 0.0, np.cos(around))
        across = other - one
        rows.append((belt.x[i], middle[1], -across @ along / across[1], across @ out / across[1]))
    x, y, angle, tilt = np.array(rows).T
    behind, ahead = (x < arc - roll.row / 2) & (x > arc - BEHIND), (x > arc + AHEAD) & (x < 0.9 * x[-1])
    laid = np.polyfit(x[behind] - arc, angle[behind], 1)
    free = np.polyfit(x[ahead] - arc, angle[ahead], 3)
    there = float(np.interp(arc, x, angle))
    start = float(np.interp(arc + AHEAD, x, tilt))
    slope = np.polyfit(x[behind] - arc, y[behind], 2) @ (2 * x[behind].mean() - 2 * arc, 1.0, 0.0)
    drift, belt_of = float(slope - angle[behind].mean()), case.belt
    soft = float(belt_of.bending_stiffness / (belt_of.shear_modulus * belt_of.area * SHEAR_FACTOR))
    return Front(
        arc, float(np.interp(arc, x, y)), there, laid[0], free[2], free[3] - there, start, drift, -soft * 2 * free[1]
    )


def curvature(case: Case, arc: Any, y: Any, alpha: Any, *, lifts: bool = True) -> Any:
    """kappa [1/m] of the free part where it comes to lie at ``arc``: beam under tension, with shear at first order.

    ``lifts``: the bending layer lets the free part begin at alpha + (l^3/8R^2) M/T (studies/notes/lift_off.md).
    """
    belt, yaw = case.belt, float(case.settings.yaw.last())
    free = case.rig.span_length * (1 + case.settings.tension / belt.youngs_modulus) - arc
    f1, f2, f3 = sievers_coefficients(np.sqrt(case.tension_force / belt.bending_stiffness) * free)
    chord = (-yaw * free - y) / free
    soft = 12 * belt.bending_stiffness / (free**2 * belt.shear_modulus * belt.area * SHEAR_FACTOR)
    per_chord, per_alpha, per_end = (
        f1 + 6 / (1 + soft) - 6,
        f2 + (4 + soft) / (1 + soft) - 4,
        f3 + (2 - soft) / (1 + soft) - 2,
    )
    stuck = (per_chord * chord - per_alpha * alpha + per_end * yaw) / free
    return stuck / (1 + lean(case, 1.0) * per_alpha / free) if lifts else stuck


def turned_by_slip(case: Case, friction: float) -> float:
    """z [m] = 4 R |M| / (mu F b): the arc on which the belt slips after the yaw, M its entry moment."""
    moment = case.belt.bending_stiffness * abs(float(curvature(case, 0.0, 0.0, 0.0)))
    return 4 * case.rig.tail_radius * moment / (friction * case.tension_force * case.belt.width)


def fronts(case: Case, roll: Roll, folder: Path, limit: float) -> list[Front]:
    """The front at every moment that CalculiX printed, once all that is read behind it came to lie after the yaw."""
    deck, radius = roll_deck(case, roll), case.rig.tail_radius
    yaw = float(case.settings.yaw.last())
    name = f"roll_{'plus' if yaw > 0 else 'minus'}_{radius:g}_{roll.increment * 1e3:g}"
    found = []
    for p in ccx.run(folder, name, deck.text, limit):
        rolled = min(p.time - BEFORE_ROLLING, 1.0) * roll.rolled
        if p.quantity == "displacements" and rolled >= BEHIND:
            found.append(front(case, roll, deck.belt, (roll.laid + rolled) / radius, p.values))
    return found


def lean(case: Case, kappa: float) -> float:
    """(l^3/8R^2) M/T [rad]: what the bending layer adds to the angle of the free part where it begins."""
    stiffness = case.belt.bending_stiffness / torsional_stiffness(case)
    return float(layer(case) ** 3 / (8 * case.rig.tail_radius**2) * stiffness * kappa)


def rolling_case(config: dict[str, Any], yaw: float) -> Case:
    """The configured belt, ``length`` of it free, before a pulley of ``radius``; nothing else is a pulley."""
    rig = Rig(centre_distance=config["length"], head_radius=config["radius"], tail_radius=config["radius"])
    return replace(case_from(config | {"yaw": yaw}), rig=rig)


def roll_study(config: dict[str, Any]) -> None:
    """The table."""
    if not ccx.is_installed():
        print(f"skipped: {ccx.MISSING}")
        return
    roll = Roll(**config["roll"])
    columns = ("yaw deg", "front mm", "y um", "angle urad", "laid 1/km", "free 1/km", "laid / free", "beam 1/km")
    table = Table(*columns, "slope - angle urad", "n Q/GA urad", "tilt mrad", "jump urad", "lean urad")
    for yaw in config["yaws"]:
        case = rolling_case(config, yaw)
        print(f"yaw {yaw:g} deg: slips on {1e3 * turned_by_slip(case, roll.friction):.1f} mm")
        for f in fronts(case, roll, Path(config["out"]), config["limit"]):
            beam = float(curvature(case, f.arc, f.y, f.angle))
            cells = [f.arc * 1e3, f.y / UM, f.angle / URAD, f.laid * 1e3, f.free * 1e3]
            numbers = [f"{c:.2f}" for c in cells] + [f"{f.laid / f.free:.3f}", f"{beam * 1e3:.2f}"]
            layered = [f.drift / URAD, f.sheared / URAD, f.tilt * 1e3, f.jump / URAD, lean(case, f.free) / URAD]
            table.add_row(f"{yaw:g}", *numbers, *(f"{c:.2f}" for c in layered))
    Console(width=150).print(table)


if __name__ == "__main__":
    application("shell_roll", roll_study)
