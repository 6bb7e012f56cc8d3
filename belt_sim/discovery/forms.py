"""Forms: the dictionary of generic laws, u = size x shape(variable) x course(travel) x tension^n, as plain formulas.

Each formula is Python that holds for NumPy and JAX alike; the same text goes into the file of a found effect.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from belt_sim.discovery.places import SPAN, STIFFNESS, TENSION, TRAVEL
from belt_sim.discovery.states import States

#: shape -> formula of x and of its number p
SHAPES = {
    "x": "x",
    "x|x|": "x * xp.abs(x)",
    "x^2": "x**2",
    "x^3": "x**3",
    "saturated": "p * xp.tanh(x / p)",
    "beyond": "x - xp.clip(x, -p, p)",
    "stuck": "stop(x, p, s)",
    "|x|": "xp.abs(x)",
    "past": "xp.maximum(xp.abs(x) - p, 0.0)",
    "below": "xp.maximum(1.0 - x / p, 0.0)",
    "above": "xp.maximum(x / p - 1.0, 0.0)",
}
#: course -> formula of the travel s [m] (of what swings: two) and of its numbers p and q [m]; of a stretch of the belt:
#: of the part of it that runs up, of its middle and its length, all in belt lengths
COURSES = {
    "always": "1.0 + 0.0 * s",
    "travel": "s",
    "square": "s**2",
    "root": "xp.sqrt(s + 1e-6)",
    "rise": "1.0 - xp.exp(-s / p)",
    "fade": "xp.exp(-s / p)",
    "after": "1.0 / (1.0 + xp.exp(-(s - p) / 0.3))",
    "during": "1.0 / (1.0 + xp.exp(-(s - p) / 0.3)) - 1.0 / (1.0 + xp.exp(-(s - p - q) / 0.3))",
    "stretch": "1.0 / (1.0 + xp.exp((xp.abs((s - p + 0.5) % 1.0 - 0.5) - 0.5 * q) / 0.01))",
    "wave": "xp.cos(2.0 * xp.pi * s / p)",
    "wave'": "xp.sin(2.0 * xp.pi * s / p)",
    "ring": "xp.exp(-s / q) * xp.cos(2.0 * xp.pi * s / p)",
    "ring'": "xp.exp(-s / q) * xp.sin(2.0 * xp.pi * s / p)",
}
SHAPED = ("saturated", "beyond")  # shapes that have a number
SWINGING = ("wave", "ring")
STEADY = ("always", "travel", "root")
STATELESS = ("one", "set", "beta", "sigma")  # variables that the belt has no hand in
UNITS = {
    "one": "1",
    "set": "1",
    "beta": "rad",
    "sigma": "Pa",
    "y": "m",
    "alpha": "rad",
    "kappa": "1/m",
    "shown": "m",
    "rate": "m/s",
}
STATED = (TENSION, TRAVEL, SPAN, *STIFFNESS)  # kinds of places of which courses are tried only, whatever the belt does
STRETCHES = (0.05, 0.1, 0.2, 0.4)  # of the belt
WIDE = (0.05, 0.1, 0.2)  # of the record, how long something lasts
PARTS = 12  # of the record, for onsets
RISES = (0.02, 0.04, 0.08, 0.16, 0.32, 0.64)  # of the record
KNEES = (0.1, 0.25, 0.5, 0.75)  # of the largest size of a variable
FADES = (0.5, 1.5, 4.5)  # wavelengths, over which what rings dies away
ENDLESS = 2.5  # records, over which what fades hardly does
STUCK = (0.02, 0.05, 0.1, 0.25, 0.5)  # of the largest reading, how far something sticks
SAME_YAW = 0.02  # of the largest, within which yaws are one size: settings may be off by as much
RATIO = 1.3  # to the next wavelength of what rings
SHORTEST = 3.0  # cells in a wave, and samples


@dataclass(frozen=True)
class Form:
    """variable; shape and its number (None: has none); course and its numbers [m], or of a timed one [s]."""

    variable: str
    shape: str = "x"
    knee: float | None = None
    course: str = "always"
    at: float | None = None
    wide: float | None = None
    timed: bool = False

    @property
    def numbers(self) -> int:
        """How many shape numbers it has."""
        return sum(n is not None for n in (self.knee, self.at, self.wide))

    @property
    def waving(self) -> bool:
        """Whether it swings, with a size for the cosine and one for the sine."""
        return self.course.rstrip("'") in SWINGING

    @property
    def carried(self) -> bool:
        """Whether it goes round with the belt."""
        return self.course == "stretch"

    @property
    def family(self) -> tuple[str, str, str]:
        """What it says, without its numbers."""
        return self.variable, self.shape, self.course.rstrip("'") + " in time" * self.timed

    def sine(self) -> "Form":
        """The other half of what swings."""
        return replace(self, course=f"{self.course}'")

    def in_time(self, pace: float) -> "Form":
        """The same along time, lengths [m] taken as durations at so many s/m."""
        at, wide = (None if n is None else n * pace for n in (self.at, self.wide))
        return replace(self, at=at, wide=wide, timed=True)

    def plainer(self, end: float, cell: float) -> "Form | None":
        """The form that it comes to when a length is beyond a record of ``end`` ([m]; of what is timed [s]), or within
        a cell of it: a straight rise, a wave; what is there from the start, or stays."""
        if self.course in ("rise", "after") and (self.at or 0.0) < cell:
            return replace(self, course="always", at=None)
        if self.course == "rise" and (self.at or 0.0) > end:
            return replace(self, course="travel", at=None)
        if self.course == "fade" and (self.at or 0.0) > ENDLESS * end:
            return replace(self, course="always", at=None)
        if self.course == "ring" and (self.wide or 0.0) > end:
            return replace(self, course="wave", wide=None)
        return None

    def values(self, states: States, part: int | None, signal: str | None) -> np.ndarray:
        """The form along every run, (R, J); part: the pulley, signal: the sensor."""
        x, s = variable(states, self.variable, part, signal), travel_of(states, self, part)
        with np.errstate(over="ignore"):  # of what has faded away
            return self._of(x, s)

    def _of(self, x: np.ndarray, s: np.ndarray) -> np.ndarray:
        shaped = formula(SHAPES[self.shape])(x=x, p=self.knee, s=s, xp=np, stop=stop)
        return shaped * formula(COURSES[self.course])(s=s, p=self.at, q=self.wide, xp=np)


def travel_of(states: States, form: Form, part: int | None) -> np.ndarray:
    """What a form's course goes with, (R, J), or (1, J) where all runs have the same; part: the pulley."""
    if form.carried:
        return states.met[:, part or 0]
    running = form.course.startswith("wave")  # with the belt, whenever the yaw was set
    s = states.since if form.variable in ("beta", "set") and not running else states.s[None]
    return s / states.speed[:, None] if form.timed else s


