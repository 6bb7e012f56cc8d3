"""M3: once moving, a slack belt runs faster: as a steady rate, and as a record of 10 to 15 m shows it."""

from collections.abc import Callable

from studies.paper.statements.behaviour import Behaviour
from studies.paper.statements.judgement import NOT_ADDRESSED, Judgement, Statement

SLACK, TIGHT = (7.0, 10.0), 40.0  # [N/mm2]
A_LOT = 1.2  # times the rate at TIGHT
READ = (10.0, 15.0)  # [m]


def judge_steady(model: Behaviour, beam: Behaviour) -> Judgement:
    """Late rates."""
    return _faster(lambda t: model.rate[t]) if {*SLACK, TIGHT} <= set(model.rate) else NOT_ADDRESSED


def judge_read(model: Behaviour, beam: Behaviour) -> Judgement:
    """Slopes over READ."""
    return _faster(lambda t: model.slope(*READ, t)) if {*SLACK, TIGHT} <= set(model.y) else NOT_ADDRESSED


def _faster(rate: Callable[[float], float]) -> Judgement:
    own = [rate(t) / rate(TIGHT) for t in SLACK]
    return Judgement.of(min(own) >= A_LOT, f"{own[0]:.2f} and {own[1]:.2f} times the rate at 40")


M3 = Statement(
    name="M3",
    about="faster for good",
    says="once it runs, a slack belt runs much faster sideways than a tight one",
    criterion=f"steady rate at 7 and at 10 N/mm2: both at least {A_LOT:g} times that at 40",
    judge=judge_steady,
)
M3_READ = Statement(
    name="M3, read early",
    about="faster over 10 to 15 m",
    says="the same, if the rates were read while the belt was still in its transient",
    criterion=f"mean slope of point 1 from {READ[0]:g} to {READ[1]:g} m at 7 and at 10 N/mm2: both at least "
    f"{A_LOT:g} times that at 40",
    judge=judge_read,
)
