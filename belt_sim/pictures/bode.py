"""The plant's frequency response: how far and how late each point follows the yaw."""

import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from belt_sim.pictures import style
from belt_sim.pictures.colours import POINT_NAMES, POINTS
from belt_sim.si import DEGREE, MM, N_PER_MM2

if TYPE_CHECKING:  # it takes SciPy's linear systems, which no other picture needs
    from belt_sim.linear.state_space import StateSpace


@style.picture
def bode_picture(path: str | os.PathLike, space: "StateSpace", highest: float) -> Path:
    """Gain [mm per degree of tail yaw] and phase [degrees] of points 1-4 up to ``highest`` [rad/m].

    Lines: exact, delays kept; dots: the state space.
    """
    k = np.geomspace(highest / 1e3, highest, 240)
    exact, dots = space.plant.response(k)[:, :, 0], space.response(k[::12])[:, :, 0]
    fig, axes = style.figure(8.0, 6.0, 2, 1, sharex=True)
    gain, phase = axes[0][0], axes[1][0]
    for n, colour in enumerate(POINTS):
        gain.loglog(k, np.abs(exact[:, n]) * DEGREE / MM, color=colour, label=POINT_NAMES[n])
        gain.loglog(k[::12], np.abs(dots[:, n]) * DEGREE / MM, "o", color=colour, markersize=3)
        turned = np.degrees(np.unwrap(np.angle(exact[:, n])))
        phase.semilogx(k, turned, color=colour)
        shown = turned[::12] + np.degrees(np.angle(dots[:, n] / exact[::12, n]))
        phase.semilogx(k[::12], shown, "o", color=colour, markersize=3)
    gain.set_ylabel("y per yaw [mm/degree]")
    gain.legend(loc="best", labelcolor="linecolor")
    phase.set_ylabel("phase [degrees]")
    phase.set_xlabel("wavenumber of the yaw [rad per metre of travel]")
    plant = space.plant
    style.title(fig, f"Yaw of the tail pulley to points 1-4: {plant.model}, {plant.tension / N_PER_MM2:g} N/mm2")
    return style.save(fig, path)
