"""What effects do before and after an engine: settings as they are, then readings as the instruments show them.

Every engine runs this way -- drive, engine, sensor -- and the fit of a campaign traces the same functions.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case, Schedule
from belt_sim.curves import Curves
from belt_sim.effects.base import AFTER_ENGINE, Effect, apply_hook, call_hook, uses
from belt_sim.jax_setup import in_float64
from belt_sim.line.runup import Reading

#: arrays of Curves that are looked up at the travel that the encoder shows
_ROWS = ("angle", "moment", "edge_stress", "tilt")


@in_float64
def as_indicated(
    engine: Callable[[Case, float], Curves], case: Case, effects: Sequence[Effect], travel: float
) -> Curves:
    """Curves of ``engine(case as driven, travel)`` as encoder and sensors show them, up to ``travel`` [m].

    The engine is run as far as the belt goes while the encoder counts that much; its records are spread over what the
    encoder shows, so that without an encoder's error they are read where they are.
    """
    driven, far = asked_of_engine(case, effects, travel)
    curves = engine(driven, far)
    if not any(uses(effects, hook) for hook in AFTER_ENGINE):
        return curves
    return as_numpy(indicate(curves, case, effects, np.asarray(curves.travel) * (travel / far)))


@in_float64
def asked_of_engine(case: Case, effects: Sequence[Effect], travel: float) -> tuple[Case, float]:
    """The case as driven, and how far an engine has to run it [m] for curves over ``travel`` [m] as indicated."""
    driven = as_driven(case, effects)
    if not any(uses(effects, hook) for hook in AFTER_ENGINE):
        return driven, travel
    return driven, max(travel, float(true_travel(effects, case, travel)))


def as_driven(case: Case, effects: Sequence[Effect]) -> Case:
    """The case with tension and yaw as they are, not as they were commanded (drive law), and turned when the encoder
    shows the stated travel, not when the belt has gone so far.
    """
    for e in uses(effects, "settings"):
        case = replace(case, settings=call_hook(e, "settings", case.settings, case))
    if not uses(effects, "encoder"):
        return case
    yaw, head = (_as_shown(s, case, effects) for s in (case.settings.yaw, case.settings.yaw_head))
    return replace(case, settings=replace(case.settings, yaw=yaw, yaw_head=head))


def _as_shown(schedule: Schedule, case: Case, effects: Sequence[Effect]) -> Schedule:
    """A schedule against what the encoder shows, against the belt's own travel."""
    at, end = (true_travel(effects, case, x) for x in (schedule.at, schedule.at + schedule.over))
    return replace(schedule, at=at, over=end - at)


def true_travel(effects: Sequence[Effect], case: Case, travel):
    """Belt travel [m] when the encoder says ``travel`` [m]."""
    return apply_hook(effects, "encoder", travel, case)


@in_float64
def indicate(curves: Curves, case: Case, effects: Sequence[Effect], shown, time=None) -> Curves:
    """True curves as read at encoder travels ``shown`` [m], shape (n,); they must reach far enough.

    time [s], shape (n,): of the samples; by default that at which the belt's speed brings it there.
    """
    shown = jnp.asarray(shown)
    true = true_travel(effects, case, shown)
    seen = apply_hook(effects, "sensor_travel", true, case)
    rows = {n: looked_up(curves.travel, getattr(curves, n), true) for n in _ROWS if getattr(curves, n) is not None}
    rows["y"] = looked_up(curves.travel, curves.y, seen)
    extra = {n: looked_up(curves.travel, jnp.asarray(row)[None], true)[0] for n, row in (curves.extra or {}).items()}
    reading = Reading(
        travel=shown,
        sensor_travel=seen,
        time=true / case.settings.speed if time is None else time,
        y=rows["y"],
        tilt=rows.get("tilt", jnp.zeros((2, len(shown)))),
    )
    reading = apply_hook(effects, "sensor", reading, case)
    rows |= {"y": reading.y} | ({"tilt": reading.tilt} if "tilt" in rows else {})
    return replace(curves, travel=shown, extra=extra or None, **rows)


def as_numpy(curves: Curves) -> Curves:
    """The same numbers as NumPy arrays."""
    plain: dict[str, Any] = {n: np.asarray(v) for n, v in vars(curves).items() if v is not None and n != "extra"}
    extra = None if curves.extra is None else {n: np.asarray(v) for n, v in curves.extra.items()}
    return replace(curves, extra=extra, **plain)


def looked_up(travel, rows, where):
    """Rows (k, records) at ``travel`` (records,), looked up at ``where`` (n,) by cubics through four records."""
    travel, rows = jnp.asarray(travel), jnp.asarray(rows)
    if len(travel) < 4:
        return jnp.stack([jnp.interp(where, travel, row) for row in rows])
    where = jnp.clip(where, travel[0], travel[-1])
    left = jnp.clip(jnp.searchsorted(travel, where, side="right") - 1, 1, len(travel) - 3)
    nodes = [travel[left + k] for k in (-1, 0, 1, 2)]
    total = 0.0
    for k, node in enumerate(nodes):
        others = [n for j, n in enumerate(nodes) if j != k]
        weight = 1.0
        for other in others:
            weight = weight * (where - other) / (node - other)
        total = total + weight * rows[:, left + k - 1]
    return total
