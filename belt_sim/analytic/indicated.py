"""What the instruments show of a march: the sensor law, where effects of this law act."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np

from belt_sim.analytic.march import KEEP, STEP, march
from belt_sim.analytic.model import Model
from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.effects.base import uses
from belt_sim.laws.sensor import Reading


def indicated_march(
    case: Case, model: Model, effects=(), *, travel: float, step: float = STEP, keep: float = KEEP
) -> Curves:
    """Like ``march``, as encoder and edge sensors indicate it: travel of the encoder, y and tilt as shown."""
    if not uses(effects, "encoder") + uses(effects, "sensor"):
        return march(case, model, effects, travel=travel, step=step, keep=keep)
    far = max(travel, float(true_travel(effects, case, travel)))
    return indicate(march(case, model, effects, travel=far, step=step, keep=keep), case, effects, travel, keep)


def true_travel(effects, case: Case, travel):
    """Belt travel [m] when the encoder says ``travel`` [m]."""
    for e in uses(effects, "encoder"):
        travel = e.encoder(travel, case)
    return travel


def indicate(curves: Curves, case: Case, effects, travel: float, keep: float = KEEP) -> Curves:
    """Curves read every ``keep`` [m] of the encoder up to ``travel`` [m]; they must reach far enough."""
    shown = np.linspace(0.0, travel, max(1, round(travel / keep)) + 1)
    true = np.asarray(true_travel(effects, case, shown))

    def read(rows):
        if rows is None:
            return None
        return np.stack([np.interp(true, np.asarray(curves.travel), row) for row in np.asarray(rows)])

    rows = {name: read(getattr(curves, name)) for name in ("y", "angle", "moment", "edge_stress", "tilt")}
    reading = Reading(
        travel=jnp.asarray(shown),
        true_travel=jnp.asarray(true),
        time=jnp.asarray(true / case.settings.speed),
        y=jnp.asarray(rows["y"]),
        tilt=jnp.asarray(rows["tilt"]),
    )
    for e in uses(effects, "sensor"):
        reading = e.sensor(reading, case)
    seen = {"y": np.asarray(reading.y), "tilt": np.asarray(reading.tilt)}
    return replace(curves, travel=shown, **(rows | seen))
