"""The dictionary of forms that a search tries at a place, and their values along the runs."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from belt_sim.discovery.states import States
from belt_sim.effects.law import ONE_SIDED, SPAN, STIFFNESS, TENSION, TRAVEL, Form

WITH_KNEE = ("saturation", "dead_zone")  # shapes with a knee that are tried of what reads the state
STEADY = ("constant", "linear", "square_root")
#: kinds of places at which the usual forms do not depend on where the belt runs
COURSES_ONLY = (TENSION, TRAVEL, SPAN, *STIFFNESS)
SECTIONS = (0.05, 0.1, 0.2, 0.4)  # of the belt
WIDE = (0.05, 0.1, 0.2)  # of the record, how long something lasts
PARTS = 12  # of the record, for onsets
RISES = (0.02, 0.04, 0.08, 0.16, 0.32, 0.64)  # of the record
KNEES = (0.1, 0.25, 0.5, 0.75)  # of the largest size of a variable
FADES = (0.5, 1.5, 4.5)  # wavelengths, over which a wave decays
ENDLESS = 2.5  # records, over which a decay cannot be told from what stays
STICKS = (0.02, 0.05, 0.1, 0.25, 0.5)  # of the largest reading, how far something sticks
SAME_YAW = 0.02  # of the largest, within which yaws are one size: settings may be off by as much
RATIO = 1.3  # to the next wavelength of a decaying wave
SHORTEST = 3.0  # cells in a wave, and samples


def timed_form(form: Form, pace: float) -> Form:
    """The same form along time, lengths [m] taken as durations at so many s/m."""
    at, wide = (None if n is None else n * pace for n in (form.at, form.wide))
    return replace(form, at=at, wide=wide, timed=True)


def simpler_form(form: Form, end: float, cell: float) -> Form | None:
    """The plainer form that a form comes to when a length is beyond a record of ``end`` ([m]; of what is timed [s]), or
    within a cell of it: a straight rise, a wave, what is there from the start, what stays; None where it stays itself.
    """
    if form.course in ("rise", "step") and (form.at or 0.0) < cell:
        return replace(form, course="constant", at=None)
    if form.course == "rise" and (form.at or 0.0) > end:
        return replace(form, course="linear", at=None)
    if form.course == "decay" and (form.at or 0.0) > ENDLESS * end:
        return replace(form, course="constant", at=None)
    if form.course == "decaying_wave" and (form.wide or 0.0) > end:
        return replace(form, course="wave", wide=None)
    return None


def form_values(form: Form, states: States, part: int | None, signal: str | None) -> np.ndarray:
    """A form along every run, (R, J); part: the pulley, signal: the sensor."""
    x, s = variable(states, form.variable, part, signal), travel_of(states, form, part)
    with np.errstate(over="ignore"):  # of what has faded away
        return form.shape_value(x, s, np) * form.course_value(s, np)


def travel_of(states: States, form: Form, part: int | None) -> np.ndarray:
    """What a form's course goes with, (R, J), or (1, J) where all runs have the same; part: the pulley."""
    if form.is_carried:
        return states.belt_part[:, part or 0]
    s = states.since if form.since_yaw else states.s[None]
    return s / states.speed[:, None] if form.timed else s


def variable(states: States, name: str, part: int | None, signal: str | None) -> np.ndarray:
    """A variable along every run, (R, J)."""
    if name == "none":
        return np.ones_like(states.beta)
    if name == "sigma":
        return np.broadcast_to(states.tension[:, None], states.beta.shape)
    if name in ("beta", "yaw_set"):
        return getattr(states, name)
    if name in ("reading", "reading_rate"):
        return getattr(states, name)[:, states.signals.index(signal)]
    return getattr(states, name)[:, part]


def usual_forms(states: States, kind: str) -> list[Form]:
    """All forms to try at a kind of place; of a wave its cosine only."""
    end = float(states.s[-1])
    timed = [("rise", end * r) for r in RISES] + [("step", end * k / PARTS) for k in range(1, PARTS - 1)]
    courses = [(c, None) for c in STEADY] + timed
    forms = [Form("none", course=c, at=a) for c, a in courses] + waves(states, ("none",)) + intervals(states, ("none",))
    if kind in COURSES_ONLY:
        return forms + (_tension_thresholds(states) if kind in STIFFNESS else [])
    if kind == "sensor":
        return forms + _state_forms(states, ("reading", "reading_rate"), [("constant", None), ("linear", None)])
    if np.any(states.beta):
        forms += [Form("beta", course=c, at=a) for c, a in courses]
        forms += waves(states, ("beta",)) + intervals(states, ("beta",))
        if _has_many_sizes(states.beta):
            forms += [Form("beta", shape=s) for s in ("signed_square", "square", "cube")]
    forms += intervals(states, ("alpha", "kappa"))
    fading = [("decay", end * r) for r in RISES[:4]]
    return forms + _state_forms(states, ("y", "alpha", "kappa"), courses + fading)


def _tension_thresholds(states: States) -> list[Form]:
    """What begins below or above a tension, where there are enough of them to tell that from a power."""
    tensions = np.unique(np.round(states.tension, -4))
    if len(tensions) < 3:
        return []
    between = np.sqrt(tensions[1:] * tensions[:-1])
    return [Form("sigma", shape=s, knee=float(x)) for s, some in (("below", between), ("above", between)) for x in some]


def _amplitude_forms(states: States) -> list[Form]:
    """What grows with how far the belt goes or is bent, on either side alike; and what is there on one side only."""
    found = []
    for n in ("y", "kappa", "kappa_mean"):
        knees = _knees(states, n)
        found += [Form(n, shape=s) for s in ("magnitude", "square")]
        found += [Form(n, shape="magnitude_beyond", knee=k) for k in knees]
        found += [Form(n, shape=s, knee=k) for s in ONE_SIDED for k in knees[:2]]
    return found


