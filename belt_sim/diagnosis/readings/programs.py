"""The programs that predict readings: marches, each compiled with the effects that act, and what only adds to readings.

Few rows pay for effects that are null in them, and few programs serve all rows. Effects stand in groups: those that a
march does not ask at its steps are always compiled in; of the others the slow ones are one group, and the rest another,
each compiled in where any of it acts. A program has room for more steps than the campaign needs: one compilation serves
campaigns of any number of runs, samples, travel and step.
"""

import math
from collections.abc import Sequence
from functools import lru_cache, partial

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.analytic.composition import Composition
from belt_sim.analytic.march import march_open, plan_steps
from belt_sim.case import Case, Settings
from belt_sim.curves import SensorPlace
from belt_sim.diagnosis.readings.additive_effects import READ_BY, bin_attenuation, compile_additions, select_addable
from belt_sim.diagnosis.readings.batches import Work, finish, plan_batches
from belt_sim.diagnosis.readings.candidates import SLOW
from belt_sim.diagnosis.readings.parameter_vector import NUISANCES, Slot, effects_and_case
from belt_sim.diagnosis.readings.samples import Samples
from belt_sim.diagnosis.readings.sensor_places import places_of, reading_at
from belt_sim.effects.base import Effect, overrides
from belt_sim.effects.generic_law import GenericLaw
from belt_sim.effects.pipeline import indicate
from belt_sim.jax_setup import PROGRAMS, jit_float64

READ, LIGHT, HEAVY = "read", "light", "heavy"
_AT_STEPS = ("yaw", "runup", "bend", "slide", "wrap")
Groups = frozenset[str]


def group_of(cls: type[Effect]) -> str:
    """The group of an effect: its own id where it need not be compiled at all."""
    if cls.is_additive():
        return cls.id
    if cls.id in SLOW:
        return HEAVY
    return LIGHT if overrides(cls, _AT_STEPS) else READ


REACH = 1.12  # predictions reach this much further than the record, which an encoder may have shortened


class Programs:
    """Programs of a model with effects, for runs no longer than those of some samples."""

    def __init__(
        self,
        samples: Samples,
        model: Composition,
        classes: Sequence[type[Effect]],
        slots: tuple[Slot, ...],
        step: float,
    ) -> None:
        """slots: what stands in a parameter vector of the effects ``classes``; step [m]: of the march."""
        self.model, self.classes, self.slots = model, classes, slots
        self.null = np.array([s.null / s.scale for s in slots] + [0.0] * len(NUISANCES))
        self._groups, self._added = [group_of(s.effect) for s in slots], select_addable(classes)
        travel = samples.end * REACH + 0.5
        steps, _, history = plan_steps(samples.cases, travel=travel, step=step, keep=step)
        self._steps, self._room = (travel / steps, steps), room_for(steps, history)

    def active_groups(self, vector: np.ndarray) -> list[Groups]:
        """Groups of effects that are not null at each of (C, size), as far as that makes a difference to a march."""
        off = (vector != self.null)[:, : len(self.slots)]
        out = {READ, *map(group_of, self._added)}
        return [frozenset(self._groups[k] for k in np.flatnonzero(row)) - out for row in off]

    def groups_of_derivatives(self, points: np.ndarray, of: np.ndarray, along: np.ndarray) -> list[Groups]:
        """Groups that each derivative (C,) is taken with: all cheap ones of a point together, and what is dear by
        itself; points (P, size), of (C,): at which of them; along (C, size)."""
        there, moved = self.active_groups(points), self.active_groups(self.null + along)
        shared = [
            groups.union(*(moved[k] & {LIGHT} for k in np.flatnonzero(of == p))) for p, groups in enumerate(there)
        ]
        return [(there if groups - {LIGHT} else shared)[p] | groups for p, groups in zip(of, moved, strict=True)]

    def predict(self, vector: np.ndarray, groups: Sequence[Groups], samples: Samples) -> np.ndarray:
        """Predictions (C, R, S, n) at parameter vectors (C, size), each by the program of some groups of effects."""
        places = {code: np.flatnonzero([c == code for c in groups]) for code in dict.fromkeys(groups)}
        marched = [(rows, self._march(vector[rows], code, samples)) for code, rows in places.items()]
        own = [k for k, s in enumerate(self.slots) if s.effect in self._added]
        rows = np.flatnonzero(np.any(vector[:, own] != self.null[own], axis=1))
        added = [self._add(vector[rows], samples)] if len(rows) else []
        finish([work for _, work in (*marched, *added)])
        found = np.empty((len(vector), *samples.y.shape))
        for here, work in marched:
            found[here] = work.found
        for of, work in added:
            found[rows] += work.found[of]
        return found

    def _march(self, vector: np.ndarray, groups: Groups, samples: Samples) -> Work:
        """Predictions (C, R, S, n) with the effects of some groups, which are all that is not null."""
        kept = [k for k, group in enumerate(self._groups) if group in {READ, *groups}]
        others = places_of(samples)
        tilts = bool(others) or any(s.at.endswith("mid_span") for s in samples.signals)
        slots = tuple(self.slots[k] for k in kept)
        march = _compile_march(self.model, slots, *self._room, tilts, others)
        scales = [s.scale for s in slots] + [1.0] * len(NUISANCES)  # those of found laws are no two alike
        vector = vector[:, [*kept, *range(len(self.slots), vector.shape[1])]] * scales
        shown = bin_attenuation(slots, samples, len(NUISANCES))
        return plan_batches(march, vector, shown, samples, self._steps)

    def _add(self, vector: np.ndarray, samples: Samples) -> tuple[np.ndarray, Work]:
        """What effects that only add to the readings add to them, by one program for any harmonics: of each of (C,)
        where it stands in what is found."""
        acting = [c for c in self.classes if c in self._added or overrides(c, READ_BY)]
        slots = tuple(Slot(c, name) for c in acting for name in c.parameters)
        numbers = np.tile([*(s.null for s in slots), *np.zeros(len(NUISANCES))], (len(vector), 1))
        numbers[:, len(slots) :] = vector[:, len(self.slots) :]
        place = {slot: k for k, slot in enumerate(slots)}
        for k, slot in enumerate(self.slots):
            if slot in place:
                numbers[:, place[slot]] = vector[:, k] * slot.scale
        different, of = np.unique(numbers, axis=0, return_inverse=True)
        program = compile_additions(slots, self._added, places_of(samples))
        shown = bin_attenuation(slots, samples, len(NUISANCES))
        return of.reshape(-1), plan_batches(program, different, shown, samples)


