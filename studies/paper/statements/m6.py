"""M6: rope and beam of 1st order bound all curves of the beam of 2nd order; here: of the model."""

import numpy as np

from studies.paper.models import MEASURED, moving
from studies.paper.statements.behaviour import GRID, Behaviour
from studies.paper.statements.judgement import NOT_ADDRESSED, Judgement, Statement

OUTSIDE = 0.01  # of the rope's largest y


def judge(model: Behaviour, beam: Behaviour) -> Judgement:
    """How far the model's curves leave the area between rope and beam of 1st order."""
    if not set(MEASURED) <= set(model.y):
        return NOT_ADDRESSED
    rope, first = (-np.interp(GRID, *_point_1(name)) for name in ("rope", "beam_th1"))
    y = np.stack([model.y[t] for t in MEASURED])
    out = max(float((y - rope).max()), float((first - y).max()), 0.0) / float(rope.max())
    return Judgement.of(out <= OUTSIDE, f"{100 * out:.1f} % outside")


def _point_1(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Neither of the two depends on tension."""
    curves = moving(name, MEASURED[-1])
    return np.asarray(curves.travel), np.asarray(curves.y)[0]


M6 = Statement(
    name="M6",
    about="within rope and Th 1. O",
    says="rope and beam of 1st order delimit an area in which all curves of the beam of 2nd order are",
    criterion=(
        "point 1 over 25 m at 7, 10, 20 and 40 N/mm2 leaves that area by at most "
        f"{100 * OUTSIDE:g} % of the rope's largest y (the paper says it of the beam of 2nd order alone)"
    ),
    judge=judge,
)
