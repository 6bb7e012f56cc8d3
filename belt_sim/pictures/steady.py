"""Steady rates of a campaign against tension, measured and modelled."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from belt_sim import si
from belt_sim.pictures.rates import Rates, rates_picture
from belt_sim.results.errors import SteadyError


def steady_picture(path: str | os.PathLike, rows: Sequence[SteadyError], name: str, title: str) -> Path:
    """Late rate of the first measured point; name: of the model."""
    point = min(r.point for r in rows)
    mine = sorted((r for r in rows if r.point == point), key=lambda r: r.tension)
    tension = np.array([r.tension for r in mine]) / si.N_PER_MM2
    modelled, measured, u = np.array([(r.modelled, r.measured, r.u) for r in mine]).T / si.MM_PER_M
    shown = {name: Rates(tension=tension, rate=modelled)}
    return rates_picture(path, shown, title, measured=Rates(tension=tension, rate=measured, u=u))
