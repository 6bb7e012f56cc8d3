"""The loaded belt at rest: stations at equal chords round two pulleys and along two spans that hang as catenaries."""

import math
from dataclasses import dataclass
from types import ModuleType

import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case
from belt_sim.case import Numbers as Array
from belt_sim.errors import InputError

_TANGENT_SWEEPS = 16  # each shrinks the error of the tangent points by (pulley radius) x (curvature of the span)


@dataclass(frozen=True)
class Catenary:
    """z' = sinh(middle + curvature (x - x of the middle)): a belt of uniform weight whose horizontal pull is uniform.

    start, shape (2,): x and z of its left end [m]; run [m]: horizontal distance of its ends; half: curvature run / 2,
    curvature [1/m] = weight per length over horizontal pull, 0 = straight.
    """

    start: np.ndarray
    run: float
    middle: float
    half: float

    @staticmethod
    def from_points(start: np.ndarray, end: np.ndarray, curvature: float) -> "Catenary":
        """From one point to another, x and z [m], to the right of it."""
        run, rise = float(end[0] - start[0]), float(end[1] - start[1])
        half = 0.5 * curvature * run
        return Catenary(start, run, math.asinh(rise / (run * float(_sinhc(half)))), half)

    @staticmethod
    def from_circles(a: float, head: float, tail: float, curvature: float) -> "Catenary":
        """Touches circles of these radii [m] at 0 and ``a`` from above; from below for negative radii."""
        span = Catenary.from_points(np.array([0.0, head]), np.array([a, tail]), curvature)
        for _ in range(_TANGENT_SWEEPS):
            ends = [r * np.array([-math.sin(s), math.cos(s)]) for r, s in zip((head, tail), span.slopes, strict=True)]
            span = Catenary.from_points(ends[0], ends[1] + [a, 0.0], curvature)
        return span

    @property
    def slopes(self) -> tuple[float, float]:
        """Angles of the span above the horizontal at its left and its right end [rad]."""
        return math.atan(math.sinh(self.middle - self.half)), math.atan(math.sinh(self.middle + self.half))

    @property
    def length(self) -> float:
        """[m] along the span."""
        return self.run * math.cosh(self.middle) * float(_sinhc(self.half))

    def divide(self, links: int) -> np.ndarray:
        """Points that divide the span into so many equal lengths, without its ends, shape (links - 1, 2) [m]."""
        share = np.arange(1, links) / links
        if self.half:
            first, last = math.sinh(self.middle - self.half), math.sinh(self.middle + self.half)
            share = (np.arcsinh(first + share * (last - first)) - self.middle + self.half) / (2.0 * self.half)
        up = share * _sinhc(self.half * share) * np.sinh(self.middle + self.half * (share - 1.0))
        return self.start + self.run * np.stack([share, up], axis=1)


def _sinhc(u) -> np.ndarray:
    u = np.asarray(u, float)
    return np.where(np.abs(u) < 1e-8, 1.0, np.sinh(u) / np.where(u == 0.0, 1.0, u))


_SINKING = 4  # chords, at most


def sink_chords(chord: float, radius: float) -> int:
    """Chords along which a station sinks; with two more at either end of half a wrap some stay on the circle."""
    return min(max(int(0.5 * math.pi * radius / chord) - 3, 1), _SINKING)


def lift(depth: Array, chord: Array, radius: Array, along: Array | None = None) -> Array:
    """Height above the circle [m] of stations that lie ``depth`` [m] behind the place where the belt meets the pulley.

    Straight up to half a chord, then a cubic to 0 with the slope of either side; along: ``sink_chords``.
    """
    xp = library_of(depth)
    along = sink_chords(chord, radius) if along is None else along
    straight = radius / xp.cos(xp.minimum(depth, 0.5 * chord) / radius) - radius
    t = xp.clip((depth / chord - 0.5) / along, 0.0, 1.0)
    return straight * (1.0 - smoothstep(t)) + (0.5 * chord**2 / radius * along) * t * (1.0 - t) ** 2


def smoothstep(u: Array) -> Array:
    """From 0 at u = 0 to 1 at 1 and beyond, 3 u^2 - 2 u^3."""
    u = library_of(u).minimum(u, 1.0)
    return u * u * (3.0 - 2.0 * u)


def library_of(values: Array) -> ModuleType:
    """NumPy for its arrays and for plain numbers, jax.numpy for JAX's arrays and tracers."""
    return np if isinstance(values, (np.ndarray, np.generic, float)) else jnp


def chord_angle(square: Array, r1: Array, r2: Array) -> Array:
    """Angle [rad] between places at radii r1, r2 [m]; square [m2]: of their distance in the plane of the pulley."""
    xp = library_of(r1)
    return 2.0 * xp.arcsin(xp.sqrt((square - (r1 - r2) ** 2) / (4.0 * r1 * r2)))


_CHORD_SWEEPS = 12  # the chord is right to rounding after a few
_PATH_SWEEPS = 8  # so are the places near the spans
_TURN_SWEEPS = 12  # so is the place of the tail pulley's first station


@dataclass(frozen=True)
class LaidLoop:
    """Stations in the order in which the upper span runs from head to tail, where they will run.

    x, z [m], shape (n,); on_head, on_tail: which of them lie on the pulleys, shape (n,); chord [m] between
    neighbours, loaded; radius_head, radius_tail [m]: circles of the stations on the pulleys, wider than the pulleys
    so that a chord stands for its arc; centre_distance [m].
    """

    x: np.ndarray
    z: np.ndarray
    on_head: np.ndarray
    on_tail: np.ndarray
    chord: float
    radius_head: float
    radius_tail: float
    centre_distance: float


