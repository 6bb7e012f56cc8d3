"""The span's stiffnesses by shell elements beside the strip law: ``python -m studies.shell.span``.

Entry moment and carry-over in N m per rad of in-plane turn at the run-up, mid-span tilt in rad per rad, for small
turns: hinged ends beside ``strip``, ends that lie on the pulleys up to lift-off beside ``strip_lift_off``.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from belt_sim.case import Case
from belt_sim.effects.pulley import LiftOff
from belt_sim.effects.span import Flatness
from belt_sim.jax_setup import jit_float64
from belt_sim.line.span import strip
from belt_sim.line.spans import span_responses
from belt_sim.settings import case_from
from belt_sim.units import DEGREE, N_PER_MM2
from studies.application import application
from studies.shell import ccx
from studies.shell.ccx import Strip, equation, graded_lengths, node_set, steel

SPRING = 1e8  # [N/m, N m/rad], some 1e4 times what it measures
HELD_ROWS = 2  # elements behind an end line that lie on the pulley
SIDES = {"hinged": 0.0, "upper": 1.0, "lower": -1.0}
_CONTROLS = "*CONTROLS,PARAMETERS=FIELD\n{0:g},1e-5\n*CONTROLS,PARAMETERS=TIME INCREMENTATION\n12,14,9,60,30,4,,10"


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """Element sizes: finest at the ends and coarsest in the middle [m], number across; tolerance of the residual."""

    finest: float = 0.003
    coarsest: float = 0.08
    across: int = 4
    tolerance: float = 2e-4


@dataclass(frozen=True)
class SpanDeck:
    """A deck with what is needed to read its answer: first and last free row, dummies {name: node}."""

    text: str
    belt: Strip
    first: int
    last: int
    dummies: dict[str, int]


def span_deck(
    case: Case, couples: Sequence[float], ends: str = "hinged", mesh: Mesh | None = None, residual: float = 0.0
) -> SpanDeck:
    """Steps: tension, gravity, residual stress, then one a couple [N m] in the belt's plane at the run-up end.

    Each end line follows u_x = U - y theta, u_y = V + y eps, u_z = W + y phi of two dummy nodes (U, V, W) and
    (phi, eps, theta); stiff springs between these and the nodes that are held tell the forces. ends: "hinged" lets the
    line turn about itself; "upper" and "lower" hold the rows behind the line on a pulley, above which or below which
    the belt runs, up to where contact ends: there the free side has the curvature 1/R. CalculiX fails on large
    prescribed turns, so a couple is prescribed and the turn is read. residual: stress [Pa] in the middle of the width,
    residual (1 - 12 y^2/b^2) across it, made by strains along the belt (0: no such step).
    """
    mesh = mesh or Mesh()
    belt, first, last = _strip(case, ends, mesh)
    names = ("A1", "A2", "B1", "B2", "ONE", "HA1", "HA2", "HB1", "HB2")
    dummies = {name: belt.size + 10 + k for k, name in enumerate(names)}
    lines = ["*NODE,NSET=BELTNODES", *belt.nodes(), "*NODE,NSET=DUM"]
    lines += [f"{n},0.,0.,{k + 1}." for k, n in enumerate(dummies.values())]
    lines += ["*ELEMENT,TYPE=S8R,ELSET=BELT", *(elements := belt.elements())]
    lines += [*node_set("OUT", belt.lines_along()), *steel(case.belt, "BELT", expands_along=residual != 0.0)]
    lines += [*_springs(dummies, len(elements)), "*EQUATION"]
    for name, row, rows in (("A", first, range(first + 1)), ("B", last, range(last, len(belt.x)))):
        pair = dummies[f"{name}1"], dummies[f"{name}2"], dummies["ONE"]
        lines += _ends(case, ends, belt, pair, row, rows)
    strains: list[str] = []
    if residual:  # temperatures, which are strains along the belt for an expansion of 1: short where it is pulled
        lines += ["*INITIAL CONDITIONS,TYPE=TEMPERATURE", "BELTNODES,0."]
        strain = -residual * (1.0 - 12.0 * (belt.y / case.belt.width) ** 2) / case.belt.youngs_modulus
        nodes = ((belt.node(i, j), strain[j]) for i in range(len(belt.x)) for j in belt.row(i))
        strains = ["*TEMPERATURE", *(f"{node},{value:.9g}" for node, value in nodes)]
    text = "\n".join([*lines, *_steps(case, couples, dummies, ends, mesh.tolerance, strains)]) + "\n"
    return SpanDeck(text, belt, first, last, dummies)


def layer(case: Case) -> float:
    """l = sqrt(D / (sigma h)) [m]: where contact ends before the tangent point."""
    return float((case.belt.plate_stiffness / (case.settings.tension * case.belt.thickness)) ** 0.5)


def _strip(case: Case, ends: str, mesh: Mesh) -> tuple[Strip, int, int]:
    """The unstressed strip, with its first and last free row; held rows stand behind them."""
    side, z = SIDES[ends], case.sag_curvature
    length = case.rig.span_length + 2 * layer(case) * abs(side)
    arc = length if z == 0 else 2 / z * math.sinh(z * length / 2)
    strain = case.settings.tension / case.belt.youngs_modulus * (1 + (z * length) ** 2 / 12)
    free = graded_lengths(arc * (1 - strain), mesh.finest, mesh.coarsest)
    held = HELD_ROWS if side else 0
    behind = [mesh.finest] * held
    corners = np.concatenate([[0.0], np.cumsum([*behind, *free, *behind])]) - mesh.finest * held
    return ccx.strip(corners, case.belt.width, mesh.across, quadratic=True), 2 * held, 2 * (held + len(free))


def _springs(dummies: dict[str, int], elements: int) -> list[str]:
    """A spring a direction between each dummy and the node that holds it; the pull acts on B1 itself."""
    pairs = [(f"H{name}", name) for name in ("A1", "A2", "B1", "B2")]
    lines: list[str] = []
    for direction in (1, 2, 3):
        lines.append(f"*ELEMENT,TYPE=SPRING2,ELSET=S{direction}")
        for holder, held in pairs:
            if (held, direction) != ("B1", 1):
                elements += 1
                lines.append(f"{elements},{dummies[holder]},{dummies[held]}")
        lines += [f"*SPRING,ELSET=S{direction}", f"{direction},{direction}", f"{SPRING:.1f}"]
    return lines


def _ends(case: Case, ends: str, belt: Strip, pair: tuple[int, int, int], row: int, rows: range) -> list[str]:
    """Equations of the end line ``row`` and of the rows behind it."""
    place, turn, one = pair
    lines: list[str] = []
    for i in rows:
        behind = abs(belt.x[i] - belt.x[row])
        px, pz = _on_pulley(case, SIDES[ends], behind) if behind else (0.0, 0.0)
        px = px if belt.x[i] < belt.x[row] else -px
        moved = px - (belt.x[i] - belt.x[row])
        for j in belt.row(i):
            node, y = belt.node(i, j), belt.y[j]
            lines += equation([(node, 1, 1.0), (place, 1, -1.0), (turn, 3, y), (one, 1, -moved)])
            lines += equation([(node, 2, 1.0), (place, 2, -1.0), (turn, 2, -y), (turn, 3, -px)])
            lines += equation([(node, 3, 1.0), (place, 3, -1.0), (turn, 1, -y), (one, 1, -pz)])
    return lines


def _on_pulley(case: Case, side: float, behind: float) -> tuple[float, float]:
    """Place (x, z) [m] of what lies ``behind`` the left end line on its pulley, from that line."""
    z, radius = case.sag_curvature, side * case.rig.tail_radius
    slope = -math.atan(math.sinh(z * case.rig.span_length / 2)) + (1 / radius + z) * layer(case)
    arc = np.linspace(0.0, behind, 201)
    stretch = 1 + case.settings.tension / case.belt.youngs_modulus
    angle = slope + arc / radius
    return -stretch * float(np.trapezoid(np.cos(angle), arc)), -stretch * float(np.trapezoid(np.sin(angle), arc))


def _steps(
    case: Case, couples: Sequence[float], dummies: dict[str, int], ends: str, tolerance: float, strains: list[str]
) -> list[str]:
    """Tension, gravity, residual stress where there is one, couples."""
    # held at both ends is all but the turn of the run-up: no displacement, no roll, the width as it shrinks
    shrink = -case.belt.poisson_ratio * case.settings.tension / case.belt.youngs_modulus
    held = [f"{dummies['ONE']},2,3,0."]
    for name in ("HA", "HB"):
        place, angles = dummies[f"{name}1"], dummies[f"{name}2"]
        held += [f"{place},1,3,0.", f"{angles},1,1,0.", f"{angles},2,2,{shrink:.12g}"]
    held += [f"{dummies['HA2']},3,3,0."]
    flat, bent = ([f"{dummies['ONE']},1,1,{bend:g}"] for bend in (0.0, abs(SIDES[ends])))
    pull = f"{dummies['B1']},1,{case.tension_force:.12g}"
    weight = ["*DLOAD", f"BELT,GRAV,{case.rig.gravity:g},0.,0.,-1."] if case.rig.gravity else []
    turn = f"{dummies['HB2']},3"
    still = [*held, f"{dummies['HB2']},3,3,0."]
    lines = _step(tolerance, "1.,1.", [*still, *flat], [pull], [])
    lines += _step(tolerance, "0.25,1.,1e-5,0.5", [*still, *bent], [pull], weight)
    if strains:
        lines += _step(tolerance, "0.02,1.,1e-6,0.05", [*still, *bent], [pull], [*weight, *strains], 2000)
    for couple in couples:
        lines += _step(tolerance, "1.,1.", [*held, *bent], [pull, f"{turn},{couple:.12g}"], [*weight, *strains])
    return lines


def _step(
    tolerance: float, times: str, held: list[str], loads: list[str], weight: list[str], increments: int = 200
) -> list[str]:
    """One step of the deck."""
    lines = [f"*STEP,NLGEOM,INC={increments}", "*STATIC,SOLVER=SPOOLES", times, _CONTROLS.format(tolerance)]
    lines += ["*BOUNDARY,OP=NEW", *held, "*CLOAD,OP=NEW", *loads, *weight]
    return [*lines, "*NODE PRINT,NSET=OUT", "U", "*NODE PRINT,NSET=DUM", "U,RF", "*END STEP"]


SMALL = 0.0042 * DEGREE  # [rad], a turn at which every law is linear
_answers = jit_float64(span_responses)


@dataclass(frozen=True)
class SpanState:
    """A span after its run-up end was turned: turn [rad]; entry and carried moment [N m]; tilt of mid-span [rad]."""

    turn: float
    entry: float
    carried: float
    tilt: float

    @property
    def stiffness(self) -> np.ndarray:
        """(entry, carry-over, tilt) per radian."""
        return np.array([self.entry, self.carried, self.tilt]) / self.turn


def by_law(case: Case, ends: str, residual: float = 0.0) -> np.ndarray:
    """(entry, carry-over [N m/rad], tilt [rad/rad]) of the strip law, with the bending layer for ends on pulleys.

    residual: residual stress [Pa] in the middle of the width.
    """
    span = Flatness(amplitude=residual).span(strip(case), case)
    answer = _answers(case, (LiftOff(),) if SIDES[ends] else (), span)
    row = 1 if ends == "lower" else 0
    stiffness = span.bending * np.array([answer.runup[row, 2], -answer.runoff[row, 2]])
    return np.array([*stiffness, float(answer.mid_tilt[row, 2])])


def by_shell(
    case: Case, turns: Sequence[float], ends: str, folder: Path, mesh: Mesh | None = None, residual: float = 0.0
) -> list[SpanState]:
    """The span turned by couples that would turn the strip law's by ``turns`` [rad], as far as CalculiX comes."""
    couples = [float(by_law(case, ends, residual)[0]) * t for t in turns]
    deck = span_deck(case, couples, ends, mesh, residual)
    name = f"span_{ends}_{case.settings.tension / 1e6:g}_{residual / 1e6:g}"
    return span_states(deck, ccx.run(folder, name, deck.text), couples, at_rest=3.0 if residual else 2.0)


