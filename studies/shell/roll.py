"""The run-up law by shell elements: ``python -m studies.shell.roll``, a belt that rolls onto a yawed pulley.

Contact and friction lay the belt. The run-up law says that it keeps, lying, the in-plane curvature kappa which the free
part has where it comes to lie, dalpha/ds = kappa, and goes where it points, dy/ds = alpha. Read off the shell alone:
the curvature of the belt that lies, right behind the front, over that of the free part led on to the front. Beside it:
the beam of the measured y and angle, and the angle that the free part is ahead by, which the bending layer claims.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from belt_sim.case import Case, Rig
from belt_sim.line.span import beam_second_order
from belt_sim.settings import case_from
from studies.application import application
from studies.closed_forms import sievers_coefficients
from studies.shell import ccx
from studies.shell.ccx import Strip, equation, node_set, steel, strip
from studies.shell.span import layer

SLOPES = 201  # entries of a table in time
PULLEY_FACET = 0.001  # [m]; its middle stands 0.7 um inside a circle of 0.17 m
PULLEY_MARGIN = 0.03  # [m] of arc at either end
PULLEY_DEPTH = 0.02  # [m]
_CONTROLS = "*CONTROLS,PARAMETERS=FIELD\n2e-3,1e-3\n*CONTROLS,PARAMETERS=TIME INCREMENTATION\n12,14,9,60,40,4,,12"


@dataclass(frozen=True, kw_only=True)
class Roll:
    """How it is rolled. laid, rolled [m]: arc laid before the yaw, arc rolled on after it; friction [1].

    row, coarsest: element lengths where it rolls and at the far end [m]; across: elements over the width;
    increment [m]: most arc in one; normal, tangential [Pa/m]: stiffness of contact and of sticking.
    """

    laid: float = 0.06
    rolled: float = 0.05
    friction: float = 20.0
    row: float = 0.004
    coarsest: float = 0.04
    across: int = 4
    increment: float = 0.0015
    normal: float = 1e11
    tangential: float = 1e13


def roll_deck(case: Case, roll: Roll) -> tuple[str, Strip]:
    """A deck, and the belt whose nodes it prints: that of ``case`` rolls onto its tail pulley, yawed by the last
    yaw of the schedule; no run-up law is in it.

    Seen from the pulley, which so stands still: the belt lies on its top, clamped at x = 0, and the pull on its far
    end turns round the axis, so that more and more of the belt comes to lie. A yaw of the pulley about the vertical
    is, seen from it, a turn of the far end line by -yaw and its offset by -yaw times the free length; both turn with
    the pull. Steps: tension, laying straight, yaw at rest, rolling. No weight: the vertical would turn as well.
    """
    belt, radius = _belt(case, roll), case.rig.tail_radius
    far, pulley = belt.size + 1, belt.size + 10
    lines = ["*NODE,NSET=BELTNODES", *belt.nodes(), "*NODE,NSET=FAR", f"{far},0.,0.,1."]
    lines += ["*ELEMENT,TYPE=S4,ELSET=BELT", *(elements := belt.elements())]
    lines += [*steel(case.belt, "BELT")]
    lines += _pulley(radius - case.belt.thickness / 2, roll, case.belt.width, radius, pulley, len(elements))
    # the belt's lower face on the pulley's outer faces, linear penalty, Coulomb's friction
    lines += ["*SURFACE,NAME=BELTFACE,TYPE=ELEMENT", "BELT,SNEG", "*SURFACE,NAME=PULLEYFACE,TYPE=ELEMENT", "PULLEY,S2"]
    lines += ["*SURFACE INTERACTION,NAME=CONTACT", "*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR"]
    lines += [f"{roll.normal:.6g}", "*FRICTION", f"{roll.friction:g},{roll.tangential:.6g}"]
    lines += ["*CONTACT PAIR,INTERACTION=CONTACT,TYPE=SURFACE TO SURFACE", "BELTFACE,PULLEYFACE", "*EQUATION"]
    end = len(belt.x) - 1
    reference = belt.node(end, belt.middle)
    for j in range(len(belt.y)):
        if j != belt.middle:  # the far end line: straight, its turn given by the dummy node
            for direction in (1, 3):
                terms = [(belt.node(end, j), direction, 1.0), (reference, direction, -1.0)]
                lines += equation([*terms, (far, direction, -belt.y[j])])
    lines += [*node_set("OUT", belt.lines_along()), *_steps(case, roll, belt, far)]
    return "\n".join(lines) + "\n", belt


def _belt(case: Case, roll: Roll) -> Strip:
    """Even rows where it comes to lie, then longer ones up to the far end."""
    length, places = case.rig.span_length, [0.0]
    while places[-1] < roll.laid + roll.rolled + 10 * roll.row:
        places.append(places[-1] + roll.row)
    step = roll.row
    while places[-1] + 1.5 * step < length:
        step = min(1.25 * step, roll.coarsest)
        places.append(places[-1] + step)
    places[-1] = length
    return strip(places, case.belt.width, roll.across, quadratic=False)


def _pulley(inner: float, roll: Roll, width: float, radius: float, first: int, elements: int) -> list[str]:
    """A rigid polygon of mean radius ``inner``, which the belt's lower face touches."""
    least, most = -PULLEY_MARGIN / radius, (roll.laid + roll.rolled + PULLEY_MARGIN) / radius
    turn = np.linspace(least, most, round((most - least) * radius / PULLEY_FACET) + 1)
    outer = inner * (1 + ((turn[1] - turn[0]) / 2) ** 2 / 6)
    lines, node = ["*NODE,NSET=PULLEY"], first
    for t in turn:
        for y in (-0.8 * width, 0.8 * width):
            for r in (outer, outer - PULLEY_DEPTH):
                lines.append(f"{node},{r * math.sin(t):.12g},{y:.10g},{r * math.cos(t) - radius:.12g}")
                node += 1
    lines.append("*ELEMENT,TYPE=C3D8,ELSET=PULLEY")
    for k in range(len(turn) - 1):
        a, b = first + 4 * k, first + 4 * (k + 1)
        corners = (a + 1, b + 1, b + 3, a + 3, a, b, b + 2, a + 2)
        lines.append(f"{elements + k + 1}," + ",".join(map(str, corners)))
    return [*lines, "*SOLID SECTION,ELSET=PULLEY,MATERIAL=STEEL"]


