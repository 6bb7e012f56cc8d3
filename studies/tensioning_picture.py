"""A belt being tensioned by pulleys that move apart: seen from the side, and tension and sag on the way."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from belt_sim.curves import Frame
from belt_sim.show import style
from belt_sim.show.style import BLUE, FAINT, GREEN, INK, RED
from belt_sim.si import MM, N_PER_MM2

_SHOWN = (("ring", RED), ("half way", GREEN), ("tight", BLUE))


@style.picture
def tensioning_picture(
    path: str | os.PathLike, frames: Sequence[Frame], radii: tuple[float, float], title: str
) -> Path:
    """frames: of the procedure, in order; radii of head and tail pulley [m]."""
    fig, [[side], [curve]] = style.figure(8.4, 5.6, 2, 1, height_ratios=[3, 2])
    x = np.array([f.tail_x for f in frames])
    half = int(np.argmin(np.abs(x - 0.5 * (x[0] + x[-1]))))
    for k, (name, colour) in zip((0, half, len(frames) - 1), _SHOWN, strict=True):
        label = f"{name}: {frames[k].tail_x / MM:.0f} mm apart"
        side.plot(frames[k].left[:, 0], frames[k].left[:, 2], color=colour, label=label)
        side.plot(frames[k].tail_x, 0.0, "+", color=colour)
    turn = np.linspace(0.0, 2.0 * np.pi, 100)
    for middle, radius in ((0.0, radii[0]), (x[-1], radii[1])):
        side.plot(middle + radius * np.sin(turn), radius * np.cos(turn), color=FAINT, linewidth=0.8)
    side.set_aspect("equal")
    side.set(xlabel="x [m]", ylabel="z [m]")
    side.legend(loc="upper center", bbox_to_anchor=(0.5, 1.35), ncols=len(_SHOWN))
    travel = np.array([f.travel - frames[0].travel for f in frames])
    tension = np.array([f.scalars["tension"] for f in frames]) / N_PER_MM2
    sag = np.array([0.5 * (f.scalars["sag_upper"] + f.scalars["sag_lower"]) for f in frames]) / MM
    curve.semilogy(travel, tension, color=INK)
    curve.set(xlabel="travel of the drive [m]", ylabel="tension [N/mm$^2$]")
    beside = curve.twinx()
    beside.plot(travel, sag, color=GREEN)
    beside.grid(visible=False)
    beside.set_ylabel("sag, mean of both spans [mm]", color=GREEN)
    style.title(fig, title)
    return style.save(fig, path)
