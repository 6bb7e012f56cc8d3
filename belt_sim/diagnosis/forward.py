"""The model as a function of everything that may be wrong: effect parameters, stiffness, and how runs were set.

A parameter vector is [effect parameters in units of their scale | stiffness | tension | yaw | place of the yaw | length
of the belt | start on the belt], the last six relative, relative, in radians, in metres, relative and in metres, the
same for every run (a run's own setting error is small and enters linearly, through the derivative). Many points are
computed at once; derivatives are differences of neighbouring points, which share the point they start from. Both points
of a difference are marched by the same program, so that its rounding is not taken for a derivative.

One program serves all rows: all effects are compiled in, and a batch passes over those that are null in its rows, so
that rows with slow ones are batches of their own. Additive ones that cannot be added are compiled in where one acts.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from itertools import zip_longest
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.campaign.types import PLACES, first_place_inside_span, sensor_place
from belt_sim.case import Case, Schedule, Settings
from belt_sim.curves import SensorPlace
from belt_sim.diagnosis.samples import (
    MAX_SAMPLES,
    SEEN_AT_REST,
    Samples,
    indicate_place,
    places_of,
    shapes_a_span,
    travel_lead,
)
from belt_sim.effects.base import Effect, Parameter, library
from belt_sim.effects.generic_law import GenericLaw
from belt_sim.errors import CannotRepresent, InputError
from belt_sim.jax_setup import PROGRAMS, WORKERS, StoredProgram, program_key
from belt_sim.line.hooks import AFTER_ENGINE, Hooks, apply_hook, indicate, looked_up, overrides, switched, true_travel
from belt_sim.line.march import march_open, plan_steps
from belt_sim.line.runup import Reading
from belt_sim.line.spans import Composition

# Hints of the fitter about effects: cost in a march, form of the readings, and which are candidates by default.


#: effects that make every step of a march slower: rows in which one of them acts are batches of their own
SLOW = frozenset({"weld", "wobble"})
#: effects whose second compilation is not worth a table of next runs
SLOWEST = frozenset({"weld"})
#: sensor laws that are a gain times the reading plus an offset, whatever the reading
AFFINE = frozenset({"sensor_drift", "sensor_gain", "sensor_offset"})
#: effects that look like others in most data, or have no derivative where the search begins
ONLY_WHEN_NAMED = frozenset(
    (
        *("lift_off", "run_up_points", "sensor_offset", "shear", "speed_tension", "temperature_difference"),
        *("thickness_wedge", "idler_skew_lower", "side_drag_lower", "off_centre_load_lower"),
    )
)


# A run as a parameter vector has it: effects with their numbers, and the case as it was really set.


NUISANCES = ("stiffness", "tension", "yaw", "yaw_at", "belt_length", "start")


@dataclass(frozen=True)
class Slot:
    """One parameter of one effect in the parameter vector."""

    effect: type[Effect]
    name: str

    @property
    def parameter(self) -> Parameter:
        """What the effect says of it."""
        return self.effect.parameters[self.name]

    @property
    def scale(self) -> float:
        return self.parameter.scale

    @property
    def side(self) -> tuple[float, float]:
        """Lowest and highest value in units of scale that a fit may take.

        A size has null for one, where a machine has it on one side of null only: how large it is, is for the readings
        to say. What only shapes an effect ends where no machine goes on: a weld of many metres is a camber, and one of
        a hair's breadth is whatever noise did when it passed.
        """
        (low, high), null = self.parameter.plausible, self.parameter.null
        ends = null if null <= low else -np.inf, null if null >= high else np.inf
        if self.parameter.modifier:
            ends = min(low, null), max(high, null)
        return ends[0] / self.scale, ends[1] / self.scale


def actual_case(case: Case, nuisance) -> Case:
    """The case as it was really set: stiffness, tension, yaw, its place, the belt's length and where on it a run
    starts off by ``nuisance``."""
    stiffness, tension, yaw, late, longer, further = nuisance
    belt = replace(case.belt, youngs_modulus=case.belt.youngs_modulus * (1.0 + stiffness))
    schedule = case.settings.yaw
    last = jnp.zeros_like(schedule.change).at[-1].set(yaw)
    turned = Schedule(at=schedule.at + late, over=schedule.over, change=schedule.change + last)
    head = replace(case.settings.yaw_head, at=case.settings.yaw_head.at + late)
    settings = replace(case.settings, tension=case.settings.tension * (1.0 + tension), yaw=turned, yaw_head=head)
    settings = replace(settings, start=case.settings.start + further)
    # all of the length in the spans: what comes once a turn does not feel where
    rig = replace(case.rig, centre_distance=case.rig.centre_distance + 0.5 * longer * case.rig.belt_length)
    return Case(rig=rig, belt=belt, settings=settings)


# Effects that only add to the readings, linearly: their readings without a march, and as many as the data show.
#
# An additive effect (a free edge profile: eighty numbers) is fitted like any other, but its columns come from travel
# and places alone, so that its harmonics make no march another program, and only those harmonics stand in the parameter
# vector that show. It must declare its parameters in the order in which they are to be taken, in pairs (cosine, sine)
# of 1, 2, ... waves a belt length. Of short waves the mean over a bin of readings shows less (``bin_attenuation``).


READINGS_A_NUMBER = 6.0  # at least; samples may be fewer than two a wave: what they show of it is known all the same
FEWEST_HARMONICS = 3  # harmonics that are always asked for
KNOTS_A_LENGTH = 6.0  # knots a belt length: slower movements are the belt's, and must not count as harmonics


def significant_harmonics(samples: Samples, roots: np.ndarray, shapes: np.ndarray, residual: np.ndarray) -> int:
    """How many harmonics a residual (R, S, n) calls for, beside all that moves slowly.

    Where there are any by less than one chance in as many as there are readings (of a single one that is Schwarz's
    criterion), Akaike's says how many predict best, and one further on that stands out alone is asked for as well: what
    is left out of a shape that is there would be taken for something unknown. Noise is no larger than what all of them
    leave.

    roots (R, S, n, n): whitening of each record; shapes (2 H, R, S, n): of the harmonics.
    """
    from scipy.interpolate import BSpline  # most commands need neither
    from scipy.special import chdtrc

    length = float(np.max(samples.cases.rig.belt_length))
    white, left, slow_ones = [], [], 0
    for r, travel in enumerate(samples.travel):
        # cubic splines (n, k) with knots every ``spacing`` [m]
        low, high = float(np.min(travel)), float(np.max(travel))
        inner = np.linspace(low, high, max(2, round((high - low) / (length / KNOTS_A_LENGTH)) + 1))
        knots = np.concatenate([[low] * 3, inner, [high] * 3])
        slow = BSpline.design_matrix(travel, knots, 3).toarray()
        for root, shape, y in zip(roots[r], shapes[:, r].swapaxes(0, 1), residual[r], strict=True):
            known = np.isfinite(y)
            own = np.linalg.qr(root[:, known] @ slow[known])[0]
            rows = np.column_stack([root @ shape.T, root[:, known] @ y[known]])
            rows = rows - own @ (own.T @ rows)
            white.append(rows[:, :-1])
            left.append(rows[:, -1])
            slow_ones += own.shape[1]
    columns, residual = np.concatenate(white), np.concatenate(left)
    gains = np.cumsum(np.square(np.linalg.qr(columns)[0].T @ residual))[1::2]
    if (free := len(residual) - columns.shape[1] - slow_ones) > 0:  # an edge that is there may have passed for noise
        gains /= np.clip((residual @ residual - gains[-1]) / free, 1e-3, 1.0)
    harmonics = np.arange(1, len(gains) + 1)
    readings = np.isfinite(samples.y).sum()
    if not np.any(chdtrc(2 * harmonics, gains) < 1.0 / readings):
        return min(FEWEST_HARMONICS, len(gains))
    alone = harmonics[np.diff(gains, prepend=0.0) > 2.0 * np.log(readings)]
    best = max([harmonics[np.argmax(gains - 2 * 2 * harmonics)], *alone])
    return int(min(max(FEWEST_HARMONICS, best), len(gains)))


@lru_cache(PROGRAMS)
def _compile_columns(
    model: Composition, cls: type[Effect], acting: tuple[type[Effect], ...], others: tuple[SensorPlace, ...]
) -> StoredProgram:
    """Columns (R, k, p + j, n) at encoder travels (R, n), at the p places of PLACES and j others, as sensors show
    them."""

    def one_run(settings, travel, rig, belt, effects, nuisances):
        case = actual_case(Case(rig=rig, belt=belt, settings=settings), nuisances)
        seen = apply_hook(effects, "sensor_travel", true_travel(effects, case, travel), case)
        at_others = [cls.columns(seen + travel_lead(place, case), case)[:, place.point, None] for place in others]
        own = jnp.concatenate([cls.columns(seen, case), *at_others], axis=1)
        none = jnp.zeros((2, len(travel)))

        def read(y):
            reading = Reading(travel=travel, sensor_travel=seen, time=0.0 * seen, y=y[:4], tilt=none)
            rows = [
                indicate_place(place, row, case, effects, travel, seen, 0.0 * seen)[None]
                for place, row in zip(others, y[4:], strict=True)
            ]
            return jnp.concatenate([at_places(apply_hook(effects, "sensor", reading, case).y, none), *rows])

        return jax.vmap(read)(own) - read(jnp.zeros_like(own[0]))  # in proportion to y: gains, not offsets

    of_runs = jax.vmap(one_run, in_axes=(0, 0, None, None, None, None))
    return StoredProgram(of_runs, program_key("columns", model, [cls, *acting], others), brief=True)


def bin_attenuation(slots: Sequence[Slot], samples: Samples, others: int = 0) -> np.ndarray:
    """How much of every parameter, and of so many ``others`` behind them, the readings of each run show, (R, k): of a
    harmonic, a wave with so many periods a belt length, what the mean over a bin leaves, of all else the whole."""
    harmonics = [1 + list(s.effect.parameters).index(s.name) // 2 if s.effect.is_additive() else 0 for s in slots]
    many, length = samples.per_bin[:, None], float(np.max(samples.cases.rig.belt_length))
    half = np.pi * np.outer(samples.widths / samples.per_bin, [*harmonics, *[0] * others]) / length
    one = np.ones_like(half)  # half the phase between two readings
    return np.divide(np.sin(many * half), many * np.sin(half), out=one, where=np.abs(np.sin(half)) > 1e-12)


# Compiled marches that predict readings.
#
# A program has room for more steps than a campaign needs: one compilation serves campaigns of any number of runs,
# samples, travel and step. Runs at points are one list of rows, computed a fixed number at a time, those of several
# programs side by side.


RECORD_ROOM = 2048  # records that compiled code has room for; where that is too little, GROWTH times as many, and so on
SLOTS = 16  # the same of the wrap's history
GROWTH = 4  # a unit that is off by 3.28 takes one more program, not two
MANY_NUMBERS = 5  # numbers, from which on a program runs so often that it pays to compile it well


def room_for(steps: int, slots: int) -> tuple[int, int]:
    """Records and slots of the wrap's history that compiled code has, for so many."""
    first, second = (
        GROWTH ** math.ceil(math.log(max(x, 1.0), GROWTH)) for x in ((steps + 2) / RECORD_ROOM, slots / SLOTS)
    )
    return RECORD_ROOM * first, SLOTS * second