def _steps(case: Case, roll: Roll, belt: Strip, far: int) -> list[str]:
    """Tables in time, then tension, laying, yaw, rolling."""
    radius, force, yaw = case.rig.tail_radius, case.tension_force, float(case.settings.yaw.last())
    begin, end = roll.laid / radius, (roll.laid + roll.rolled) / radius
    reference = belt.node(len(belt.x) - 1, belt.middle)

    def free(turn: float) -> float:
        return case.rig.span_length - turn * radius

    lines = _table("LAYX", 0.0, begin, math.cos) + _table("LAYZ", 0.0, begin, lambda t: -math.sin(t))
    lines += _table("ROLLX", begin, end, math.cos) + _table("ROLLZ", begin, end, lambda t: -math.sin(t))
    lines += _table("ROLLY", begin, end, lambda t: -yaw * free(t))
    height = radius * math.cos(belt.x[1] / radius) - radius  # the belt's beginning lies on top and stays there
    across = range(len(belt.y))
    clamp = [f"{belt.node(0, j)},1,3,0." for j in across] + [f"{belt.node(1, j)},3,3,{height:.10g}" for j in across]
    straight = ["PULLEY,1,3,0.", f"{reference},2,2,0.", f"{far},1,3,0."]
    yawed = [f"{reference},2,2,{-yaw * free(begin):.12g}", f"{far},2,2,0."]
    yawed += [f"{far},1,1,{yaw * math.cos(begin):.12g}", f"{far},3,3,{-yaw * math.sin(begin):.12g}"]
    still = ["*CLOAD,OP=NEW", f"{reference},1,{force * math.cos(begin):.12g}"]
    still += [f"{reference},3,{-force * math.sin(begin):.12g}"]
    lines += _step("1.,1.", 100, ["*BOUNDARY", *clamp, *straight, "*CLOAD", f"{reference},1,{force:g}"])
    lines += _step("0.1,1.,1e-7,0.2", 1000, _pull("LAY", reference, force))
    lines += _step("1.,1.", 1000, ["*BOUNDARY", *yawed, *still])
    most = roll.increment / roll.rolled
    turned = ["*BOUNDARY,AMPLITUDE=ROLLY", f"{reference},2,2,1."]
    turned += ["*BOUNDARY,AMPLITUDE=ROLLX", f"{far},1,1,{yaw:.12g}", "*BOUNDARY,AMPLITUDE=ROLLZ"]
    turned += [f"{far},3,3,{yaw:.12g}", *_pull("ROLL", reference, force)]
    return lines + _step(f"{most / 2:.6g},1.,1e-7,{most:.6g}", 5000, turned)


def _table(name: str, begin: float, end: float, value: Callable[[float], float]) -> list[str]:
    """value(turn) over the time 0..1 of a step in which the turn grows evenly."""
    at = np.linspace(0.0, 1.0, SLOPES)
    return [f"*AMPLITUDE,NAME={name}"] + [f"{t:.6g},{value(begin + (end - begin) * t):.12g}" for t in at]


def _pull(name: str, reference: int, force: float) -> list[str]:
    lines = [f"*CLOAD,OP=NEW,AMPLITUDE={name}X", f"{reference},1,{force:g}"]
    return [*lines, f"*CLOAD,AMPLITUDE={name}Z", f"{reference},3,{force:g}"]


def _step(times: str, most: int, loads: Sequence[str]) -> list[str]:
    lines = [f"*STEP,NLGEOM,INC={most}", "*STATIC", times, _CONTROLS, *loads]
    return [*lines, "*NODE PRINT,NSET=OUT,FREQUENCY=5", "U", "*END STEP"]


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
    (deck, belt), radius = roll_deck(case, roll), case.rig.tail_radius
    yaw = float(case.settings.yaw.last())
    name = f"roll_{'plus' if yaw > 0 else 'minus'}_{radius:g}_{roll.increment * 1e3:g}"
    found = []
    for p in ccx.run(folder, name, deck, limit):
        rolled = min(p.time - BEFORE_ROLLING, 1.0) * roll.rolled
        if p.quantity == "displacements" and rolled >= BEHIND:
            found.append(front(case, roll, belt, (roll.laid + rolled) / radius, p.values))
    return found


def lean(case: Case, kappa: float) -> float:
    """(l^3/8R^2) M/T [rad]: what the bending layer adds to the angle of the free part where it begins."""
    stiffness = case.belt.bending_stiffness / beam_second_order(case).torsion
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
