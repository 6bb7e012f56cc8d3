"""Fig. 19: different types of bond arrangement: what they resist, and how belts made of them run."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.case import Case
from belt_sim.show import style
from belt_sim.show.style import AMBER, BLUE, FAINT, INK, PINK
from belt_sim.space.mesh import Lattice, calibrate
from studies.paper import drawing
from studies.paper.models import LOOKS, case_at, moving, y_mm
from studies.paper.plate import Plate, column
from studies.paper.stored_runs import stored_run

NUMBER, TITLE = 19, "Different types of bond arrangement"
TENSION, CHORD, PIECE = 40.0, 0.04, 0.48  # [N/mm2]; [m] between particles; [m], the piece that is drawn
#: bonds -> (stored run, name, colour)
ARRANGEMENTS = {
    ("longitudinal",): ("grid_40_lines", "longitudinal", PINK),
    ("longitudinal", "transverse"): ("grid_40_square", "longitudinal and transverse", AMBER),
    ("longitudinal", "transverse", "diagonal"): ("grid_40", "longitudinal, transverse and diagonal", BLUE),
}
WITHOUT, ALL = (name for _, name, _ in [*ARRANGEMENTS.values()][1:])
DRAWN_AT = 0.08  # [m], the deflection of the softest piece in the drawing


ACROSS = 2  # lines of particles


@dataclass(frozen=True, kw_only=True)
class PushedSpan:
    """rest, moved (n, 2, 2): x and y [m] of the particles of both lines; force [N] in its middle."""

    rest: np.ndarray
    moved: np.ndarray
    force: float

    @property
    def give(self) -> float:
        """Deflection of its middle per newton [m/N]."""
        middle = len(self.rest) // 2
        return float((self.moved - self.rest)[middle, :, 1].mean()) / self.force


def pushed_span(case: Case, chord: float, bonds: tuple[str, ...], force: float = 1.0) -> PushedSpan:
    """Equilibrium in the plane, linear about the belt at its tension, whose pull the lines carry.

    A bond with stiffness k and pull P answers a stretch with k and a turn with P / length.
    """
    stations = 2 * round(0.5 * float(case.rig.span_length) / chord) + 1
    lattice = calibrate(case.belt, chord, ACROSS, bonds)
    y = 0.5 * lattice.width * np.array([-1.0, 1.0])
    rest = np.stack(np.broadcast_arrays(np.arange(stations)[:, None] * chord, y), axis=2)
    stiffness = _stiffness_matrix(rest, _bonds(stations, lattice, bonds, 0.5 * float(case.tension_force)))
    load = np.zeros((stations, ACROSS, 2))
    load[stations // 2, :, 1] = force / ACROSS
    free = np.ones(load.shape, bool)
    free[[0, -1]] = False
    moved, flat = np.zeros(load.size), free.ravel()
    moved[flat] = np.linalg.solve(stiffness[np.ix_(flat, flat)], load.ravel()[flat])
    return PushedSpan(rest=rest, moved=rest + moved.reshape(rest.shape), force=force)


def _bonds(stations: int, lattice: Lattice, bonds: tuple[str, ...], pull: float) -> list[tuple[int, int, float, float]]:
    """(node, node, EA [N], pull [N]) of every bond; node = 2 station + line."""
    found = [(2 * i + j, 2 * i + 2 + j, lattice.lines / ACROSS, pull) for i in range(stations - 1) for j in (0, 1)]
    if lattice.transverse:
        found += [(2 * i, 2 * i + 1, lattice.transverse, 0.0) for i in range(stations)]
    if lattice.diagonal:
        pairs = [(2 * i + j, 2 * i + 3 - j) for i in range(stations - 1) for j in (0, 1)]
        found += [(a, b, lattice.diagonal, 0.0) for a, b in pairs]
    return found


def _stiffness_matrix(rest: np.ndarray, bonds: list[tuple[int, int, float, float]]) -> np.ndarray:
    """Stiffness [N/m] of all particles, x and y of one after the other."""
    places = rest.reshape(-1, 2)
    whole = np.zeros((places.size, places.size))
    for a, b, stretch, pull in bonds:
        way = places[b] - places[a]
        length = float(np.hypot(*way))
        along = np.outer(way, way) / length**2
        block = stretch / length * along + pull / length * (np.eye(2) - along)
        for p, q, sign in ((a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)):
            whole[2 * p : 2 * p + 2, 2 * q : 2 * q + 2] += sign * block
    return whole


def plate(in_space: bool = True) -> Plate:
    """Give of a piece and of a whole span, by statics; stored runs of the three belts on the whole test rig."""
    numbers: dict = {"tension_N_per_mm2": TENSION, "distance_of_particles_m": CHORD}
    pieces = {}
    for bonds, (run, name, _) in ARRANGEMENTS.items():
        whole, pieces[name] = _span_or_piece(bonds, None), _span_or_piece(bonds, PIECE)
        curves = stored_run(run).curves
        numbers[name] = {
            "piece_give_um_per_N": 1e6 * pieces[name].give,
            "span_give_um_per_N": 1e6 * whole.give,
            "travel_m": column(curves.travel),
            "y1_mm": column(y_mm(curves.y[0])),
        }
    least, most = (numbers[n]["piece_give_um_per_N"] for n in (ALL, WITHOUT))
    caption = (
        f"Two lines of particles {1e3 * CHORD:g} mm apart at {TENSION:g} N/mm2. Above: a piece of {PIECE:g} m, its "
        "ends held, pushed sideways by 1 N in its middle (statics of the bonds, all at the same enlargement): without "
        f"diagonals it gives {most / least:.0f} times as much. Below: such belts on the whole test rig after a yaw of "
        "-0.042 degrees, point 1 in 3D: without diagonals they run like a rope, with them like a strip."
    )
    runs = tuple(run for run, _, _ in ARRANGEMENTS.values())
    return Plate(number=NUMBER, title=TITLE, caption=caption, numbers=numbers, stored=runs,
                 draw=lambda p: _draw(p, numbers, pieces))  # fmt: skip


def _span_or_piece(bonds: tuple[str, ...], length: float | None) -> PushedSpan:
    """The whole span of the test rig, or a piece of it [m]."""
    case = case_at(TENSION)
    if length is not None:
        case = replace(case, rig=replace(case.rig, centre_distance=length))
    return pushed_span(case, CHORD, bonds)


@style.picture
def _draw(path: Path, n: dict, pieces: dict[str, PushedSpan]) -> Path:
    names = [name for _, name, _ in ARRANGEMENTS.values()]
    fig, axes = drawing.mosaic(9.6, 6.6, [names, ["runs"] * 3], height_ratios=[0.85, 1.7])
    enlarged = DRAWN_AT / max(p.give for p in pieces.values())
    for bonds, (_, name, colour) in ARRANGEMENTS.items():
        _piece(axes[name], pieces[name], bonds, enlarged, colour)
        axes[name].set_title(f"{name}\n{n[name]['piece_give_um_per_N']:.2g} µm/N", fontsize=style.FONT)
        look: dict[str, Any] = {"markersize": 3.4, "markeredgewidth": 0.0}
        if bonds == ("longitudinal",):  # it runs as the next one does, which would hide it
            look = {"markersize": 7.0, "markerfacecolor": "none"}
        axes["runs"].plot(n[name]["travel_m"][::2], n[name]["y1_mm"][::2], "o", color=colour, label=f"bonds {name}",
                          zorder=3, **look)  # fmt: skip
    end = max(n[name]["travel_m"][-1] for name in names)
    for model in ("rope", "strip"):
        law = moving(model, TENSION)
        near = np.asarray(law.travel) <= end + 1e-9
        line = {"color": FAINT if model == "rope" else INK, "linewidth": 1.4, "label": LOOKS[model].words}
        axes["runs"].plot(np.asarray(law.travel)[near], y_mm(np.asarray(law.y)[0, near]), **line)
    drawing.zero_line(axes["runs"])
    axes["runs"].set(xlabel=drawing.TRAVEL_LABEL, ylabel="lateral position y of point 1 [mm]")
    axes["runs"].legend(loc="upper left")
    style.title(fig, f"{TITLE}: {TENSION:g} N/mm²")
    return style.save(fig, path)


def _piece(ax, piece: PushedSpan, bonds: tuple[str, ...], enlarged: float, colour: str) -> None:
    """Particles and bonds, where they lie and where the push takes them."""
    place = piece.rest + (piece.moved - piece.rest) * [0.0, enlarged]
    ties = [(0, 0, 1, 0), (0, 1, 1, 1)]
    ties += [(0, 0, 0, 1)] if "transverse" in bonds else []
    ties += [(0, 0, 1, 1), (0, 1, 1, 0)] if "diagonal" in bonds else []
    for i in range(len(place)):
        for a, j, b, k in ties:
            if i + b < len(place):
                ax.plot(*np.stack([place[i + a, j], place[i + b, k]]).T, color=colour, linewidth=1.0, zorder=2)
    ax.plot(*piece.rest.reshape(-1, 2).T, "o", color=FAINT, markersize=3, zorder=1)
    ax.plot(*place.reshape(-1, 2).T, "o", color=INK, markersize=4, zorder=3)
    drawing.bare(ax)
    width = float(np.ptp(piece.rest[..., 1]))
    ax.set(xlim=(-0.02, PIECE + 0.02), ylim=(-0.5 * width - 0.02, 0.5 * width + DRAWN_AT + 0.02))
