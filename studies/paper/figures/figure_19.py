"""Fig. 19: different types of bond arrangement: what they resist, and how belts made of them run."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.pictures import style
from belt_sim.pictures.colours import AMBER, BLUE, FAINT, INK, PINK
from studies.paper import canvas
from studies.paper.frame import y_mm
from studies.paper.lattice_span import PushedSpan, pushed_span
from studies.paper.models import LOOKS, case_at, moving
from studies.paper.plate import Plate, View, column
from studies.paper.stored import stored

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


def plate(view: View) -> Plate:
    """Give of a piece and of a whole span, by statics; stored runs of the three belts on the whole test rig."""
    numbers: dict = {"tension_N_per_mm2": TENSION, "distance_of_particles_m": CHORD}
    pieces = {}
    for bonds, (run, name, _) in ARRANGEMENTS.items():
        whole, pieces[name] = _pushed(bonds, None), _pushed(bonds, PIECE)
        curves = stored(run).curves
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


def _pushed(bonds: tuple[str, ...], length: float | None) -> PushedSpan:
    """The whole span of the test rig, or a piece of it [m]."""
    case = case_at(TENSION)
    if length is not None:
        case = replace(case, rig=replace(case.rig, centre_distance=length))
    return pushed_span(case, CHORD, bonds)


@style.picture
def _draw(path: Path, n: dict, pieces: dict[str, PushedSpan]) -> Path:
    names = [name for _, name, _ in ARRANGEMENTS.values()]
    fig, axes = canvas.mosaic(9.6, 6.6, [names, ["runs"] * 3], height_ratios=[0.85, 1.7])
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
    canvas.zero_line(axes["runs"])
    axes["runs"].set(xlabel=canvas.TRAVEL_LABEL, ylabel="lateral position y of point 1 [mm]")
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
    canvas.bare(ax)
    width = float(np.ptp(piece.rest[..., 1]))
    ax.set(xlim=(-0.02, PIECE + 0.02), ylim=(-0.5 * width - 0.02, 0.5 * width + DRAWN_AT + 0.02))
