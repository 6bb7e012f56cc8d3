"""What the paper measured (M1 to M6), each as a criterion that a model meets or fails."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from belt_sim.curves import Curves
from studies.closed_forms import edge_tilt
from studies.paper.case import YAW
from studies.paper.models import LOOKS, MEASURED, TRAVEL, case_at, moving, steady
from studies.paper.stored_runs import stored_run

GRID = np.round(np.arange(0.0, TRAVEL + 0.05, 0.1), 9)  # [m] of travel
RECORDS = {7.0: "flex_7", 10.0: "flex_10", 20.0: "flex_20", 40.0: "flex_40"}
SETTLED = RECORDS | {7.0: "flex_7_far", 10.0: "flex_10_far"}  # stored runs that late rates are taken from
FLAT = ("beam_th1", "beam_th2", "ernst_beam")  # by assumption the belt stays in one plane: its tilt is none


@dataclass(frozen=True, kw_only=True)
class Behaviour:
    """By tension [N/mm2], positive towards where the yaw drives the belt.

    y: point 1 at GRID [m], shape (n,); rate: steady dy/ds [m/m]; tilt: the greatest at mid-span within TRAVEL [rad].
    What a model does not say is missing.
    """

    y: Mapping[float, np.ndarray] = field(default_factory=dict)
    rate: Mapping[float, float] = field(default_factory=dict)
    tilt: Mapping[float, float] = field(default_factory=dict)

    def y_at(self, travel: float, tension: float) -> float:
        """y of point 1 [m]."""
        return float(np.interp(travel, GRID, self.y[tension]))

    def slope(self, begin: float, end: float, tension: float) -> float:
        """Mean dy/ds of point 1 between two travels [m/m]."""
        return (self.y_at(end, tension) - self.y_at(begin, tension)) / (end - begin)


def behaviours(*, in_space: bool) -> dict[str, Behaviour]:
    """All models in the order of their looks, the stored belt in 3D last where it is wanted."""
    found = {name: _model_behaviour(name) for name in LOOKS if name != "mujoco_flex"}
    if not in_space:
        return found
    curves = {t: stored_run(name).curves for t, name in RECORDS.items()}
    stored = Behaviour(
        y={t: _y_on_grid(c) for t, c in curves.items()},
        rate={t: -stored_run(name).rates()[0] for t, name in SETTLED.items()},
        tilt={t: _greatest_tilt(c) for t, c in curves.items()},
    )
    return found | {"mujoco_flex": stored}


def _model_behaviour(model: str) -> Behaviour:
    rate = {t: -steady(model, t) for t in MEASURED}
    if model == "ritzinger":
        return Behaviour(rate=rate, tilt={t: abs(edge_tilt(case_at(t), abs(YAW))) for t in MEASURED})
    curves = {t: moving(model, t) for t in MEASURED}
    y = {t: _y_on_grid(c) for t, c in curves.items()}
    if model == "rope":  # a line has no cross-section
        return Behaviour(y=y, rate=rate)
    tilt = {t: 0.0 if model in FLAT else _greatest_tilt(c) for t, c in curves.items()}
    return Behaviour(y=y, rate=rate, tilt=tilt)


def _y_on_grid(curves: Curves) -> np.ndarray:
    return -np.interp(GRID, np.asarray(curves.travel), np.asarray(curves.y)[0])


def _greatest_tilt(curves: Curves) -> float:
    early = np.asarray(curves.travel) <= TRAVEL
    return float(np.abs(np.asarray(curves.tilt)[:, early]).max())


REPRODUCED, CONTRADICTED, SILENT = "reproduced", "contradicted", "not addressed"


@dataclass(frozen=True)
class Judgement:
    """verdict: one of the three words; number: what it rests on, as it is written, with its unit."""

    verdict: str
    number: str = ""

    @staticmethod
    def decide(met: bool, number: str) -> "Judgement":
        """Reproduced where the criterion is met."""
        return Judgement(REPRODUCED if met else CONTRADICTED, number)


NOT_ADDRESSED = Judgement(SILENT)

Judge = Callable[[Behaviour, Behaviour], Judgement]  # (a model, the beam of 2nd order)


@dataclass(frozen=True)
class Statement:
    """name, as M2; about: in a few words; says: the paper's statement; criterion: what a model has to do, in words;
    judge: does it."""

    name: str
    about: str
    says: str
    criterion: str
    judge: Judge


def _missing(of: Mapping[float, object], *tensions: float) -> bool:
    return not {*tensions} <= {*of}


M1_TENSION = 40.0  # [N/mm2]
M1_SEEN = 0.02  # of the largest y_1: a line's width or two in a diagram of the paper's size
M1_ALIKE = 0.9  # correlation of the slopes


def judge_m1(model: Behaviour, beam: Behaviour) -> Judgement:
    """A model that is unlike the beam, or cannot be told from it, fails; whether another is right cannot be said."""
    if _missing(model.y, M1_TENSION):
        return NOT_ADDRESSED
    apart = np.abs(model.y[M1_TENSION] - beam.y[M1_TENSION]).max() / np.abs(beam.y[M1_TENSION]).max()
    slopes = [np.gradient(b.y[M1_TENSION], GRID) for b in (model, beam)]
    alike = float(np.corrcoef(slopes)[0, 1]) if np.ptp(slopes[0]) > 0.0 else 0.0
    number = f"{100 * apart:.1f} % apart, alike {alike:.2f}"
    return Judgement(SILENT if apart >= M1_SEEN and alike >= M1_ALIKE else CONTRADICTED, number)


SLACK, TIGHT = (7.0, 10.0), 40.0  # [N/mm2]
M2_START = 3.0  # [m] of travel
M2_SLOWER = 0.9  # of what the beam of 2nd order says


def judge_m2(model: Behaviour, beam: Behaviour) -> Judgement:
    """y_1 at M2_START over that at TIGHT: below the beam's, and the lower the slacker."""
    if _missing(model.y, *SLACK, TIGHT):
        return NOT_ADDRESSED
    own, beams = ([b.y_at(M2_START, t) / b.y_at(M2_START, TIGHT) for t in SLACK] for b in (model, beam))
    met = all(a <= M2_SLOWER * b for a, b in zip(own, beams, strict=True)) and own[0] < own[1]
    return Judgement.decide(met, f"{own[0]:.2f} and {own[1]:.2f} of the start at 40")


