"""Deck of a belt that rolls onto a yawed pulley: contact, friction, large turns, nothing of the run-up law in it.

Seen from the pulley, which so stands still: the belt lies on its top, clamped at x = 0, and the pull on its far end
turns round the axis, so that more and more of the belt comes to lie. A yaw of the pulley about the vertical is, seen
from it, a turn of the far end line by -yaw and its offset by -yaw times the free length; both turn with the pull.
Steps: tension, laying straight, yaw at rest, rolling. There is no weight: the vertical would turn as well.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from belt_sim.case import Case
from studies.shell.mesh import Strip, equation, node_set, steel, strip

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


@dataclass(frozen=True)
class RollDeck:
    """A deck, and the belt whose nodes it prints."""

    text: str
    belt: Strip


def roll_deck(case: Case, roll: Roll) -> RollDeck:
    """The belt of ``case`` rolls onto its tail pulley, yawed by the last yaw of the schedule."""
    belt, radius = _belt(case, roll), case.rig.tail_radius
    far, pulley = belt.size + 1, belt.size + 10
    lines = ["*NODE,NSET=BELTNODES", *belt.nodes(), "*NODE,NSET=FAR", f"{far},0.,0.,1."]
    lines += ["*ELEMENT,TYPE=S4,ELSET=BELT", *(elements := belt.elements())]
    lines += [*steel(case.belt, "BELT")]
    lines += _pulley(radius - case.belt.thickness / 2, roll, case.belt.width, radius, pulley, len(elements))
    lines += [*_contact(roll), "*EQUATION"]
    end = len(belt.x) - 1
    reference = belt.node(end, belt.middle)
    for j in range(len(belt.y)):
        if j != belt.middle:  # the far end line: straight, its turn given by the dummy node
            for direction in (1, 3):
                terms = [(belt.node(end, j), direction, 1.0), (reference, direction, -1.0)]
                lines += equation([*terms, (far, direction, -belt.y[j])])
    lines += [*node_set("OUT", belt.lines_along()), *_steps(case, roll, belt, far)]
    return RollDeck("\n".join(lines) + "\n", belt)


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


def _contact(roll: Roll) -> list[str]:
    """The belt's lower face on the pulley's outer faces, linear penalty, Coulomb's friction."""
    lines = ["*SURFACE,NAME=BELTFACE,TYPE=ELEMENT", "BELT,SNEG", "*SURFACE,NAME=PULLEYFACE,TYPE=ELEMENT", "PULLEY,S2"]
    lines += ["*SURFACE INTERACTION,NAME=CONTACT", "*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR"]
    lines += [f"{roll.normal:.6g}", "*FRICTION", f"{roll.friction:g},{roll.tangential:.6g}"]
    return [*lines, "*CONTACT PAIR,INTERACTION=CONTACT,TYPE=SURFACE TO SURFACE", "BELTFACE,PULLEYFACE"]


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
    straight = [f"{reference},2,2,0.", f"{far},1,3,0."]
    yawed = [f"{reference},2,2,{-yaw * free(begin):.12g}", f"{far},2,2,0."]
    yawed += [f"{far},1,1,{yaw * math.cos(begin):.12g}", f"{far},3,3,{-yaw * math.sin(begin):.12g}"]
    still = ["*CLOAD,OP=NEW", f"{reference},1,{force * math.cos(begin):.12g}"]
    still += [f"{reference},3,{-force * math.sin(begin):.12g}"]
    lines += _step("1.,1.", 100, ["*BOUNDARY", *_clamp(belt, radius), *straight, "*CLOAD", f"{reference},1,{force:g}"])
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


def _clamp(belt: Strip, radius: float) -> list[str]:
    """The belt's beginning lies on top of the pulley and stays there."""
    height = radius * math.cos(belt.x[1] / radius) - radius
    across = range(len(belt.y))
    lines = [f"{belt.node(0, j)},1,3,0." for j in across]
    return [*lines, *(f"{belt.node(1, j)},3,3,{height:.10g}" for j in across), "PULLEY,1,3,0."]


def _step(times: str, most: int, loads: Sequence[str]) -> list[str]:
    lines = [f"*STEP,NLGEOM,INC={most}", "*STATIC", times, _CONTROLS, *loads]
    return [*lines, "*NODE PRINT,NSET=OUT,FREQUENCY=5", "U", "*END STEP"]
