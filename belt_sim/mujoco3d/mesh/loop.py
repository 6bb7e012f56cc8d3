"""The loaded belt at rest: stations at equal chords round two pulleys and along two hanging spans."""

import math
from dataclasses import dataclass

import numpy as np

from belt_sim.case import Case
from belt_sim.errors import InputError
from belt_sim.mujoco3d.mesh.catenary import Catenary
from belt_sim.mujoco3d.mesh.path import apart, lift

_CHORD_SWEEPS = 12  # the chord is right to rounding after a few
_PATH_SWEEPS = 8  # so are the places near the spans
_TURN_SWEEPS = 12  # so is the place of the tail pulley's first station


@dataclass(frozen=True)
class Loop:
    """Stations in the order in which the upper span runs from head to tail, where they will run (path.py).

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
class Hanging:
    """The smooth belt on the pulleys: its spans, and the arcs on head and tail [m]."""

    upper: Catenary
    lower: Catenary
    head: float
    tail: float

    @staticmethod
    def of(case: Case) -> "Hanging":
        """At the case's tension and gravity, on the pulleys themselves."""
        a, curvature = float(case.rig.centre_distance), float(case.sag_curvature)
        head, tail = float(case.rig.head_radius), float(case.rig.tail_radius)
        upper, lower = Catenary.touching(a, head, tail, curvature), Catenary.touching(a, -head, -tail, curvature)
        on_head = math.pi + lower.slopes[0] - upper.slopes[0]
        on_tail = math.pi - lower.slopes[1] + upper.slopes[1]
        return Hanging(upper, lower, head * on_head, tail * on_tail)

    @property
    def length(self) -> float:
        """[m], loaded."""
        return self.upper.length + self.lower.length + self.head + self.tail


def free_length(case: Case) -> float:
    """Stress-free length [m] of the belt that hangs on the case's pulleys at its tension."""
    return Hanging.of(case).length / (1.0 + float(case.settings.tension) / float(case.belt.youngs_modulus))


def station_radius(radius: float, chord: float) -> float:
    """Radius of the circle on which chords of an equal-sided polygon turn by chord / radius each."""
    half = 0.5 * chord / radius
    return 0.5 * chord / math.sin(half)


def laid_loop(case: Case, dx: float, stations: int = 0, *, path=lift) -> Loop:
    """The loop at the case's tension and gravity with stations about dx [m] apart, or with so many stations.

    path(depth, chord, radius): height [m] above the circle at which stations come and go, as path.lift.

    Raises InputError when a pulley would carry too few stations.
    """
    rig = case.rig
    longest = min(float(rig.head_radius), float(rig.tail_radius)) / (4.0 if path is lift else 3.0)
    if dx > longest:
        raise InputError("options.dx", dx, "m", f"a pulley carries too few stations: give at most {longest:.3f}")
    n = stations or 2 * round(float(rig.belt_length) / dx / 2.0)
    hanging = Hanging.of(case)
    chord = hanging.length / n
    links = _links(hanging, chord, n)
    for _ in range(_CHORD_SWEEPS):
        loop, lower = _lay(case, hanging, chord, links, path)
        chord += (lower - links[3] * chord) / n
    return loop


def _links(hanging: Hanging, chord: float, n: int) -> tuple[int, int, int, int]:
    """Links on the head, in the upper span, on the tail and in the lower span.

    One station lies where the upper span touches the head. A station that is less than half a chord away from a
    pulley lies on it: its links press it down.
    """
    upper = round(hanging.upper.length / chord)
    ahead = upper * chord - hanging.upper.length
    head, tail = round(hanging.head / chord), round((hanging.tail - ahead) / chord)
    return head, upper, tail, n - head - upper - tail


def _lay(case: Case, hanging: Hanging, chord: float, links: tuple[int, int, int, int], path) -> tuple[Loop, float]:
    """Stations with this chord [m] everywhere but in the lower span, and the length of the lower span [m]."""
    rig, (on_head, upper, on_tail, lower) = case.rig, links
    a, curvature = float(rig.centre_distance), float(case.sag_curvature)
    head, tail = (station_radius(float(r), chord) for r in (rig.head_radius, rig.tail_radius))
    last = -hanging.upper.slopes[0]
    turn = last + chord / float(rig.head_radius) * np.arange(-on_head, 1)
    meets = (last - hanging.head / float(rig.head_radius), last)
    behind = _wrapped(float(rig.head_radius), turn, 0.0, chord, meets, path)
    meets = (-hanging.upper.slopes[1], -hanging.upper.slopes[1] + hanging.tail / float(rig.tail_radius))
    turn = meets[0] + chord / float(rig.tail_radius) * np.arange(on_tail + 1)
    bow = 1.0 + (curvature * chord) ** 2 / 24.0  # length of a link's arc over its chord
    for _ in range(_TURN_SWEEPS):
        ahead = _wrapped(float(rig.tail_radius), turn, a, chord, meets, path)
        over = Catenary.through(behind[-1], ahead[0], curvature)
        turn += (upper * chord * bow - over.length) / tail
    under = Catenary.through(behind[0], ahead[-1], curvature)
    parts = (behind[-1:], over.divide(upper), ahead, under.divide(lower)[::-1], behind[:-1])
    where = np.repeat([0, 1, 2, 1, 0], [len(p) for p in parts])
    x, z = np.concatenate(parts).T
    loop = Loop(
        x=x, z=z, on_head=where == 0, on_tail=where == 2, chord=chord, radius_head=head, radius_tail=tail,
        centre_distance=a,
    )  # fmt: skip
    return loop, under.length / bow


def _wrapped(radius: float, turn: np.ndarray, x: float, chord: float, meets: tuple[float, float], path) -> np.ndarray:
    """Stations on a pulley, shape (k, 2) [m]; turn [rad]: their angles if they all lay on one circle.

    meets [rad]: where the belt comes and goes; the middle station keeps its angle.
    """
    middle, circle = len(turn) // 2, station_radius(radius, chord)
    angle = turn.copy()
    for _ in range(_PATH_SWEEPS):
        r = circle + sum(path(radius * depth, chord, radius) for depth in (angle - meets[0], meets[1] - angle))
        steps = np.concatenate([[0.0], np.cumsum(apart(chord, 0.0, r[1:], r[:-1]))])
        angle = turn[middle] + steps - steps[middle]
    return np.stack([x + r * np.sin(angle), r * np.cos(angle)], axis=1)
