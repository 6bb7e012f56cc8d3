"""The span's stiffnesses by shell elements beside the strip law: ``python -m studies.shell.span``.

Entry moment and carry-over in N m per rad of in-plane turn at the run-up, mid-span tilt in rad per rad, for small
turns: hinged ends beside ``strip``, ends that lie on the pulleys up to lift-off beside ``strip_lift_off``.
"""

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
from belt_sim.effects.contact import LiftOff
from belt_sim.effects.span import Flatness
from belt_sim.jax_setup import jit_float64
from belt_sim.line.span import strip
from belt_sim.line.spans import span_responses
from belt_sim.settings import case_from
from belt_sim.units import DEGREE, N_PER_MM2
from studies.application import application
from studies.shell import ccx
from studies.shell.span_deck import SIDES, Mesh, SpanDeck, span_deck

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
    case: Case,
    turns: Sequence[float],
    ends: str,
    folder: Path,
    mesh: Mesh | None = None,
    residual: float = 0.0,
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
    console = Console(width=150)
    console.print(table)


if __name__ == "__main__":
    application("shell_span", span_study)