@cache
def formula(text: str) -> Any:
    """A function of named arguments that evaluates ``text``."""
    code = compile(text, "law", "eval")
    return lambda **names: eval(code, {"__builtins__": {}}, names)


def variable(states: States, name: str, part: int | None, signal: str | None) -> np.ndarray:
    """A variable along every run, (R, J)."""
    if name == "one":
        return np.ones_like(states.beta)
    if name == "sigma":
        return np.broadcast_to(states.tension[:, None], states.beta.shape)
    if name in ("beta", "set"):
        return getattr(states, name)
    if name in ("shown", "rate"):
        return getattr(states, name)[:, states.signals.index(signal)]
    return getattr(states, name)[:, part]


def stop(x: np.ndarray, half: float, s: Any = None) -> np.ndarray:
    """What of x along its last axis is held back by friction: it follows x, and slides beyond ``half`` (stop operator).

    s: where along its path x stands, which the same formula in a file has to know.
    """
    along = np.ascontiguousarray(np.moveaxis(x, -1, 0))
    held = np.zeros_like(along)
    for k in range(1, len(along)):
        held[k] = np.minimum(np.maximum(held[k - 1] + along[k] - along[k - 1], -half), half)
    return np.moveaxis(held, 0, -1)


def dictionary(states: States, kind: str) -> list[Form]:
    """All forms to try at a kind of place; a wave stands with its first half only."""
    end = float(states.s[-1])
    timed = [("rise", end * r) for r in RISES] + [("after", end * k / PARTS) for k in range(1, PARTS - 1)]
    courses = [(c, None) for c in STEADY] + timed
    if kind in STATED:
        found = [Form("one", course=c, at=a) for c, a in courses] + waves(states, ("one",)) + windows(states, ("one",))
        return found + (_of_tension(states) if kind in STIFFNESS else [])
    forms = [Form("one", course=c, at=a) for c, a in courses] + waves(states, ("one",)) + windows(states, ("one",))
    if kind == "sensor":
        return forms + _of_state(states, ("shown", "rate"), [("always", None), ("travel", None)], shapes=True)
    if np.any(states.beta):
        forms += [Form("beta", course=c, at=a) for c, a in courses]
        forms += waves(states, ("beta",)) + windows(states, ("beta",))
        if _of_many_sizes(states.beta):
            forms += [Form("beta", shape=s) for s in ("x|x|", "x^2", "x^3")]
    forms += windows(states, ("alpha", "kappa"))
    fading = [("fade", end * r) for r in RISES[:4]]
    return forms + _of_state(states, ("y", "alpha", "kappa"), courses + fading, shapes=True)


