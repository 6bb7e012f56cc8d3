"""Loads on the spans."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size, Unmodelled
from belt_sim.virtual_rig.load import force_at
from belt_sim.virtual_rig.time_courses import random_course


@dataclass(frozen=True, kw_only=True)
class BentIdler(Unmodelled):
    """A bent idler under the lower span pushes it to and fro as it turns."""

    id = "bent_idler"
    blind = True
    sizes = {"force": Size(unit="N", typical=1.0, limit=200.0)}
    place, variable, form = "span", "wave", "periodic"
    also = (("travel", "periodic"),)
    force: float = 0.0
    wavelength: float = 2.2
    phase: float = 0.0
    share: float = 0.5

    def loads(self, line):
        return (force_at(line, False, self.share),)

    def push(self, s, line, load, free, kept):
        return self.force * np.cos(2 * np.pi * s / self.wavelength + self.phase) + 0 * free, kept

    @classmethod
    def random_shape(cls, plan, rng):
        drawn = {
            "wavelength": rng.uniform(1.5, 4.5),
            "phase": rng.uniform(0, 2 * np.pi),
            "share": rng.uniform(0.2, 0.8),
        }
        return {name: float(value) for name, value in drawn.items()}


@dataclass(frozen=True, kw_only=True)
class StickyRest(Unmodelled):
    """A rest under the upper span sticks to the belt up to a force, then slides with it: it remembers the belt."""

    id = "sticky_rest"
    blind = True
    sizes = {"force": Size(unit="N", typical=0.5, limit=100.0)}
    positive = True
    place, variable, form = "span", "y", "saturating"
    also = (("y", "threshold"), ("y", "linear"), ("contact_angle", "threshold"), ("contact_angle", "constant"))
    force: float = 0.0
    stiffness: float = 5e3
    share: float = 0.5

    def loads(self, line):
        return (force_at(line, True, self.share),)

    def push(self, s, line, load, free, kept):
        stiffness = self.stiffness / (1 + self.stiffness * load.give)
        held = np.clip(stiffness * (free - kept), -self.force, self.force)
        return -held, free - held / stiffness

    @classmethod
    def random_shape(cls, plan, rng):
        return {"stiffness": float(10 ** rng.uniform(2.5, 4.5)), "share": float(rng.uniform(0.2, 0.8))}


@dataclass(frozen=True, kw_only=True)
class WindSteps(Unmodelled):
    """Wind presses on both spans, changing every 9 m: p bends a clamped span by p L^2/(12 EI) at its end."""

    id = "wind_steps"
    sizes = {"pressure": Size(unit="N/m", typical=0.03, limit=5.0)}
    positive = True
    place, variable, form = "span", "travel", "random"
    pressure: float = 0.0
    seed: int = 0

    def turn(self, s, line, y, kappa):
        gust = random_course(self.seed, line.run, s / 9.0)
        return np.broadcast_to(self.pressure * gust * line.span_length**2 / (12 * line.bending), y.shape)

    @classmethod
    def random_shape(cls, plan, rng):
        return {"seed": int(rng.integers(2**31))}