ROOM = 2048  # records that compiled code has room for; where that is too little, twice as many, and so on
SLOTS = 16  # the same of the wrap's history


def room_for(steps: int, slots: int) -> tuple[int, int]:
    """Records and slots of the wrap's history that compiled code has, for so many."""
    first, second = (2 ** math.ceil(math.log2(max(x, 1.0))) for x in ((steps + 2) / ROOM, slots / SLOTS))
    return ROOM * first, SLOTS * second


@lru_cache(PROGRAMS)
def _compile_march(
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
    seldom = any(issubclass(s.effect, GenericLaw) for s in slots)  # a program of this campaign alone
    return jit_float64(jax.vmap(one, in_axes=(0, 0, 0, 0, 0, 0, None, None, None, None)), brief=seldom)


def _one_run(
    vector, shown, settings: Settings, travel, time, yaw_at, rig, belt, spacing, steps, *,
    model, slots, room, history, only, others,
):  # fmt: skip
    """Readings (6, n) of one run at every place, and (k, n) at the ``others``; (4, n) where ``only`` has no tilt."""
    effects, case = effects_and_case(vector * shown, slots, Case(rig=rig, belt=belt, settings=settings))
    curves = march_open(case, effects, spacing, steps, model=model, room=room, slots=history, only=only, inside=others)
    stated = jnp.append(travel, yaw_at)  # the last sample is where every lateral sensor reads zero
    clock = jnp.append(time, yaw_at / case.settings.speed)
    read = indicate(curves, case, effects, stated, clock)
    rows = [read.y[:, :-1] - read.y[:, -1:], *([read.tilt[:, :-1]] if "tilt" in only else [])]
    before = yaw_at - 2.0 * spacing  # of the yaw, with which these move at once
    stated, clock = stated.at[-1].set(before), clock.at[-1].set(before / case.settings.speed)
    for place in others:
        y = reading_at(place, curves, case, effects, stated, clock)
        rows.append((y[:-1] - y[-1])[None])
    return jnp.concatenate(rows) if len(rows) > 1 else rows[0]