def _has_many_sizes(beta: np.ndarray) -> bool:
    """Whether yaws (R, J) are of more than one size."""
    sizes = np.abs(beta).max(axis=1)
    return bool(np.ptp(sizes) > SAME_YAW * sizes.max())


def rare_forms(states: States, kind: str, periods: Sequence[float]) -> list[Form]:
    """Forms for a law once it is known that something is missing.

    What begins when the yaw is set, either way, or as far whatever the yaw is; what goes or swings with time instead of
    travel; decaying waves after a step, and decay without a wave; what reads the state and comes back with ``periods``
    [m] of the machine; what sticks.
    """
    end = float(states.s[-1])
    found = [Form("none", course="quadratic")]
    late = bool(np.any(states.yaw_set < 1.0))
    if late:
        found += [Form("yaw_set", course=c, at=a) for c, a in _one_way_courses(end)]
    if len(np.unique(states.speed)) > 1:
        longest = end / float(np.min(states.speed))
        odd = kind not in (*COURSES_ONLY, "sensor") and bool(np.any(states.beta))
        names = [n for n, there in (("none", True), ("yaw_set", late), ("beta", odd)) if there]
        found += [Form(n, course=c, at=a, timed=True) for n in names for c, a in _one_way_courses(longest)[1:]]
        found += [timed_form(f, longest / end) for f in waves(states, ("none",))]
        found += [timed_form(f, longest / end) for f in decaying_waves(states, ("beta",))] if odd else []
    if kind == "sensor":
        largest = float(np.abs(states.reading).max())
        return found + [Form("reading", shape="stick", knee=b * largest) for b in STICKS]
    if kind in STIFFNESS:
        return found + _amplitude_forms(states)
    return found if kind in COURSES_ONLY else found + _direction_forms(states) + _oscillating_forms(states, periods)


def _direction_forms(states: States) -> list[Form]:
    """What goes with the direction of the yaw and hardly with its size, as play and friction do that are used up."""
    if not np.any(states.beta) or not _has_many_sizes(states.beta):
        return []
    knee = KNEES[1] * float(np.abs(states.beta).max())
    return [
        Form("beta", shape="saturation", knee=knee, course=c, at=a) for c, a in _one_way_courses(float(states.s[-1]))
    ]


def _one_way_courses(end: float) -> list[tuple[str, float | None]]:
    """Courses that go one way, over a record of ``end``."""
    steady = [(c, None) for c in (*STEADY, "quadratic")]
    return [*steady, *((c, end * r) for c in ("rise", "decay") for r in RISES)]


def _oscillating_forms(states: States, periods: Sequence[float]) -> list[Form]:
    end, shortest = float(states.s[-1]), SHORTEST * float(states.s[1] - states.s[0])
    beta = ("beta",) if np.any(states.beta) else ()
    names = (*beta, "y", "alpha", "kappa")
    back = [Form(n, course="wave", at=at) for n in names for at in periods if shortest < at < 2.0 * end]
    creeping = [Form(n, course="decay", at=end * r) for n in beta for r in RISES]  # a strongly damped wave
    return decaying_waves(states, ("none", *beta)) + creeping + back


def decaying_waves(states: States, names: tuple[str, ...]) -> list[Form]:
    """Waves that fade."""
    end, shortest = float(states.s[-1]), SHORTEST * float(states.s[1] - states.s[0])
    lengths = end / RATIO ** np.arange(0.0, np.log(end / shortest) / np.log(RATIO))
    return [
        Form(n, course="decaying_wave", at=float(at), wide=float(at * fade))
        for n in names
        for at in lengths
        for fade in FADES
        if at * fade < end
    ]


def intervals(states: States, names: tuple[str, ...]) -> list[Form]:
    """What acts for a while only."""
    end = float(states.s[-1])
    starts = [(w, at) for w in WIDE for at in np.arange(0.05, 0.97 - w, max(w, 0.1) / 1.5)]
    return [Form(n, course="interval", at=float(end * at), wide=end * w) for n in names for w, at in starts]


def belt_sections(kind: str) -> list[Form]:
    """What a section of the belt carries, all round it: grip that it lacks, stiffness, or a bend of its own."""
    names = ("none",) if kind in STIFFNESS else ("alpha", "kappa", *(("none",) if kind == "turn" else ()))
    places = [(float(at), wide) for wide in SECTIONS for at in np.arange(0.5, 1.5 - 1e-9, 0.5 * wide)]
    return [Form(n, course="belt_section", at=at, wide=wide) for n in names for at, wide in places]


def waves(states: States, names: tuple[str, ...]) -> list[Form]:
    """Waves from once in the record to the shortest that the grid carries, evenly spaced in wavenumber."""
    end, cell = float(states.s[-1]), float(states.s[1] - states.s[0])
    count = np.arange(1.0, end / (SHORTEST * cell), 0.75)
    return [Form(n, course="wave", at=end / c) for n in names for c in count]


def _state_forms(states: States, names, courses) -> list[Form]:
    found = [Form(n, course=c, at=a) for n in names for c, a in courses]
    for n in names:
        found += [Form(n, shape=s) for s in ("signed_square", "square", "cube")]
        found += [Form(n, shape=s, knee=k) for s in WITH_KNEE for k in _knees(states, n)]
    return found


def _knees(states: States, name: str) -> list[float]:
    """The knees to try for a variable; none where it is zero throughout, as the curvature of a rope is."""
    largest = float(np.abs(getattr(states, name)).max())
    return [b * largest for b in KNEES] if largest else []
