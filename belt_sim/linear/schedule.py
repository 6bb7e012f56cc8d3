"""Gain scheduling: plants at several tensions, and one at any tension between them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import PchipInterpolator

from belt_sim.errors import InputError
from belt_sim.linear.plant import LinearBelt
from belt_sim.si import N_PER_MM2


@dataclass(frozen=True)
class PlantSchedule:
    """Plants of one rig, belt and model in order of tension; their coefficients are interpolated monotonically."""

    plants: tuple[LinearBelt, ...]

    @staticmethod
    def of(plants: Sequence[LinearBelt]) -> "PlantSchedule":
        """Sorted by tension; raises InputError when a tension is there twice or there is but one."""
        ordered = tuple(sorted(plants, key=lambda p: p.tension))
        tensions = [p.tension / N_PER_MM2 for p in ordered]
        if len(set(tensions)) < max(2, len(tensions)):
            raise InputError("tension", tensions, "N/mm2", "give at least two different ones")
        return PlantSchedule(ordered)

    def at(self, tension: float) -> LinearBelt:
        """The plant at ``tension`` [N/mm2], no further than the plants reach (InputError beyond)."""
        known = np.array([p.tension for p in self.plants])
        asked = tension * N_PER_MM2
        if not known[0] <= asked <= known[-1]:
            reach = f"{known[0] / N_PER_MM2:g} to {known[-1] / N_PER_MM2:g}"
            raise InputError("tension", f"{tension:g}", "N/mm2", f"stay within {reach}, where plants were computed")

        def between(name: str) -> np.ndarray:
            return PchipInterpolator(np.log(known), np.stack([getattr(p, name) for p in self.plants]))(np.log(asked))

        return replace(
            self.plants[0],
            tension=float(asked),
            now=between("now"),
            delayed=between("delayed"),
            drive=between("drive"),
            constant=between("constant"),
        )