@dataclass(frozen=True)
class HangingBelt:
    """The smooth belt on the pulleys: its spans, the arcs on head and tail and its length, loaded [m]."""

    upper: Catenary
    lower: Catenary
    head: float
    tail: float
    length: float

    @staticmethod
    def from_case(case: Case) -> "HangingBelt":
        """At the case's tension and gravity, on the pulleys themselves."""
        a, curvature = float(case.rig.centre_distance), float(case.sag_curvature)
        head, tail = float(case.rig.head_radius), float(case.rig.tail_radius)
        upper, lower = (Catenary.from_circles(a, side * head, side * tail, curvature) for side in (1.0, -1.0))
        on_head = head * (math.pi + lower.slopes[0] - upper.slopes[0])
        on_tail = tail * (math.pi - lower.slopes[1] + upper.slopes[1])
        return HangingBelt(upper, lower, on_head, on_tail, upper.length + lower.length + on_head + on_tail)


def stations_of(case: Case, dx: float) -> int:
    """Number of stations about ``dx`` [m] apart, an even one."""
    return 2 * round(float(case.rig.belt_length) / dx / 2.0)


def lay_loop(case: Case, dx: float, stations: int = 0, *, path=lift) -> LaidLoop:
    """The loop at the case's tension and gravity with stations about dx [m] apart, or with so many stations.

    path(depth, chord, radius): height [m] above the circle at which stations come and go, as ``lift``.

    Raises InputError when a pulley would carry too few stations.
    """
    rig = case.rig
    longest = min(float(rig.head_radius), float(rig.tail_radius)) / (4.0 if path is lift else 3.0)
    if dx > longest:
        raise InputError("model.dx", dx, "m", f"a pulley carries too few stations: give at most {longest:.3f}")
    n = stations or stations_of(case, dx)
    hanging = HangingBelt.from_case(case)
    chord = hanging.length / n
    # one station lies where the upper span touches the head; one less than half a chord away from a pulley lies on it:
    # its links press it down
    upper = round(hanging.upper.length / chord)
    on_head = round(hanging.head / chord)
    on_tail = round((hanging.tail - upper * chord + hanging.upper.length) / chord)
    lower = n - on_head - upper - on_tail
    a, curvature = float(rig.centre_distance), float(case.sag_curvature)
    last = -hanging.upper.slopes[0]
    at_head = (last - hanging.head / float(rig.head_radius), last)
    at_tail = (-hanging.upper.slopes[1], -hanging.upper.slopes[1] + hanging.tail / float(rig.tail_radius))
    for _ in range(_CHORD_SWEEPS):
        # stations with this chord everywhere but in the lower span, whose length says how far off it is
        head, tail = (0.5 * chord / math.sin(0.5 * chord / float(r)) for r in (rig.head_radius, rig.tail_radius))
        turn = last + chord / float(rig.head_radius) * np.arange(-on_head, 1)
        behind = _wrap_stations(float(rig.head_radius), turn, 0.0, chord, at_head, path)
        turn = at_tail[0] + chord / float(rig.tail_radius) * np.arange(on_tail + 1)
        bow = 1.0 + (curvature * chord) ** 2 / 24.0  # length of a link's arc over its chord
        for _ in range(_TURN_SWEEPS):
            ahead = _wrap_stations(float(rig.tail_radius), turn, a, chord, at_tail, path)
            over = Catenary.from_points(behind[-1], ahead[0], curvature)
            earlier, turn = turn, turn + (upper * chord * bow - over.length) / tail
            if np.array_equal(turn, earlier):
                break
        under = Catenary.from_points(behind[0], ahead[-1], curvature)
        parts = (behind[-1:], over.divide(upper), ahead, under.divide(lower)[::-1], behind[:-1])
        where = np.repeat([0, 1, 2, 1, 0], [len(p) for p in parts])
        x, z = np.concatenate(parts).T
        loop = LaidLoop(
            x=x, z=z, on_head=where == 0, on_tail=where == 2, chord=chord, radius_head=head, radius_tail=tail,
            centre_distance=a,
        )  # fmt: skip
        before, chord = chord, chord + (under.length / bow - lower * chord) / n
        if chord == before:
            break
    return loop


def _wrap_stations(
    radius: float, turn: np.ndarray, x: float, chord: float, meets: tuple[float, float], path
) -> np.ndarray:
    """Stations on a pulley, shape (k, 2) [m]; turn [rad]: their angles if they all lay on one circle.

    meets [rad]: where the belt comes and goes; the middle station keeps its angle.
    """
    middle, circle = len(turn) // 2, 0.5 * chord / math.sin(0.5 * chord / radius)
    angle = turn.copy()
    for _ in range(_PATH_SWEEPS):
        r = circle + sum(path(radius * depth, chord, radius) for depth in (angle - meets[0], meets[1] - angle))
        steps = np.concatenate([[0.0], np.cumsum(chord_angle(chord**2, r[1:], r[:-1]))])
        before, angle = angle, turn[middle] + steps - steps[middle]
        if np.array_equal(angle, before):
            break
    return np.stack([x + r * np.sin(angle), r * np.cos(angle)], axis=1)
