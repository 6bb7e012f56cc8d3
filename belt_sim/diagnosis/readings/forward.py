"""The model as a function of everything that may be wrong: effect parameters, stiffness, and how runs were set.

A parameter vector is [effect parameters in units of their scale | stiffness | tension | yaw | place of the yaw | length
of the belt | start on the belt], the last six relative, relative, in radians, in metres, relative and in metres, the
same for every run (a run's own setting error is small and enters linearly, through the derivative). Many points are
computed at once; derivatives are differences of neighbouring points, which share the point they start from. Both points
of a difference are marched by the same program, so that its rounding is not taken for a derivative.

Few rows pay for effects that are null in them, and few programs serve all rows. Effects stand in groups: those that a
march does not ask at its steps are always compiled in; of the others the slow ones are one group, and the rest another,
each compiled in where any of it acts.
"""

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import replace

import numpy as np

from belt_sim.diagnosis.readings.additive_effects import bin_attenuation, columns, harmonics_of, select_addable
from belt_sim.diagnosis.readings.candidates import SLOW
from belt_sim.diagnosis.readings.parameter_vector import NUISANCES, Slot, lengthen_belt
from belt_sim.diagnosis.readings.programs import Work, compile_march, finish, plan_batches, room_for
from belt_sim.diagnosis.readings.samples import Samples
from belt_sim.diagnosis.readings.sensor_places import check_places, places_of
from belt_sim.effects.base import Effect
from belt_sim.line.hooks import AFTER_ENGINE, overrides
from belt_sim.line.march import plan_steps
from belt_sim.line.spans import Composition

STEP = 0.1  # [m] of the march, where nothing asks for a shorter one (``choose_step``)
DIFFERENCE = 1e-5  # of a parameter's scale, over which derivatives are taken
#: of stiffness, tension, yaw [rad], its place [m] (half a step), length, start [m]
DIFFERENCES = (1e-5, 1e-5, 1e-8, 0.05, 1e-6, 1e-3)
KEPT = 8  # sets of columns of additive effects, at once
REACH = 1.12  # predictions reach this much further than the record, which an encoder may have shortened
READ, LIGHT, HEAVY = "read", "light", "heavy"
BEYOND = 4  # steps behind a record, between which its last reading is looked up
FURTHER = ("encoder", "sensor_travel")  # hooks of effects with which a reading may be of a later travel than is shown
_AT_STEPS = ("yaw", "runup", "bend", "slide", "wrap")
Groups = frozenset[str]


def group_of(cls: type[Effect]) -> str:
    """The group of an effect: its own id where it need not be compiled at all."""
    if cls.is_additive():
        return cls.id
    if cls.id in SLOW:
        return HEAVY
    return LIGHT if overrides(cls, _AT_STEPS) else READ


