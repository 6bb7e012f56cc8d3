"""M1: at 40 N/mm2 beam of 2nd order and measurement are apart, but of one kind."""

import numpy as np

from studies.paper.statements.behaviour import GRID, Behaviour
from studies.paper.statements.judgement import CONTRADICTED, NOT_ADDRESSED, SILENT, Judgement, Statement

TENSION = 40.0  # [N/mm2]
SEEN = 0.02  # of the largest y_1: a line's width or two in a diagram of the paper's size
ALIKE = 0.9  # correlation of the slopes


def judge(model: Behaviour, beam: Behaviour) -> Judgement:
    """A model that is unlike the beam, or cannot be told from it, fails; whether another is right cannot be said."""
    if TENSION not in model.y:
        return NOT_ADDRESSED
    apart = np.abs(model.y[TENSION] - beam.y[TENSION]).max() / np.abs(beam.y[TENSION]).max()
    slopes = [np.gradient(b.y[TENSION], GRID) for b in (model, beam)]
    alike = float(np.corrcoef(slopes)[0, 1]) if np.ptp(slopes[0]) > 0.0 else 0.0
    number = f"{100 * apart:.1f} % apart, alike {alike:.2f}"
    return Judgement(SILENT if apart >= SEEN and alike >= ALIKE else CONTRADICTED, number)


M1 = Statement(
    name="M1",
    about="alike at 40 N/mm2",
    says="at 40 N/mm2 measurement and beam are clearly apart, but of one kind",
    criterion=(
        f"point 1 over 25 m: contradicted where it is less than {100 * SEEN:g} % of the beam's largest y apart from "
        f"the beam of 2nd order, or its slopes are correlated with the beam's by less than {ALIKE:g}; else not "
        "addressed: by how much, and to which side, the measurement differs is not in the paper's text"
    ),
    judge=judge,
)
