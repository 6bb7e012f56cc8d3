"""A weld: a kink of the belt over a raised cosine; at travel 0 it lies ``at`` along the belt from point 4 over 1, 2, 3.

Elastic part by Betti: a kink at x bends the run-up by minus the curvature at x per unit run-up angle; the kink itself
counts while it runs up, so that one passage, once a belt length, turns the belt by -angle in all.
"""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.load import tilting

_POINTS = (np.arange(16) + 0.5) / 16 - 0.5  # quadrature over the bend
_SHAPE = 1 + np.cos(2 * np.pi * _POINTS)


@dataclass(frozen=True, kw_only=True)
class Weld(Fault):
    id = "weld"
    sizes = {"angle": Size(unit="rad", typical=2e-4, limit=2e-3)}
    lot = 28
    LENGTH = 0.6  # [m], wide against a step of the march
    angle: float = 0.0
    at: float = 5.64

    def turn(self, s, line, y, kappa):
        return self.angle * np.stack([self._at_runup(place, line) for place in self._places(s, line)])

    def read(self, value, place, s, line):
        if not place.endswith("mid_span"):
            return value
        upper = place == "upper_mid_span"
        behind = np.where((line.direction > 0) == upper, *self._places(s, line))
        return value + self.angle * line.bending * self._felt(self._last(behind, line), tilting(line, upper), line)

    def _places(self, s, line):
        """How far the kink lies behind the run-off of the span to the tail, and of that to the head, not wrapped."""
        behind_point_3 = 2 * line.span_length + line.wrap_tail - self.at
        place = np.where(line.direction > 0, self.at, behind_point_3) + s
        return place, place - line.span_length - line.wrap_tail

    def _last(self, place, line):
        """The same on the last way round the belt."""
        half = self.LENGTH / 2
        return np.mod(place + half, line.belt_length) - half

    def _at_runup(self, place, line):
        """Curvature at a span's run-up from a unit kink at ``place`` behind its run-off, shape (batch,)."""
        place = self._last(place, line)
        passing = (line.span_length - place) / self.LENGTH
        bump = np.where(np.abs(passing) < 0.5, (1 + np.cos(2 * np.pi * passing)) / self.LENGTH, 0.0)
        return bump - self._felt(place, line.turning, line)

    def _felt(self, place, bent, line):
        """Mean over a unit kink at ``place`` (..., batch) of the curvature ``bent`` (batch, n) along a span."""
        length = line.span_length[:, None]
        local = place[..., None] + _POINTS * self.LENGTH
        inside = (local > 0) & (local < length)
        cell = np.clip((local / length) * bent.shape[1] - 0.5, 0, bent.shape[1] - 1.001)
        k, t = cell.astype(int), cell % 1
        rows = np.arange(len(bent))[:, None]
        felt = (1 - t) * bent[rows, k] + t * bent[rows, k + 1]
        return (felt * inside) @ _SHAPE / len(_SHAPE)

    def scene(self, parts, case):
        """Curved by nature over the weld's length."""
        length, around = self.LENGTH, float(case.rig.belt_length)

        def camber(s):
            off = (s - self.at + 0.5 * around) % around - 0.5 * around
            bent = self.angle / length * (1 + np.cos(2 * np.pi * off / length))
            return np.where(np.abs(off) < 0.5 * length, bent, 0.0)

        return parts.with_camber(camber) if self.angle else parts

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {"at": float(rng.uniform(0.0, cls._around(plan)))}

    @staticmethod
    def _around(plan):
        """The belt's length."""
        machine = plan.machine
        return 2 * machine.centre_distance.value + np.pi * (machine.head_radius.value + machine.tail_radius.value)

    @classmethod
    def shapes(cls, plan):
        return tuple({"at": share * cls._around(plan)} for share in np.arange(8) / 8)
