"""What linear effects add to the readings, without the march: then their harmonics make no march another program.

That is exact where every other sensor law shows a gain times the reading and an offset; beside any other law, one of a
gauge that sticks for instance, a linear effect is compiled into the march.
"""

from collections.abc import Sequence
from functools import lru_cache, partial

import jax
import jax.numpy as jnp

from belt_sim.case import Case, Settings
from belt_sim.curves import Elsewhere
from belt_sim.diagnosis.readings.as_set import Slot, run_at
from belt_sim.diagnosis.readings.effect_hints import AFFINE
from belt_sim.diagnosis.readings.elsewhere import sensed
from belt_sim.effects.base import Effect, apply_hook, overrides
from belt_sim.effects.pipeline import true_travel
from belt_sim.jax_setup import PROGRAMS, compiled
from belt_sim.laws.drive import Reading

READ_BY = ("encoder", "seen", "sensor")  # hooks by which readings are what they are


def only_added(classes: Sequence[type[Effect]]) -> tuple[type[Effect], ...]:
    """Those of ``classes`` whose readings can be added to those of a march without them."""
    sensors = [c for c in classes if overrides(c, ("sensor",))]
    simple = all(c.is_additive() or c.id in AFFINE for c in sensors)
    return tuple(c for c in classes if c.is_additive()) if simple else ()


def of_readings(classes: Sequence[type[Effect]], adding: Sequence[type[Effect]]) -> list[type[Effect]]:
    """The effects on which it depends what ``adding`` add."""
    return [c for c in classes if c in adding or overrides(c, READ_BY)]


@lru_cache(PROGRAMS)
def compiled_added(slots: tuple[Slot, ...], adding: tuple[type[Effect], ...], others: tuple[Elsewhere, ...] = ()):
    """What the effects ``adding`` add to the readings of a batch of points and runs."""
    one = partial(_one_added, slots=slots, adding=adding, others=others)
    return compiled(jax.vmap(one, in_axes=(0, 0, 0, 0, 0, 0, None, None)))


def _one_added(vector, shown, settings: Settings, travel, time, yaw_at, rig, belt, *, slots, adding, others):
    """What effects add to the readings of one run at every place, (6, n), and at the ``others``, (k, n).

    Readings show as much of each number as ``shown`` says; where the sensors were zeroed all of it stood.
    """

    def added(numbers, travel, time):
        effects, case = run_at(numbers, slots, Case(rig=rig, belt=belt, settings=settings))
        return _added(effects, adding, case, travel, time, others)

    zero = added(vector, yaw_at[None], yaw_at[None] / settings.speed)
    found = added(vector * shown, travel, time) - zero
    return jnp.concatenate([found[:4], jnp.zeros((2, found.shape[1])), found[4:]])


def _added(effects: Sequence[Effect], adding: Sequence[type[Effect]], case: Case, stated, time, others):
    """What those of ``effects`` that are of the classes ``adding`` add to y at points 1-4 and at the ``others``, shape
    (4 + k, n), at encoder travels ``stated`` [m] and times ``time`` [s], both (n,)."""
    seen = apply_hook(effects, "seen", true_travel(effects, case, stated), case)

    def shown(some):
        none = jnp.zeros((4, len(stated)))
        reading = Reading(travel=stated, seen=seen, time=time, y=none, tilt=none[:2])
        beside = [sensed(place, none[0], case, some, stated, seen, time)[None] for place in others]
        return jnp.concatenate([apply_hook(some, "sensor", reading, case).y, *beside])

    return shown(effects) - shown([e for e in effects if type(e) not in adding])
