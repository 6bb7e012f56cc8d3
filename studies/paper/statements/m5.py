"""M5: below 20 N/mm2 the catenary is visible, and yawing tilts the belt."""

from studies.paper.models import case_at
from studies.paper.statements.behaviour import Behaviour
from studies.paper.statements.judgement import NOT_ADDRESSED, Judgement, Statement

SLACK = (7.0, 10.0)  # [N/mm2]
VISIBLE = 5e-3  # [rad]: a millimetre between the edges of a belt of 200 mm


def judge(model: Behaviour, beam: Behaviour) -> Judgement:
    """The tilt at mid-span can be seen."""
    if not set(SLACK) <= set(model.tilt):
        return NOT_ADDRESSED
    tilt = [model.tilt[t] for t in SLACK]
    return Judgement.of(min(tilt) >= VISIBLE, f"{1e3 * tilt[0]:.0f} and {1e3 * tilt[1]:.0f} mrad")


def _sag(tension: float) -> float:
    """q L^2 / (8 F) [mm]."""
    case = case_at(tension)
    return 1e3 * float(case.sag_curvature) * float(case.rig.span_length) ** 2 / 8.0


M5 = Statement(
    name="M5",
    about="tilt",
    says="below 20 N/mm2 the belt is seen to hang, and a yaw to tilt its sections",
    criterion=(
        f"greatest tilt at mid-span within 25 m at 7 and at 10 N/mm2: at least {1e3 * VISIBLE:g} mrad, a millimetre "
        "between the edges (the sag itself is no model's: "
        f"{_sag(7.0):.0f} and {_sag(10.0):.0f} mm by statics)"
    ),
    judge=judge,
)
