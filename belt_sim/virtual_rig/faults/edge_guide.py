"""Rollers on both sides of a span, ``at`` from the tail pulley: elastic stops for a belt ``gap`` off the middle."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.load import force_at


@dataclass(frozen=True, kw_only=True)
class EdgeGuide(Fault):
    id = "edge_guide"
    sizes = {
        "stiffness": Size(unit="N/m", typical=1e5, limit=1e7),
        "stiffness_lower": Size(unit="N/m", typical=1e5, limit=1e7),
    }
    positive = True
    lot = 29
    stiffness: float = 0.0
    stiffness_lower: float = 0.0
    gap: float = 5e-4
    at: float = 1.0

    def loads(self, line):
        share = 1 - self.at / line.span_length
        return force_at(line, True, share), force_at(line, False, share)

    def push(self, s, line, load, free, kept):
        """The roller and the span give way together: k (|y| - gap) back towards the middle."""
        k = np.broadcast_to(self.stiffness if load.upper else self.stiffness_lower, free.shape)
        beyond = np.maximum(np.abs(free) - self.gap, 0.0)
        return -np.sign(free) * k * beyond / (1 + k * load.give), kept

    def scene(self, parts, case):
        """As lines beside the spans; equal pulleys are taken for the place along the machine."""
        x = float(case.rig.centre_distance) - self.at
        for span, stiffness in (("upper", self.stiffness), ("lower", self.stiffness_lower)):
            for side in (1.0, -1.0) if stiffness else ():
                parts = parts.with_guide(span=span, x=x, gap=self.gap, side=side, stiffness=stiffness)
        return parts

    @classmethod
    def shape_by_lot(cls, plan, rng):
        span = plan.machine.centre_distance.value
        return {"gap": float(rng.uniform(0.1, 0.6) * cls._away(plan)), "at": float(rng.uniform(0.15, 0.85) * span)}

    @staticmethod
    def _away(plan):
        """How far the belt may come in the record: a sixth of what a rope would make of its largest yaw."""
        return max(abs(run.yaw) for run in plan.runs) * plan.length / 6 + 1e-4

    @classmethod
    def shapes(cls, plan):
        span, away = plan.machine.centre_distance.value, cls._away(plan)
        return tuple({"gap": g * away, "at": a * span} for g in (0.2, 0.5) for a in (0.3, 0.7))