@lru_cache(PROGRAMS)
def compile_march(
    model: Composition,
    slots: tuple[Slot, ...],
    room: int,
    history: int,
    tilts: bool,
    others: tuple[SensorPlace, ...] = (),
):
    """Predictions at a batch of points and runs; tilts: of roll as well, which a march feels; others: places of sensors
    beside the points."""
    only = ("y", "tilt") if tilts else ("y",)
    one = partial(_one_run, model=model, slots=slots, room=room, history=history, only=only, others=others)
    # a program of this campaign alone, or of a few marches: other base models, mistakes of a sheet, fits of few numbers
    seldom = len(slots) < MANY_NUMBERS or any(issubclass(s.effect, GenericLaw) for s in slots)
    many = jax.vmap(one, in_axes=(0, 0, 0, 0, 0, 0, None, None, None, None, None))
    names = [s.name for s in slots]
    key = program_key("readings", model, [s.effect for s in slots], names, room, history, tilts, others)
    return StoredProgram(many, key, brief=seldom)


def at_places(y, tilt):
    """Readings (len(PLACES), n), in the order of PLACES, of y (4, n) at points 1-4 [m] and the rolls (2, n) [rad] of
    the upper and the lower span."""
    return jnp.concatenate([y, tilt])


def _one_run(
    vector, shown, settings: Settings, travel, time, yaw_at, rig, belt, spacing, steps, acts, *,
    model, slots, room, history, only, others,
):  # fmt: skip
    """Readings of one run ``at_places`` and (k, n) at the ``others``; (4, n), of points, where ``only`` has no tilt."""
    vector, numbers = vector * shown, dict[type[Effect], dict]()
    for k, slot in enumerate(slots):
        numbers.setdefault(slot.effect, {})[slot.name] = vector[k]
    effects = tuple(cls(**values) for cls, values in numbers.items())
    case = actual_case(Case(rig=rig, belt=belt, settings=settings), vector[len(slots) :])
    known = library()  # an effect of the user's own, or a found law, always acts
    effects = tuple(switched(e, acts[k]) if known.get(e.id) is type(e) else e for k, e in enumerate(effects))
    curves = march_open(case, effects, spacing, steps, model=model, room=room, slots=history, only=only, inside=others)
    stated = jnp.append(travel, yaw_at)  # the last sample is where every lateral sensor reads zero
    clock = jnp.append(time, yaw_at / case.settings.speed)
    read = indicate(curves, case, effects, stated, clock)
    rows = [read.y[:, :-1] - read.y[:, -1:]]
    if "tilt" in only:
        assert read.tilt is not None
        rows = [at_places(rows[0], read.tilt[:, :-1])]
    at_rest = yaw_at - 2.0 * spacing  # before the yaw, with which these move at once
    stated, clock = stated.at[-1].set(at_rest), clock.at[-1].set(at_rest / case.settings.speed)
    for place in others:
        seen = apply_hook(effects, "sensor_travel", true_travel(effects, case, stated), case)
        assert curves.extra is not None
        row = curves.extra[str(place)]
        if place.on_wrap:  # as the belt ran up, and the pulley's own way from one point to the other
            tail = place.where == "tail_wrap"
            around = case.rig.wrap_tail if tail else case.rig.wrap_head
            upper, lower = (curves.y[0], curves.y[1]) if tail else (curves.y[3], curves.y[2])
            from_upper = (case.settings.direction > 0) == tail  # where the belt runs up
            up, off = jnp.where(from_upper, upper, lower), jnp.where(from_upper, lower, upper)
            arc = jnp.where(from_upper, place.distance, around - place.distance)
            share = 0.5 * (1.0 - jnp.cos(jnp.pi * arc / around))  # of the way across, for an axis that is not level
            before = [jnp.interp(curves.travel - way, curves.travel, up) for way in (arc, around)]
            row = row + (before[0] + share * (off - before[1]))
        y = indicate_place(place, looked_up(curves.travel, row[None], seen)[0], case, effects, stated, seen, clock)
        rows.append((y[:-1] - y[-1])[None])
    return jnp.concatenate(rows) if len(rows) > 1 else rows[0]


