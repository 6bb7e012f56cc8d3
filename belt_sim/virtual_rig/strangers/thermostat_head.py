"""A fan cools the head pulley's bearing in turns: its yaw swings to and fro in straight strokes, in time."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class ThermostatHead(Stranger):
    id = "thermostat_head"
    blind = True
    sizes = {"amplitude": Size(unit="rad", typical=1e-4, limit=5e-3)}
    place, variable, form = "yaw_head", "wave", "periodic"
    also = (("time_since_step", "periodic"), ("travel", "periodic"))
    amplitude: float = 0.0
    period: float = 40.0
    phase: float = 0.0

    def yaw_head(self, s, line):
        return self.amplitude * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * s / line.speed / self.period + self.phase))

    @classmethod
    def shape_by_lot(cls, plan, rng):
        lasts = plan.length / plan.runs[0].speed
        return {"period": float(rng.uniform(0.1, 0.5) * lasts), "phase": float(rng.uniform(0, 2 * np.pi))}