class Forward:
    """Predictions of ``model`` with every effect of ``classes`` within reach, all null to begin with."""

    def __init__(
        self,
        samples: Samples,
        model: Composition,
        classes: Sequence[type[Effect]],
        step: float = STEP,
        terms: Mapping[str, int] | None = None,
    ) -> None:
        """terms: harmonics of linear effects that stand in the parameter vector; by default all that are resolved."""
        self.samples, self.model, self.classes, self.step = samples, model, tuple(classes), step
        check_places(samples, model, self.classes)
        self.terms = harmonics_of(classes, samples) if terms is None else dict(terms)
        names = {c: list(c.parameters)[: 2 * self.terms[c.id] if c.id in self.terms else None] for c in self.classes}
        self.slots = tuple(Slot(c, name) for c in self.classes for name in names[c])
        self.linear = np.array([s.effect.is_additive() for s in self.slots] + [False] * len(NUISANCES))
        self.size = len(self.slots) + len(NUISANCES)
        self.nuisances = range(len(self.slots), self.size)
        ends = [s.side for s in self.slots] + [(-np.inf, np.inf)] * len(NUISANCES)
        self.sides = np.array([low for low, _ in ends]), np.array([high for _, high in ends])
        self._addable = select_addable(self.classes)
        self._null = np.array([s.null / s.scale for s in self.slots] + [0.0] * len(NUISANCES))
        self._groups = [group_of(s.effect) for s in self.slots]
        travel = samples.end * REACH + 0.5
        steps, _, history = plan_steps(samples.cases, travel=travel, step=step, keep=step)
        self._steps, self._room = (travel / steps, steps), room_for(steps, history)
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
        found = copy(self)
        rig = lengthen_belt(self.samples.cases.rig, (1.0 + longer) / (1.0 + self.longer) - 1.0)
        found.samples = replace(self.samples, cases=replace(self.samples.cases, settings=settings, rig=rig))
        found.tension, found.yaw, found.longer, found.offset = tension, yaw, longer, 0.0
        found._columns = {}
        return found

    def subtract(self, offset: np.ndarray) -> "Forward":
        """The same with ``offset`` (R, S, n) taken off all predictions."""
        found = copy(self)
        found.offset = offset
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
        """Groups of effects that are not null at each of (C, size), as far as that makes a difference to a march."""
        off = (vector != self._null)[:, : len(self.slots)]
        out = {READ, *map(group_of, self._addable)}
        return [frozenset(self._groups[k] for k in np.flatnonzero(row)) - out for row in off]

    def _groups_of_derivatives(self, points: np.ndarray, of: np.ndarray, along: np.ndarray) -> list[Groups]:
        """Groups that each derivative (C,) is taken with: all cheap ones of a point together, and what is dear by
        itself; points (P, size), of (C,): at which of them; along (C, size)."""
        there, moved = self._active_groups(points), self._active_groups(self._null + along)
        shared = [
            groups.union(*(moved[k] & {LIGHT} for k in np.flatnonzero(of == p))) for p, groups in enumerate(there)
        ]
        return [(there if groups - {LIGHT} else shared)[p] | groups for p, groups in zip(of, moved, strict=True)]

    def _predict(self, vector: np.ndarray, groups: Sequence[Groups]) -> np.ndarray:
        """Predictions (C, R, S, n) at parameter vectors (C, size), each marched with some groups of effects."""
        places = {code: np.flatnonzero([c == code for c in groups]) for code in dict.fromkeys(groups)}
        works = [self._march(vector[rows], code) for code, rows in places.items()]
        finish(works)
        found = np.empty((len(vector), *self.samples.y.shape))
        for rows, work in zip(places.values(), works, strict=True):
            found[rows] = work.found
        found -= self.offset
        return found + self._additive_readings(vector, vector, self._addable) if self._addable else found

    def _march(self, vector: np.ndarray, groups: Groups) -> Work:
        """Predictions (C, R, S, n) with the effects of some groups, which are all that is not null."""
        kept = [k for k, group in enumerate(self._groups) if group in {READ, *groups}]
        samples, others = self.samples, places_of(self.samples)
        tilts = bool(others) or any(s.at.endswith("mid_span") for s in samples.signals)
        slots = tuple(self.slots[k] for k in kept)
        march = compile_march(self.model, slots, *self._room, tilts, others)
        scales = [s.scale for s in slots] + [1.0] * len(NUISANCES)  # those of found laws are no two alike
        spacing, most = self._steps
        steps = np.full(len(samples.runs), most)
        if not others and not np.any((vector != self._null)[:, self._far]):
            ends = np.maximum(np.max(samples.travel, axis=1), samples.yaw_at)
            steps = np.minimum(np.ceil(ends / spacing).astype(int) + BEYOND, most)
        vector = vector[:, [*kept, *self.nuisances]] * scales
        shown = bin_attenuation(slots, samples, len(NUISANCES))
        return plan_batches(march, vector, shown, samples, spacing, steps)

    def values_and_slopes(self, vector: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Predictions and derivatives, both (C, R, S, n), at parameter vectors (C, size) along directions (C, size)."""
        points, of = np.unique(vector, axis=0, return_inverse=True)
        additive = np.any(directions[:, self.linear], axis=1) & ~np.any(directions[:, ~self.linear], axis=1)
        along = np.where(additive[:, None], 0.0, directions)
        groups = self._groups_of_derivatives(points, of.reshape(-1), along)
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
        """Readings (k, R, S, n) per unit of every parameter of an additive effect, with encoder and sensors as they are
        at ``vector`` (size,): computed once for all points at which these are alike."""
        acting = self.effects_at(vector, [c.id for c in self.classes if c is not cls and overrides(c, AFTER_ENGINE)])
        nuisances = vector[len(self.slots) :]
        key = cls, *acting, nuisances.tobytes()
        found = self._columns.get(key)
        if found is None:  # other threads may ask as well, and forget what is kept
            if len(self._columns) >= KEPT:
                self._columns.clear()
            found = self._columns[key] = columns(self.samples, cls, acting, nuisances)
        return found[: len(self.index(cls.id))]

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


WANTED = 0.1  # length of the march's error, whitened over the whole campaign: noise alone has one per reading
HALVINGS = 3
ORDER = 4.0  # error of a step over that of half the step: the march is of second order


def choose_step(
    samples: Samples, model: Composition, classes: Sequence[type[Effect]], whiten: Callable[[np.ndarray], np.ndarray]
) -> tuple[float, np.ndarray]:
    """The longest step [m], of STEP and its halves, whose error is no longer than WANTED, and that error (R, S, n)
    [m or rad]; ``classes``: within reach, all null, for the program that other predictions need as well; ``whiten`` as
    in ``Metric``.
    """
    both = (Forward(samples, model, classes, step) for step in (STEP, STEP / 2))
    coarse, fine = (f.values(f.null()[None])[0] for f in both)
    error = (coarse - fine) * ORDER / (ORDER - 1.0)
    size = float(np.linalg.norm(whiten(error)))
    halvings = 0 if size <= WANTED else min(int(np.ceil(np.log(size / WANTED) / np.log(ORDER))), HALVINGS)
    return STEP / 2**halvings, ORDER**-halvings * error