# samples of a run are filled up to a multiple of this, so that campaigns share compiled code
SAMPLES_FILLED = MAX_SAMPLES
# runs at points a batch: requests are cut and padded to it, so that one shape is compiled; most are small
BATCH_ROWS = 16
#: threads that the batches of all requests run in: to begin and end two for each takes half as long as a batch
_POOL = ThreadPoolExecutor(WORKERS, thread_name_prefix="batches")


def finish(works: Sequence[Sequence[Callable[[], None]]]) -> None:
    """Do all batches: first one of each program, so that each is compiled once and several side by side."""
    turns = [[batch for batch in turn if batch is not None] for turn in zip_longest(*works)]
    for batches in (turns[:1], turns[1:]):
        here = [batch for turn in batches for batch in turn]
        if len(here) == 1:
            here[0]()
        else:
            begun = [_POOL.submit(batch) for batch in here]
            try:
                for batch in begun:
                    batch.result()
            except KeyboardInterrupt:  # the process would end after all that wait
                for batch in begun:
                    batch.cancel()
                raise


STEP = 0.1  # [m] of the march, where nothing asks for a shorter one (``workbench``)
DIFFERENCE = 1e-5  # of a parameter's scale, over which derivatives are taken
#: of stiffness, tension, yaw [rad], its place [m] (half a step), length, start [m]
DIFFERENCES = (1e-5, 1e-5, 1e-8, 0.05, 1e-6, 1e-3)
COLUMN_SETS = 8  # sets of columns of additive effects, at once
TRAVEL_REACH = 1.12  # predictions reach this much further than the record, which an encoder may have shortened
HEAVY = "heavy"
STEPS_BEHIND = 4  # steps behind a record, between which its last reading is looked up
FURTHER = ("encoder", "sensor_travel")  # hooks of effects with which a reading may be of a later travel than is shown
Groups = frozenset[str]


