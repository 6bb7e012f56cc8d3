"""The run-up law by shell elements: ``python -m studies.shell.roll``, a belt that rolls onto a yawed pulley.

Contact and friction lay the belt; its line on the pulley, y(s) and its direction alpha(s) against the pulley, is read
off. The run-up law says dy/ds = alpha, dalpha/ds = kappa, the curvature that the free part has where it comes to lie.
Compared twice: alpha and dalpha/ds of the laid line with kappa of the beam that the measured y and alpha belong to, and
y with the law marched from the yaw on. The free part begins where contact begins, l before the tangent point.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.integrate import solve_ivp

from belt_sim.analytic.steady import sievers_coefficients
from belt_sim.case import Case
from belt_sim.config import case_from
from belt_sim.laws.span import torsional_stiffness
from belt_sim.pictures import style
from belt_sim.pictures.colours import BLUE, INK, RED
from studies.application import application
from studies.shell import ccx
from studies.shell.roll_deck import Roll, RollDeck, roll_deck
from studies.shell.span_deck import layer

SHEAR_FACTOR = 5 / 6
UM, URAD = 1e-6, 1e-6


@dataclass(frozen=True)
class Laid:
    """The line that a belt took on its pulley: arc [m] from the clamped end, y [m], alpha [rad], curvature [1/m]."""

    arc: np.ndarray
    y: np.ndarray
    alpha: np.ndarray
    curvature: np.ndarray


def laid_line(deck: RollDeck, shape: dict[int, np.ndarray], radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Arc [m] and y [m] of the centre line's nodes, also of those that still hang."""
    belt = deck.belt
    place = np.array([[belt.x[i], 0.0, 0.0] + shape[belt.node(i, belt.middle)] for i in range(len(belt.x))])
    return np.arctan2(place[:, 0], place[:, 2] + radius) * radius, place[:, 1]


def smooth(arc: np.ndarray, y: np.ndarray, window: float, at: np.ndarray) -> Laid:
    """Value, slope and curvature of the parabola that fits y best within ``window`` [m] round each place."""
    rows = []
    for s in at:
        near = np.abs(arc - s) <= window / 2
        c = np.polyfit(arc[near] - s, y[near], 2)
        rows.append((c[2], c[1], 2 * c[0]))
    return Laid(at, *np.array(rows).T)


def curvature(case: Case, arc: Any, y: Any, alpha: Any, *, lifts: bool = True) -> Any:
    """kappa [1/m] of the free part where it comes to lie at ``arc``: beam under tension, with shear at first order.

    ``lifts``: the bending layer lets the free part begin at alpha + (l^3/8R^2) M/T (docs/lift_off.md).
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
    lean = layer(case) ** 3 / (8 * case.rig.tail_radius**2) * belt.bending_stiffness / torsional_stiffness(case)
    return stuck / (1 + lean * per_alpha / free) if lifts else stuck


def turned_by_slip(case: Case, friction: float) -> float:
    """z [m] = 4 R |M| / (mu F b): the arc on which the belt slips after the yaw, M its entry moment."""
    moment = case.belt.bending_stiffness * abs(float(curvature(case, 0.0, 0.0, 0.0)))
    return 4 * case.rig.tail_radius * moment / (friction * case.tension_force * case.belt.width)


def marched(case: Case, roll: Roll, arc: np.ndarray) -> np.ndarray:
    """y [m] of the run-up law at ``arc``, begun where contact ends at the yaw, turned once by slip M z / 2 EI."""
    begin = roll.laid - layer(case)
    turned = float(curvature(case, begin, 0.0, 0.0)) * turned_by_slip(case, roll.friction) / 2

    def law(s: float, state: np.ndarray) -> list[float]:
        return [state[1], float(curvature(case, s, state[0], state[1]))]

    found = solve_ivp(law, (begin, float(arc[-1])), [0.0, turned], rtol=1e-9, atol=1e-15, dense_output=True)
    return found.sol(arc)[0]


def rolled(case: Case, roll: Roll, folder: Path, limit: float) -> tuple[np.ndarray, np.ndarray]:
    """Arc and y of the centre line when it has rolled as far as CalculiX came."""
    deck = roll_deck(case, roll)
    yaw = float(case.settings.yaw.last())
    name = f"roll_{'plus' if yaw > 0 else 'minus'}_{roll.friction:g}_{roll.row * 1e3:g}_{roll.across}"
    printed = [p for p in ccx.run(folder, name, deck.text, limit) if p.quantity == "displacements"]
    share = min(printed[-1].time - 3.0, 1.0)
    arc, y = laid_line(deck, printed[-1].values, case.rig.tail_radius)
    far = roll.laid + share * roll.rolled - layer(case) - roll.row
    return arc[arc <= far], y[arc <= far]


def roll_study(config: dict[str, Any]) -> None:
    """The table, and the picture."""
    if not ccx.installed():
        print(f"skipped: {ccx.MISSING}")
        return
    roll = Roll(**config["roll"])
    table = Table("yaw deg", "s mm", "y um", "law um", "alpha urad", "dalpha/ds 1/km", "kappa 1/km", "ratio")
    lines = {}
    for yaw in config["yaws"]:
        case = case_from(config | {"yaw": yaw})
        arc, y = rolled(case, roll, Path(config["out"]), config["limit"])
        after = arc >= roll.laid - layer(case) + config["window"] / 2
        at = np.arange(arc[after][0], arc[-1] - config["window"] / 2, config["window"])
        line = smooth(arc, y, config["window"], at)
        law, kappa = marched(case, roll, at), curvature(case, at, line.y, line.alpha)
        for k, s in enumerate(at):
            cells = (s * 1e3, line.y[k] / UM, law[k] / UM, line.alpha[k] / URAD, line.curvature[k] * 1e3)
            table.add_row(
                f"{yaw:g}", *(f"{c:.2f}" for c in (*cells, kappa[k] * 1e3)), f"{line.curvature[k] / kappa[k]:.3f}"
            )
        lines[yaw] = (arc, y, marched(case, roll, arc[after]), arc[after])
        slips = 1e3 * turned_by_slip(case, roll.friction)
        print(f"yaw {yaw:g} deg: slips on {slips:.1f} mm, rolled to {arc[-1] * 1e3:.0f} mm")
    Console(width=120).print(table)
    if config["picture"]:
        print(picture(config["picture"], lines))


@style.picture
def picture(path: str | Path, lines: dict[float, tuple[np.ndarray, ...]]) -> Path:
    """The laid line of shell elements over the run-up law."""
    fig, [[ax]] = style.figure(7.5, 4.2)
    for colour, (yaw, (arc, y, law, after)) in zip((BLUE, RED), lines.items(), strict=False):
        ax.plot(after * 1e3, law / UM, color=colour, alpha=0.3, linewidth=6.0, label=f"run-up law, yaw {yaw:g} deg")
        ax.plot(arc * 1e3, y / UM, "o", color=INK, markersize=2.5, label=f"shell, yaw {yaw:g} deg")
    ax.set(xlabel="arc of the pulley on which the belt came to lie [mm]", ylabel="lateral place of the belt [um]")
    ax.legend()
    return style.save(fig, path)


if __name__ == "__main__":
    application("shell_roll", roll_study)
