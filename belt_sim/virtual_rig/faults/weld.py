"""A weld: a kink of the belt over a raised cosine; at travel 0 it lies ``at`` along the belt from point 4 over 1, 2, 3.

Elastic part by Betti: a kink at x bends the run-up by minus the curvature at x per unit run-up angle; the kink itself
counts while it runs up, so that one passage, once a belt length, turns the belt by -angle in all. A span
that hangs rolls while a kink is in it.
"""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.load import bent_by_nature

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
        to_tail, to_head = self._places(s, line)
        return self.angle * np.stack([self._span(to_tail, line), self._span(to_head, line)])

    def loads(self, line):
        return bent_by_nature(line, True), bent_by_nature(line, False)

    def push(self, s, line, load, free, kept):
        to_tail, to_head = self._places(s, line)
        place = np.where((line.direction > 0) == load.upper, to_tail, to_head)
        per_metre = load.along * (load.along.shape[1] / line.span_length)[:, None]
        return self.angle * self._felt(place, line, per_metre) + 0 * free, kept

    def _places(self, s, line):
        """How far the weld is behind the run-offs of the spans to tail and head pulley at travel s."""
        behind_point_3 = 2 * line.span_length + line.wrap_tail - self.at
        place = np.where(line.direction > 0, self.at, behind_point_3) + s
        return place, place - line.span_length - line.wrap_tail

    def _span(self, place, line):
        """Curvature at a span's run-up from a unit kink at ``place`` behind its run-off, shape (batch,)."""
        passing = (line.span_length - self._here(place, line)) / self.LENGTH
        bump = np.where(np.abs(passing) < 0.5, (1 + np.cos(2 * np.pi * passing)) / self.LENGTH, 0.0)
        return bump - self._felt(place, line, line.turning)

    def _here(self, place, line):
        """The same place in the revolution in which the weld is not yet out of the span."""
        return np.mod(place + self.LENGTH / 2, line.belt_length) - self.LENGTH / 2

    def _felt(self, place, line, rows):
        """Rows (batch, n), given in the middle of every element, felt by a unit kink at places (..., batch)."""
        length = line.span_length[:, None]
        local = self._here(place, line)[..., None] + _POINTS * self.LENGTH
        inside = (local > 0) & (local < length)
        cell = np.clip((local / length) * rows.shape[1] - 0.5, 0, rows.shape[1] - 1.001)
        k, t = cell.astype(int), cell % 1
        lanes = np.arange(len(rows))[:, None]
        felt = (1 - t) * rows[lanes, k] + t * rows[lanes, k + 1]
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