def _of_tension(states: States) -> list[Form]:
    """What begins below or above a tension, where there are enough of them to tell that from a power."""
    tensions = np.unique(np.round(states.tension, -4))
    if len(tensions) < 3:
        return []
    between = np.sqrt(tensions[1:] * tensions[:-1])
    return [Form("sigma", shape=s, knee=float(x)) for s, some in (("below", between), ("above", between)) for x in some]


def _of_amplitude(states: States) -> list[Form]:
    """What grows with how far the belt goes or is bent, on either side alike."""
    found = [Form(n, shape=s) for n in ("y", "kappa") for s in ("|x|", "x^2")]
    for n in ("y", "kappa"):
        largest = float(np.abs(getattr(states, n)).max())
        found += [Form(n, shape="past", knee=b * largest) for b in KNEES]
    return found


def _of_many_sizes(beta: np.ndarray) -> bool:
    """Whether yaws (R, J) are of more than one size."""
    sizes = np.abs(beta).max(axis=1)
    return bool(np.ptp(sizes) > SAME_YAW * sizes.max())


def seldom(states: States, kind: str, periods: Sequence[float]) -> list[Form]:
    """Forms for a law once it is known that something is missing.

    What begins when the yaw is set, either way, or as far whatever the yaw is; what goes or swings with time instead of
    travel; what rings after a step, or dies away without a swing; what reads the state and comes back with ``periods``
    [m] of the machine; what sticks.
    """
    end = float(states.s[-1])
    found = [Form("one", course="square")]
    late = bool(np.any(states.set < 1.0))
    if late:
        found += [Form("set", course=c, at=a) for c, a in _timed(end)]
    if len(np.unique(states.speed)) > 1:
        longest = end / float(np.min(states.speed))
        odd = kind not in (*STATED, "sensor") and bool(np.any(states.beta))
        names = [n for n, there in (("one", True), ("set", late), ("beta", odd)) if there]
        found += [Form(n, course=c, at=a, timed=True) for n in names for c, a in _timed(longest)[1:]]
        found += [f.in_time(longest / end) for f in waves(states, ("one",))]
        found += [f.in_time(longest / end) for f in rings(states, ("beta",))] if odd else []
    if kind == "sensor":
        largest = float(np.abs(states.shown).max())
        return found + [Form("shown", shape="stuck", knee=b * largest) for b in STUCK]
    if kind in STIFFNESS:
        return found + _of_amplitude(states) + stretches(kind)
    return found if kind in STATED else found + _sided(states) + _swinging(states, periods)