class Forward:
    """Predictions of ``model`` with every effect of ``classes`` within reach, all null to begin with."""

    def __init__(
        self,
        samples: Samples,
        model: Composition,
        classes: Sequence[type[Effect]],
        step: float = STEP,
        terms: Mapping[str, int] | None = None,
        room: tuple[int, int] | None = None,
    ) -> None:
        """terms: harmonics of linear effects that stand in the parameter vector; by default all that are resolved;
        room: as in ``room_for``, of a program for a shorter step; by default as needed."""
        self.samples, self.model, self.classes, self.step = samples, model, tuple(classes), step
        # a sensor at none of the points: a record may not begin with the yaw, which moves spans and wraps at once, and
        # inside a span it would see what effects that are computed at its ends only do not say
        places = places_of(samples)
        late = next((r for r in samples.runs if places and (r.yaw or r.yaw_head) and r.yaw_at < SEEN_AT_REST), None)
        if late:
            remedy = f"begin the record {SEEN_AT_REST:g} m before it"
            remedy = f"a sensor at = {places[0]} moves at once with the yaw: {remedy}"
            raise InputError(f"runs.csv, {late.name}: yaw_at_m", late.yaw_at, "m", remedy)
        inside = first_place_inside_span(samples.signals)
        acting: Sequence[Hooks | type[Hooks]] = (*model.built_in, *self.classes)
        unfit = [e.id for e in acting if shapes_a_span(e)]
        if inside and unfit:
            raise CannotRepresent(
                f"signals at = {inside}: {unfit[0]} shapes the span between its ends, which a sensor inside it would "
                "see; leave the effect out, take model=strip, or leave the signal out"
            )
        # harmonics of the belt length that the lateral readings can be asked for, of every linear effect what it has
        read = np.isfinite(samples.y[:, [s.kind == "lateral" for s in samples.signals]]).sum()
        most = {c.id: (FEWEST_HARMONICS, len(c.parameters) // 2) for c in self.classes if c.is_additive()}
        shown = {i: int(np.clip(read / (2 * READINGS_A_NUMBER), *ends)) for i, ends in most.items()}
        self.terms = shown if terms is None else dict(terms)
        names = {c: list(c.parameters)[: 2 * self.terms[c.id] if c.id in self.terms else None] for c in self.classes}
        self.slots = tuple(Slot(c, name) for c in self.classes for name in names[c])
        self.linear = np.array([s.effect.is_additive() for s in self.slots] + [False] * len(NUISANCES))
        self.size = len(self.slots) + len(NUISANCES)
        self.nuisances = range(len(self.slots), self.size)
        ends = [s.side for s in self.slots] + [(-np.inf, np.inf)] * len(NUISANCES)
        self.sides = np.array([low for low, _ in ends]), np.array([high for _, high in ends])
        # Readings of additive effects are added to those of a march without them: exact where every other sensor law
        # shows a gain times the reading and an offset. Beside any other law, a gauge that sticks, they are compiled in.
        simple = all(c.is_additive() or c.id in AFFINE for c in self.classes if overrides(c, ("sensor",)))
        self._addable = tuple(c for c in self.classes if c.is_additive()) if simple else ()
        self._null = np.array([s.parameter.null / s.scale for s in self.slots] + [0.0] * len(NUISANCES))
        # the group of an effect: its own id where it need not be compiled at all; empty where it slows no batch
        groups = {c: c.id if c.is_additive() else HEAVY if c.id in SLOW else "" for c in self.classes}
        self._groups = [groups[s.effect] for s in self.slots]
        travel = samples.end * TRAVEL_REACH + 0.5
        steps, _, history = plan_steps(samples.cases, travel=travel, step=step, keep=step)
        self._steps, self.room = (travel / steps, steps), room or room_for(steps, history)
        self._far = np.array([bool(overrides(s.effect, FURTHER)) for s in self.slots] + [False] * len(NUISANCES))
        self.tension, self.yaw = np.zeros((2, len(samples.runs)))
        self.longer = 0.0
        self.offset: np.ndarray | float = 0.0
        self._columns: dict[tuple, np.ndarray] = {}  # of additive effects, as far as they are known

    def set_to(self, tension: np.ndarray, yaw: np.ndarray, longer: float = 0.0) -> "Forward":
        """The same with every run (R,) set off by these [relative, rad], and a belt that is so much longer [1]."""
        settings = self.samples.cases.settings
        change = np.array(settings.yaw.change)
        change[:, -1] += yaw - self.yaw
        settings = replace(
            settings,
            tension=settings.tension * (1.0 + tension) / (1.0 + self.tension),
            yaw=replace(settings.yaw, change=change),
        )
        found, rig, further = copy(self), self.samples.cases.rig, (1.0 + longer) / (1.0 + self.longer) - 1.0
        rig = replace(rig, centre_distance=rig.centre_distance + 0.5 * further * rig.belt_length)
        found.samples = replace(self.samples, cases=replace(self.samples.cases, settings=settings, rig=rig))
        found.tension, found.yaw, found.longer, found.offset = tension, yaw, longer, 0.0
        found._columns = {}
        return found

    def of_runs(self, which: np.ndarray) -> "Forward":
        """The same for some of its runs, by number."""
        found = copy(self)
        found.samples, found._columns = self.samples.of_runs(which), {}
        found.tension, found.yaw = self.tension[which], self.yaw[which]
        found.offset = np.broadcast_to(self.offset, self.samples.y.shape)[which]
        return found

    def index(self, effect_id: str) -> list[int]:
        """Positions in the parameter vector of an effect's parameters."""
        return [k for k, s in enumerate(self.slots) if s.effect.id == effect_id]

    def grids(self, effect_id: str) -> dict[int, tuple[float, ...]]:
        """Positions of an effect's parameters that are tried on a grid, and the values there."""
        declared = {k: self.slots[k].parameter for k in self.index(effect_id)}
        belt = float(self.samples.cases.rig.belt_length)
        units = {k: (belt if p.of_belt else 1.0) / p.scale for k, p in declared.items()}
        return {k: tuple(v * units[k] for v in p.grid) for k, p in declared.items() if p.grid}

    def null(self) -> np.ndarray:
        """q (size,) with nothing wrong."""
        return self._null.copy()

    def values(self, vector: np.ndarray) -> np.ndarray:
        """Predictions (C, R, S, n) at parameter vectors (C, size)."""
        return self._predict(vector, self._active_groups(vector))

    def _active_groups(self, vector: np.ndarray) -> list[Groups]:
        """Groups of effects, of those that do not go with all others, that are not null at each of (C, size)."""
        off = (vector != self._null)[:, : len(self.slots)]
        out = {"", *(c.id for c in self._addable)}
        return [frozenset(self._groups[k] for k in np.flatnonzero(row)) - out for row in off]

    def _predict(self, vector: np.ndarray, groups: Sequence[Groups]) -> np.ndarray:
        """Predictions (C, R, S, n) at parameter vectors (C, size), each marched with some groups of effects."""
        places = {code: np.flatnonzero([c == code for c in groups]) for code in dict.fromkeys(groups)}
        parts = [self._march(vector[rows], code) for code, rows in places.items()]
        finish([batches for _, batches in parts])
        found = np.empty((len(vector), *self.samples.y.shape))
        for rows, (part, _) in zip(places.values(), parts, strict=True):
            found[rows] = part[:, self.samples.distinct[1]]
        found -= self.offset
        return found + self._additive_readings(vector, vector, self._addable) if self._addable else found

    def _march(self, vector: np.ndarray, groups: Groups) -> tuple[np.ndarray, Sequence[Callable[[], None]]]:
        """Predictions (C, k, S, n) of the distinct runs with the effects of some groups, which are all that is not
        null, and the batches that are to write them.

        A batch marches as far as its runs ask for, and takes the time of the effects alone that are not null in it.
        """
        kept = [k for k, group in enumerate(self._groups) if group in {"", HEAVY, *groups}]
        samples, others = self.samples, places_of(self.samples)
        tilts = bool(others) or not all(s.at.startswith("point_") for s in samples.signals)
        slots = tuple(self.slots[k] for k in kept)
        program = compile_march(self.model, slots, *self.room, tilts, others)
        spacing, most = self._steps
        steps = np.full(len(samples.runs), most)
        if not others and not np.any((vector != self._null)[:, self._far]):
            ends = np.maximum(np.max(samples.travel, axis=1), samples.yaw_at)
            steps = np.minimum(np.ceil(ends / spacing).astype(int) + STEPS_BEHIND, most)
        off = vector[:, kept] != self._null[kept]
        owners = list(dict.fromkeys(s.effect for s in slots))
        acts = np.stack([off[:, [s.effect is e for s in slots]].any(axis=1) for e in owners], axis=1) if owners else off
        scales = [s.scale for s in slots] + [1.0] * len(NUISANCES)  # those of found laws are no two alike
        vector, shown = vector[:, [*kept, *self.nuisances]] * scales, bin_attenuation(slots, samples, len(NUISANCES))

        stand = [*PLACES, *others]  # rows of what a program shows
        places = [stand.index(sensor_place(s.at) or s.at) for s in samples.signals]
        n, runs = samples.y.shape[-1], samples.distinct[0]
        points, run = (x.ravel() for x in np.meshgrid(np.arange(len(vector)), runs, indexing="ij"))
        cases, columns = samples.cases, np.minimum(np.arange(-(-n // SAMPLES_FILLED) * SAMPLES_FILLED), n - 1)
        travel, time = samples.travel[:, columns], samples.time[:, columns]
        found = np.empty((len(points), len(places), n))

        def batch(start: int) -> None:
            rows = np.minimum(np.arange(start, start + BATCH_ROWS), len(points) - 1)
            r = run[rows]
            settings = jax.tree.map(lambda x: x[r], cases.settings)
            of_rows = vector[points[rows]], shown[r], settings, travel[r], time[r], samples.yaw_at[r]
            own = acts[points[rows]].any(axis=0)
            predicted = program(*of_rows, cases.rig, cases.belt, spacing, int(steps[r].max()), own)
            part = found[start : start + BATCH_ROWS]
            part[:] = np.asarray(predicted)[: len(part), places, :n]

        batches = [partial(batch, start) for start in range(0, len(points), BATCH_ROWS)]
        return found.reshape(len(vector), len(runs), *samples.y.shape[1:]), batches

    def values_and_slopes(self, vector: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Predictions and derivatives, both (C, R, S, n), at parameter vectors (C, size) along directions (C, size)."""
        points, of = np.unique(vector, axis=0, return_inverse=True)
        additive = np.any(directions[:, self.linear], axis=1) & ~np.any(directions[:, ~self.linear], axis=1)
        along = np.where(additive[:, None], 0.0, directions)
        there, moved = self._active_groups(points), self._active_groups(self._null + along)
        groups = [there[p] | own for p, own in zip(of.reshape(-1), moved, strict=True)]
        keys = list(zip(of.reshape(-1).tolist(), groups, strict=True))
        starts = list(dict.fromkeys(keys))
        moving = np.flatnonzero(np.any(along, axis=1))
        least = np.array([DIFFERENCE] * len(self.slots) + list(DIFFERENCES))
        step = np.min(least / np.maximum(np.abs(along[moving]), 1e-30), axis=1, initial=np.inf)[:, None]
        asked = np.concatenate([points[[k for k, _ in starts]], vector[moving] + step * along[moving]])
        programs = [own for _, own in starts] + [groups[k] for k in moving]
        found = self._predict(asked, programs)
        values = found[[starts.index(key) for key in keys]]
        slopes = np.zeros_like(values)
        slopes[moving] = (found[len(starts) :] - values[moving]) / step[..., None, None]
        if additive.any():
            own = [c for c in self.classes if c.is_additive()]
            slopes[additive] = self._additive_readings(vector[additive], directions[additive], own)
        return values, slopes

    def _additive_readings(self, vector: np.ndarray, sizes: np.ndarray, classes: Sequence[type[Effect]]) -> np.ndarray:
        """What additive effects add to the readings (C, R, S, n) with their numbers as in ``sizes`` (C, size), all else
        being as in vectors (C, size)."""
        found = np.zeros((len(vector), *self.samples.y.shape))
        points, of = np.unique(np.where(self.linear, 0.0, vector), axis=0, return_inverse=True)
        for cls in classes:
            own = self.index(cls.id)
            scaled = sizes[:, own] * [self.slots[j].scale for j in own]
            for k, point in enumerate(points):
                rows = np.flatnonzero((of.reshape(-1) == k) & np.any(scaled, axis=1))
                if len(rows):
                    found[rows] += np.tensordot(scaled[rows], self.columns_of(cls, point), axes=1)
        return found

    def columns_of(self, cls: type[Effect], vector: np.ndarray) -> np.ndarray:
        """Lateral readings (k, R, S, n) per unit of every parameter of an additive effect, with encoder and sensors as
        they are at ``vector`` (size,): computed once for all points at which these are alike.

        Every sensor reads zero where the yaw is applied. Roll is not touched.
        """
        acting = self.effects_at(vector, [c.id for c in self.classes if c is not cls and overrides(c, AFTER_ENGINE)])
        nuisances, samples, others = vector[len(self.slots) :], self.samples, places_of(self.samples)
        key = cls, *acting, nuisances.tobytes()
        shapes = self._columns.get(key)
        if shapes is None:  # other threads may ask as well, and forget what is kept
            own = [self.slots[k] for k in self.index(cls.id)]  # the first of its parameters: as many as show
            shapes, by_bins = np.zeros((len(own), *samples.y.shape)), bin_attenuation(own, samples).T[:, :, None]
            stated = np.concatenate([samples.travel, samples.yaw_at[:, None]], axis=1)
            given = samples.cases.settings, stated, samples.cases.rig, samples.cases.belt, acting, nuisances
            kinds: Any = cls, tuple(map(type, acting))  # mypy denies a class its hash
            program = _compile_columns(self.model, *kinds, others)
            shown = np.asarray(program(*given)).swapaxes(0, 1)[: len(own)]
            places = [*PLACES, *others]
            for s, signal in enumerate(samples.signals):
                if signal.kind == "lateral":
                    rows = shown[:, :, places.index(sensor_place(signal.at) or signal.at)]
                    shapes[:, :, s] = rows[..., :-1] * by_bins - rows[..., -1:]
            if len(self._columns) >= COLUMN_SETS:
                self._columns.clear()
            self._columns[key] = shapes
        return shapes

    def expand(self, vector: np.ndarray, positions: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """Predictions (R, S, n) at a parameter vector (size,), and derivatives (k, R, S, n) along some positions."""
        directions = np.zeros((max(1, len(positions)), self.size))
        directions[np.arange(len(positions)), np.array(positions, dtype=int)] = 1.0
        points = np.repeat(vector[None], len(directions), axis=0)
        values, slopes = self.values_and_slopes(points, directions)
        return values[0], slopes[: len(positions)]

    def effects_at(self, vector: np.ndarray, ids: Sequence[str]) -> tuple[Effect, ...]:
        """The effects ``ids`` with the numbers of a parameter vector."""
        numbers: dict[str, dict[str, float]] = {c.id: {} for c in self.classes}
        for slot, value in zip(self.slots, vector, strict=False):
            numbers[slot.effect.id][slot.name] = float(value) * slot.scale
        return tuple(c(**numbers[c.id]) for c in self.classes if c.id in ids)