M3_A_LOT = 1.2  # times the rate at TIGHT
M3_READ_OVER = (10.0, 15.0)  # [m]


def judge_m3(model: Behaviour, beam: Behaviour) -> Judgement:
    """Late rates."""
    return NOT_ADDRESSED if _missing(model.rate, *SLACK, TIGHT) else _faster(lambda t: model.rate[t])


def judge_m3_read(model: Behaviour, beam: Behaviour) -> Judgement:
    """Slopes over M3_READ_OVER."""
    return NOT_ADDRESSED if _missing(model.y, *SLACK, TIGHT) else _faster(lambda t: model.slope(*M3_READ_OVER, t))


def _faster(rate: Callable[[float], float]) -> Judgement:
    own = [rate(t) / rate(TIGHT) for t in SLACK]
    return Judgement.decide(min(own) >= M3_A_LOT, f"{own[0]:.2f} and {own[1]:.2f} times the rate at 40")


M4_TENSIONS = (20.0, 40.0)  # [N/mm2]
M4_QUITE = 0.2  # of the beam's rate


def judge_m4(model: Behaviour, beam: Behaviour) -> Judgement:
    """The model's steady rates are near the beam's."""
    if _missing(model.rate, *M4_TENSIONS):
        return NOT_ADDRESSED
    off = [model.rate[t] / beam.rate[t] - 1.0 for t in M4_TENSIONS]
    return Judgement.decide(max(map(abs, off)) <= M4_QUITE, f"{100 * off[0]:+.0f} % at 20, {100 * off[1]:+.0f} % at 40")


M5_VISIBLE = 5e-3  # [rad]: a millimetre between the edges of a belt of 200 mm


