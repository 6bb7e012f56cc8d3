"""Loads beside the pulleys: idlers, scrapers, guides, weight."""

from dataclasses import dataclass, replace

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.load import couple_at, force_at, uniform_force, uniform_roll_couple


class AtAPlace:
    """Mixed into a fault with a ``place``."""

    @classmethod
    def random_shape(cls, plan, rng):
        return {"place": float(rng.uniform(0.1, 0.9))}

    @classmethod
    def shapes(cls, plan):
        return tuple({"place": place} for place in (0.15, 0.4, 0.6, 0.85))


@dataclass(frozen=True, kw_only=True)
class IdlerSkew(AtAPlace, Fault):
    """A skewed idler pushes the upper span towards +y, and to the other side when the belt runs backwards."""

    id = "idler_skew"
    sizes = {"force": Size(unit="N", typical=0.2, limit=50.0)}
    draw_order = 23
    force: float = 0.0
    place: float = 0.5

    def loads(self, line):
        return (force_at(line, True, self.place),)

    def push(self, s, line, load, free, kept):
        return self.force * line.direction, kept

    def scene(self, parts, case):
        force = self.force * float(case.settings.direction)
        return parts.with_push(span="upper", x=self.place * float(case.rig.centre_distance), across=force)


@dataclass(frozen=True, kw_only=True)
class SideDrag(AtAPlace, Fault):
    """A scraper drags on one edge of the upper span: a couple about the vertical, positive for the edge y > 0."""

    id = "side_drag"
    sizes = {"moment": Size(unit="N m", typical=0.5, limit=50.0)}
    draw_order = 24
    moment: float = 0.0
    place: float = 0.5

    def loads(self, line):
        """The drag -D t on the edge at b/2 turns y' upwards along the travel t, whichever way the belt runs."""
        return (couple_at(line, True, self.place),)

    def push(self, s, line, load, free, kept):
        return self.moment + 0 * free, kept

    def scene(self, parts, case):
        """The drag itself, against the travel at one edge: on the middle of the belt, and the couple to the edge."""
        half, travel = 0.5 * float(case.belt.width), float(case.settings.direction)
        drag = abs(self.moment) / half
        x = self.place * float(case.rig.centre_distance)
        return parts.with_push(span="upper", x=x, along=-drag * travel, couple=self.moment * travel)


@dataclass(frozen=True, kw_only=True)
class EdgeGuide(Fault):
    """Rollers on both sides of a span, ``at`` from the tail pulley: elastic stops for a belt ``gap`` off the middle."""

    id = "edge_guide"
    sizes = {
        "stiffness": Size(unit="N/m", typical=1e5, limit=1e7),
        "stiffness_lower": Size(unit="N/m", typical=1e5, limit=1e7),
    }
    positive = True
    draw_order = 29
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
    def random_shape(cls, plan, rng):
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


@dataclass(frozen=True, kw_only=True)
class MachineTilt(Fault):
    """The machine leans about its long axis: a share of the belt's weight, q angle, pulls both spans towards +y."""

    id = "machine_tilt"
    sizes = {"angle": Size(unit="rad", typical=2e-3, limit=0.05)}
    draw_order = 22
    angle: float = 0.0

    def loads(self, line):
        return uniform_force(line, True), uniform_force(line, False)

    def push(self, s, line, load, free, kept):
        weight = line.density * line.gravity * line.width * line.thickness
        return self.angle * weight, kept

    def scene(self, parts, case):
        return replace(parts, lean=parts.lean + self.angle)


@dataclass(frozen=True, kw_only=True)
class OffCentreLoad(Fault):
    """A load beside the middle of the upper span rolls it, its side y > 0 down; a belt that cannot roll stays."""

    id = "off_centre_load"
    sizes = {"moment": Size(unit="N", typical=2e-3, limit=1.0)}
    draw_order = 25
    idle_on = ("beam_th2",)
    moment: float = 0.0

    def loads(self, line):
        return (uniform_roll_couple(line, True),)

    def push(self, s, line, load, free, kept):
        return -self.moment + 0 * free, kept

    def scene(self, parts, case):
        return replace(parts, roll=parts.roll - self.moment)
