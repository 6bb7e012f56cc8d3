"""M2: at 7 and 10 N/mm2 the belt starts more slowly, and not as the beam of 2nd order says."""

from studies.paper.statements.behaviour import Behaviour
from studies.paper.statements.judgement import NOT_ADDRESSED, Judgement, Statement

SLACK, TIGHT = (7.0, 10.0), 40.0  # [N/mm2]
START = 3.0  # [m] of travel
SLOWER = 0.9  # of what the beam of 2nd order says


def judge(model: Behaviour, beam: Behaviour) -> Judgement:
    """y_1 at START over that at TIGHT: below the beam's, and the lower the slacker."""
    if not {*SLACK, TIGHT} <= set(model.y):
        return NOT_ADDRESSED
    own, beams = ([b.at(START, t) / b.at(START, TIGHT) for t in SLACK] for b in (model, beam))
    met = all(a <= SLOWER * b for a, b in zip(own, beams, strict=True)) and own[0] < own[1]
    return Judgement.of(met, f"{own[0]:.2f} and {own[1]:.2f} of the start at 40")


M2 = Statement(
    name="M2",
    about="slow start",
    says="at 7 and 10 N/mm2 the belt starts with less slope, the slacker the less, and the beam does not",
    criterion=(
        f"y of point 1 after {START:g} m at 7 and at 10 N/mm2, over that at 40: at most {SLOWER:g} times the same "
        "ratio of the beam of 2nd order, and smaller at 7 than at 10"
    ),
    judge=judge,
)
