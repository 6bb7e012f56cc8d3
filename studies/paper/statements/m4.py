"""M4: at 20 to 40 N/mm2 the beam of 2nd order is quite realistic for the steady rate."""

from studies.paper.statements.behaviour import Behaviour
from studies.paper.statements.judgement import NOT_ADDRESSED, Judgement, Statement

TENSIONS = (20.0, 40.0)  # [N/mm2]
QUITE = 0.2  # of the beam's rate


def judge(model: Behaviour, beam: Behaviour) -> Judgement:
    """The model's steady rates are near the beam's."""
    if not set(TENSIONS) <= set(model.rate):
        return NOT_ADDRESSED
    off = [model.rate[t] / beam.rate[t] - 1.0 for t in TENSIONS]
    return Judgement.of(max(map(abs, off)) <= QUITE, f"{100 * off[0]:+.0f} % at 20, {100 * off[1]:+.0f} % at 40")


M4 = Statement(
    name="M4",
    about="rate at 20 to 40 N/mm2",
    says="at 20 to 40 N/mm2 the beam of 2nd order gives rates that one may use",
    criterion=f"steady rate at 20 and at 40 N/mm2 within {100 * QUITE:g} % of that of the beam of 2nd order",
    judge=judge,
)