def span_states(
    deck: SpanDeck, printed: Sequence[ccx.PrintedTable], couples: Sequence[float], at_rest: float = 2.0
) -> list[SpanState]:
    """The states after gravity, less that at time ``at_rest``, before the couples; none where CalculiX broke off."""
    tables = {(p.quantity, p.nodes, round(p.time, 6)): p.values for p in printed}
    if ("displacements", "OUT", at_rest) not in tables:
        return []
    rest = _state(deck, tables, at_rest, 0.0)
    states = [
        _state(deck, tables, at_rest + 1.0 + k, couple)
        for k, couple in enumerate(couples)
        if ("displacements", "OUT", at_rest + 1.0 + k) in tables
    ]
    return [SpanState(s.turn - rest.turn, s.entry, s.carried - rest.carried, s.tilt - rest.tilt) for s in states]


def _state(deck: SpanDeck, tables: dict[Any, Any], at: float, couple: float) -> SpanState:
    held = tables["displacements", "DUM", at][deck.dummies["B2"]]
    carried = tables["forces", "DUM", at][deck.dummies["HA2"]]
    shape, belt = tables["displacements", "OUT", at], deck.belt
    rows = [i for i in range(deck.first, deck.last + 1) if belt.node(i, 0) in shape and 0 in belt.row(i)]
    x, tilt = [], []
    for i in rows:
        one, other = shape[belt.node(i, 0)], shape[belt.node(i, -1)]
        x.append(belt.x[i] + (one[0] + other[0]) / 2)
        across = belt.y[-1] - belt.y[0] + other[1] - one[1]
        tilt.append(np.arctan2(other[2] - one[2], across))
    return SpanState(float(held[2]), couple, float(carried[2]), float(np.interp((x[0] + x[-1]) / 2, x, tilt)))