def judge_m5(model: Behaviour, beam: Behaviour) -> Judgement:
    """The tilt at mid-span can be seen."""
    if _missing(model.tilt, *SLACK):
        return NOT_ADDRESSED
    tilt = [model.tilt[t] for t in SLACK]
    return Judgement.decide(min(tilt) >= M5_VISIBLE, f"{1e3 * tilt[0]:.0f} and {1e3 * tilt[1]:.0f} mrad")


def _sag(tension: float) -> float:
    """q L^2 / (8 F) [mm]."""
    case = case_at(tension)
    return 1e3 * float(case.sag_curvature) * float(case.rig.span_length) ** 2 / 8.0


M6_OUTSIDE = 0.01  # of the rope's largest y


def judge_m6(model: Behaviour, beam: Behaviour) -> Judgement:
    """How far the model's curves leave the area between rope and beam of 1st order, which no tension changes."""
    if _missing(model.y, *MEASURED):
        return NOT_ADDRESSED
    rope, first = (_y_on_grid(moving(name, MEASURED[-1])) for name in ("rope", "beam_th1"))
    y = np.stack([model.y[t] for t in MEASURED])
    out = max(float((y - rope).max()), float((first - y).max()), 0.0) / float(rope.max())
    return Judgement.decide(out <= M6_OUTSIDE, f"{100 * out:.1f} % outside")


STATEMENTS = {s.name: s for s in (
    Statement("M1", "alike at 40 N/mm2", "at 40 N/mm2 measurement and beam are clearly apart, but of one kind",
        f"point 1 over 25 m: contradicted where it is less than {100 * M1_SEEN:g} % of the beam's largest y apart "
        "from the beam of 2nd order, or its slopes are correlated with the beam's by less than "
        f"{M1_ALIKE:g}; else not addressed: by how much, and to which side, the measurement differs is not in the "
        "paper's text", judge_m1),
    Statement("M2", "slow start",
        "at 7 and 10 N/mm2 the belt starts with less slope, the slacker the less, and the beam does not",
        f"y of point 1 after {M2_START:g} m at 7 and at 10 N/mm2, over that at 40: at most {M2_SLOWER:g} times the "
        "same ratio of the beam of 2nd order, and smaller at 7 than at 10", judge_m2),
    Statement("M3", "faster for good", "once it runs, a slack belt runs much faster sideways than a tight one",
        f"steady rate at 7 and at 10 N/mm2: both at least {M3_A_LOT:g} times that at 40", judge_m3),
    Statement("M3, read early", "faster over 10 to 15 m",
        "the same, if the rates were read while the belt was still in its transient",
        f"mean slope of point 1 from {M3_READ_OVER[0]:g} to {M3_READ_OVER[1]:g} m at 7 and at 10 N/mm2: both at "
        f"least {M3_A_LOT:g} times that at 40", judge_m3_read),
    Statement("M4", "rate at 20 to 40 N/mm2",
        "at 20 to 40 N/mm2 the beam of 2nd order gives rates that one may use",
        f"steady rate at 20 and at 40 N/mm2 within {100 * M4_QUITE:g} % of that of the beam of 2nd order", judge_m4),
    Statement("M5", "tilt", "below 20 N/mm2 the belt is seen to hang, and a yaw to tilt its sections",
        f"greatest tilt at mid-span within 25 m at 7 and at 10 N/mm2: at least {1e3 * M5_VISIBLE:g} mrad, a "
        "millimetre between the edges (the sag itself is no model's: "
        f"{_sag(7.0):.0f} and {_sag(10.0):.0f} mm by statics)", judge_m5),
    Statement("M6", "within rope and Th 1. O",
        "rope and beam of 1st order delimit an area in which all curves of the beam of 2nd order are",
        "point 1 over 25 m at 7, 10, 20 and 40 N/mm2 leaves that area by at most "
        f"{100 * M6_OUTSIDE:g} % of the rope's largest y (the paper says it of the beam of 2nd order alone)",
        judge_m6),
)}  # fmt: skip


def judge_models(*, in_space: bool) -> dict[str, dict[str, Judgement]]:
    """Judgements by statement and model; with the stored belt in 3D where it is wanted."""
    models = behaviours(in_space=in_space)
    beam = models["beam_th2"]
    return {key: {name: s.judge(model, beam) for name, model in models.items()} for key, s in STATEMENTS.items()}
