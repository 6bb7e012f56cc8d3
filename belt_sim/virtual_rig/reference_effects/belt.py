"""The belt itself: natural curvature, weld, edge, sag."""

from dataclasses import dataclass, make_dataclass, replace

import numpy as np

from belt_sim.rig import GRAVITY
from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.load import tilt_sensitivity


@dataclass(frozen=True, kw_only=True)
class Camber(Fault):
    """The belt is curved in its plane by nature; by Betti a run-up feels what its span's shape does not take up."""

    id = "camber"
    sizes = {"kappa_c": Size(unit="1/m", typical=2e-5, limit=1e-3)}
    draw_order = 27
    kappa_c: float = 0.0

    def turn(self, s, line, y, kappa):
        left = 1 - line.runup_sensitivity.mean(axis=1) * line.span_length
        return np.broadcast_to(self.kappa_c * left, kappa.shape)

    def read(self, value, place, s, line):
        if not place.endswith("mid_span"):
            return value
        per_curvature = line.bending * line.span_length * tilt_sensitivity(line, place == "upper_mid_span").mean(axis=1)
        return value + self.kappa_c * per_curvature

    def scene(self, parts, case):
        return parts.with_camber(lambda s: np.full(np.shape(s), self.kappa_c)) if self.kappa_c else parts


@dataclass(frozen=True, kw_only=True)
class Flatness(Fault):
    """Residual stress of the strip, amplitude (1 - 12 y^2/b^2) across its width; positive: long edges."""

    id = "flatness"
    sizes = {"amplitude": Size(unit="Pa", typical=4e6, limit=2e7)}
    amplitude: float = 0.0

    def set(self, line):
        return replace(line, residual=line.residual + self.amplitude)


_POINTS = (np.arange(16) + 0.5) / 16 - 0.5  # quadrature over the bend


_SHAPE = 1 + np.cos(2 * np.pi * _POINTS)


@dataclass(frozen=True, kw_only=True)
class Weld(Fault):
    """A weld: a kink of the belt over a raised cosine; at travel 0 it lies ``at`` along the belt from point 4 over 1,
    2, 3.

    Elastic part by Betti: a kink at x bends the run-up by minus the curvature at x per unit run-up angle; the kink
    itself counts while it runs up, so that one passage, once a belt length, turns the belt by -angle in all.
    """

    id = "weld"
    sizes = {"angle": Size(unit="rad", typical=2e-4, limit=2e-3)}
    draw_order = 28
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
        tilt = self._felt(self._last(behind, line), tilt_sensitivity(line, upper), line)
        return value + self.angle * line.bending * tilt

    def _places(self, s, line):
        """How far the kink lies behind the run-off of the span to the tail, and of that to the head, not wrapped."""
        behind_point_3 = 2 * line.span_length + line.wrap_tail - self.at
        place = np.where(line.direction > 0, self.at, behind_point_3) + s
        place = place + line.start
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
        return bump - self._felt(place, line.runup_sensitivity, line)

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
    def random_shape(cls, plan, rng):
        return {"at": float(rng.uniform(0.0, cls._around(plan)))}

    @staticmethod
    def _around(plan):
        """The belt's length."""
        machine = plan.machine
        return 2 * machine.centre_distance.value + np.pi * (machine.head_radius.value + machine.tail_radius.value)

    @classmethod
    def shapes(cls, plan):
        return tuple({"at": share * cls._around(plan)} for share in np.arange(8) / 8)


HARMONICS, DECAY = 40, 1.27


FIRST = 4e-4  # [m]: of the cosine and of the sine, together 0.57 mm


STEEPEST = 1e-2  # [m]: amplitude times harmonic, that is 3 mm/m of slope on a belt of 20 m


_FIELDS = [(f"{kind}{k}", float, 0.0) for k in range(1, HARMONICS + 1) for kind in ("cos", "sin")]


_Harmonics = make_dataclass("_Harmonics", _FIELDS, bases=(Fault,), frozen=True, kw_only=True)


@dataclass(frozen=True, kw_only=True)
class EdgeProfile(_Harmonics):  # type: ignore[misc,valid-type]
    """The belt's edge is not straight: y + e(m) - e(m when the yaw was applied), m the part of the belt.

    e = sum over k of (cosk cos + sink sin)(2 pi k m / belt length), m counted backwards from what was at point 4 at
    travel 0. The last term: y = 0 is where the point was when the yaw was applied. Forty harmonics, drawn with the
    spectrum of a measured edge: amplitudes that fall like k^-1.27 about 0.57 mm for the first.
    """

    id = "edge_profile"
    sizes = {
        name: Size(unit="m", typical=FIRST / int(name[3:]) ** DECAY, limit=STEEPEST / int(name[3:]))
        for name, *_ in _FIELDS
    }
    draw_order = 14
    mixed = True

    def edge(self, place, s, line):
        phase = -2 * np.pi * line.belt_coordinate(place, s) / line.belt_length
        there = [k for k in range(1, HARMONICS + 1) if np.any(self._of(k)[0]) or np.any(self._of(k)[1])]
        return sum((self._of(k)[0] * np.cos(k * phase) + self._of(k)[1] * np.sin(k * phase) for k in there), 0.0)

    def _of(self, k: int):
        return getattr(self, f"cos{k}"), getattr(self, f"sin{k}")


@dataclass(frozen=True, kw_only=True)
class SagRoll(Fault):
    """The sagging belt tilts instead of bending in its plane: 1 makes a flat strip the strip.

    The base has none of it (beam_th2) or all (strip), and the fault adds ``strength`` to that share. In the scene,
    where a belt tilts because it hangs, the share is that of its weight: a belt of base beam_th2 has none until this
    fault.
    """

    id = "sag_roll"
    sizes = {"strength": Size(unit="1", typical=1.0, limit=1.5)}
    draw_order = 15
    fixed = True
    part_of = ("strip",)
    strength: float = 0.0

    def set(self, line):
        return replace(line, sag_roll=line.sag_roll + self.strength)

    def scene(self, parts, case):
        return replace(parts, gravity=parts.gravity + self.strength * GRAVITY)