def span_study(config: dict[str, Any]) -> None:
    """The table."""
    if not ccx.is_installed():
        print(f"skipped: {ccx.MISSING}")
        return
    columns = [f"{what}, {who}" for what in ("entry", "carry-over", "tilt") for who in ("shell", "law")]
    table = Table("N/mm2", "ends", "residual", *columns, "shell over law in %", "s")
    mesh = Mesh(**config["mesh"])
    for tension in config["tensions"]:
        case = case_from(config | {"tension": tension})
        for ends, residual in product(config["ends"], config["residual"]):
            begun, stress = time.perf_counter(), residual * N_PER_MM2
            states = by_shell(case, [SMALL], ends, Path(config["out"]), mesh, stress)
            if not states:
                print(f"{tension:g} N/mm2, {ends}, {residual:g}: no equilibrium that CalculiX finds", flush=True)
                continue
            shell, law = states[0].stiffness, by_law(case, ends, stress)
            cells = [f"{v:.1f}" if k < 2 else f"{v:.3f}" for k in range(3) for v in (shell[k], law[k])]
            apart = " ".join(f"{100 * (s / w - 1):+.2f}" for s, w in zip(shell, law, strict=True))
            table.add_row(f"{tension:g}", ends, f"{residual:g}", *cells, apart, f"{time.perf_counter() - begun:.0f}")
            print(f"{tension:g} N/mm2, {ends}, residual {residual:g}: {apart}", flush=True)  # a row may take minutes
    Console(width=150).print(table)


if __name__ == "__main__":
    application("shell_span", span_study)