def _sided(states: States) -> list[Form]:
    """What goes with the direction of the yaw and hardly with its size, as play and friction do that are used up."""
    if not np.any(states.beta) or not _of_many_sizes(states.beta):
        return []
    knee = KNEES[1] * float(np.abs(states.beta).max())
    return [Form("beta", shape="saturated", knee=knee, course=c, at=a) for c, a in _timed(float(states.s[-1]))]


def _timed(end: float) -> list[tuple[str, float | None]]:
    """Courses that go one way, over a record of ``end``."""
    steady = [(c, None) for c in (*STEADY, "square")]
    return [*steady, *((c, end * r) for c in ("rise", "fade") for r in RISES)]


def _swinging(states: States, periods: Sequence[float]) -> list[Form]:
    end, shortest = float(states.s[-1]), SHORTEST * float(states.s[1] - states.s[0])
    beta = ("beta",) if np.any(states.beta) else ()
    names = (*beta, "y", "alpha", "kappa")
    back = [Form(n, course="wave", at=at) for n in names for at in periods if shortest < at < 2.0 * end]
    creeping = [Form(n, course="fade", at=end * r) for n in beta for r in RISES]  # what rings, damped by much
    return rings(states, ("one", *beta)) + creeping + back


def rings(states: States, names: tuple[str, ...]) -> list[Form]:
    """Waves that fade."""
    end, shortest = float(states.s[-1]), SHORTEST * float(states.s[1] - states.s[0])
    lengths = end / RATIO ** np.arange(0.0, np.log(end / shortest) / np.log(RATIO))
    return [
        Form(n, course="ring", at=float(at), wide=float(at * fade))
        for n in names
        for at in lengths
        for fade in FADES
        if at * fade < end
    ]


def windows(states: States, names: tuple[str, ...]) -> list[Form]:
    """What acts for a while only."""
    end = float(states.s[-1])
    starts = [(w, at) for w in WIDE for at in np.arange(0.05, 0.97 - w, max(w, 0.1) / 1.5)]
    return [Form(n, course="during", at=float(end * at), wide=end * w) for n in names for w, at in starts]


def stretches(kind: str) -> list[Form]:
    """What a stretch of the belt carries, all round it: grip that it lacks, stiffness, or a bend of its own."""
    names = ("one",) if kind in STIFFNESS else ("alpha", "kappa", *(("one",) if kind == "turn" else ()))
    places = [(float(at), wide) for wide in STRETCHES for at in np.arange(0.5, 1.5 - 1e-9, 0.5 * wide)]
    return [Form(n, course="stretch", at=at, wide=wide) for n in names for at, wide in places]


def waves(states: States, names: tuple[str, ...]) -> list[Form]:
    """Waves from once in the record to the shortest that the grid carries, evenly spaced in wavenumber."""
    end, cell = float(states.s[-1]), float(states.s[1] - states.s[0])
    count = np.arange(1.0, end / (SHORTEST * cell), 0.75)
    return [Form(n, course="wave", at=end / c) for n in names for c in count]


def _of_state(states: States, names, courses, *, shapes: bool) -> list[Form]:
    found = [Form(n, course=c, at=a) for n in names for c, a in courses]
    for n in names if shapes else ():
        largest = float(np.abs(getattr(states, n)).max())
        found += [Form(n, shape=s) for s in ("x|x|", "x^2", "x^3")]
        found += [Form(n, shape=s, knee=b * largest) for s in SHAPED for b in KNEES]
    return found
