"""The plant's frequency response: how far and how late each point follows the yaw."""

import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from belt_sim.pictures import style
from belt_sim.pictures.style import POINT_NAMES, POINTS
from belt_sim.si import DEGREE, MM, N_PER_MM2

if TYPE_CHECKING:  # it takes SciPy's linear systems, which no other picture needs
    from belt_sim.linear.plant import StateSpace

_LINES = ("-", "--", "-", "--")  # points 1 and 2 lie close together, and so do 3 and 4


@style.picture
def bode_picture(path: str | os.PathLike, space: "StateSpace", highest: float) -> Path:
    """Gain [mm per degree of tail yaw] and phase [degrees] of points 1-4 over rad/s at the plant's speed.

    highest: wavenumber [rad/m] up to which it is drawn. Lines: delays exact; dots: the state space.
    """
    plant = space.plant
    k = np.geomspace(highest / 1e3, highest, 240)
    at = slice(None, None, 16)
    exact, rational = plant.response(k)[:, :, 0], space.response(k[at])[:, :, 0]
    w = k * plant.speed
    fig, [[gain], [phase]] = style.figure(8.0, 6.4, 2, 1, sharex=True)
    for n, colour in enumerate(POINTS):
        gain.loglog(w, np.abs(exact[:, n]) * DEGREE / MM, _LINES[n], color=colour, label=POINT_NAMES[n])
        gain.loglog(w[at], np.abs(rational[:, n]) * DEGREE / MM, "o", color=colour, markersize=3)
        turned = np.degrees(np.unwrap(np.angle(exact[:, n])))
        turned -= 360.0 * np.round((turned[0] + 90.0) / 360.0)  # an integrator begins at -90 or at 90 degrees
        phase.semilogx(w, turned, _LINES[n], color=colour)
        shown = turned[at] + np.degrees(np.angle(rational[:, n] / exact[at, n]))
        phase.semilogx(w[at], shown, "o", color=colour, markersize=3)
    gain.plot([], [], "o", color="black", markersize=3, label=f"state space ({space.delay}, order {space.order})")
    gain.set_ylabel("belt position per yaw [mm/degree]")
    gain.legend(loc="best", labelcolor="linecolor")
    low, high = phase.get_ylim()
    step = 90.0 * max(1, round((high - low) / 90.0 / 8.0))
    phase.set_yticks(np.arange(step * np.floor(low / step), high + step, step))
    phase.set_ylabel("phase [degrees]")
    phase.set_xlabel(f"frequency of the yaw [rad/s] at {plant.speed:g} m/s")
    effort = f"{plant.tension / N_PER_MM2:g} N/mm2"
    return style.finish(fig, path, f"Belt position at points 1-4 per yaw of the tail pulley ({plant.model}, {effort})")
