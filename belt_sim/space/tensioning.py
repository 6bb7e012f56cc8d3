"""Koller's tensioning (paper section 6.1): pulleys that move apart while they drive a slack belt slowly.

The belt is driven because the stretch of what lies on a pulley lags behind, by friction; a driven belt exchanges it
within pi R of travel.
"""

from dataclasses import dataclass, replace

import numpy as np

from belt_sim.case import Case
from belt_sim.space.loop import HangingBelt, LaidLoop, free_length, lay_loop, smoothstep
from belt_sim.space.options import SLOWNESS, string_speed

FRICTION = 0.1  # at most, meanwhile: the stretch of a wrap then falls behind by at most 1 - exp(-pi FRICTION / 2)
_SLOPE = 0.25  # [rad] of the slack spans at the pulleys: a sag of a sixteenth of the centre distance
_SLACKEST, _TIGHTEST = 0.005, 0.5  # bounds of the slack tension, in the wanted one
_SWINGS = 10.0  # times that a wave needs along a slack span: the procedure takes so long
_MOVING = 0.85  # share of the procedure's travel over which the pulleys move apart
_TABLE = 40  # tensions between the slack and the wanted one
_SWEEPS = 10  # Newton on the centre distance; each gains digits by the slope of the spans squared


@dataclass(frozen=True)
class KollerPlan:
    """The plan of Koller's procedure. slack: the case as it is laid; speed [m/s] and travel [m] of the drive;
    places, upper [m], shape (k,): centre distance, and free length of belt between the tops of the pulleys, on the
    way on which sag falls and tension rises evenly."""

    slack: Case
    speed: float
    travel: float
    places: np.ndarray
    upper: np.ndarray

    @staticmethod
    def from_case(case: Case, tight: LaidLoop) -> "KollerPlan":
        """For a case with its gravity, and the stations of its belt laid at the wanted tension."""
        belt, length = case.belt, free_length(case)
        wanted = float(case.settings.tension)
        weight = float(belt.density) * float(case.rig.gravity)
        slackest = weight * float(case.rig.centre_distance) / (2.0 * _SLOPE)
        slackest = min(max(slackest, _SLACKEST * wanted), _TIGHTEST * wanted)
        cases = [_fit_distance(case, length, t) for t in np.geomspace(slackest, wanted, _TABLE)]
        tension = np.array([float(c.settings.tension) for c in cases])
        distance = np.array([float(c.rig.centre_distance) for c in cases])
        share = 0.5 * _normalise(tension) + 0.5 * _normalise(1.0 / tension)
        even = np.linspace(0.0, 1.0, _TABLE)
        slack = _slack_case(cases[0], case, tight)
        early = float(slack.rig.centre_distance) - distance[0]
        return KollerPlan(
            slack=slack,
            speed=string_speed(cases[0]) / SLOWNESS,
            travel=_SWINGS / SLOWNESS * distance[-1],
            places=np.interp(even, share, distance) + early * (1.0 - even),
            upper=np.interp(even, share, [_upper_length(c) for c in cases]),
        )

    def places_at(self, travel: float) -> np.ndarray:
        """Centre distance [m], and what the tail pulley's rim has gained on the belt [m], after so much travel [m]."""
        even, u = np.linspace(0.0, 1.0, len(self.places)), smoothstep(travel / (_MOVING * self.travel))
        return np.array([np.interp(u, even, self.places), self.upper[0] - np.interp(u, even, self.upper)])


def _normalise(values: np.ndarray) -> np.ndarray:
    """From 0 at the first to 1 at the last."""
    return (values - values[0]) / (values[-1] - values[0])


def _fit_distance(case: Case, length: float, tension: float) -> Case:
    """The case at this tension [Pa] and the centre distance at which a belt of this stress-free length [m] has it."""
    settings = replace(case.settings, tension=tension)
    distance = float(case.rig.centre_distance)
    for _ in range(_SWEEPS):
        fitting = replace(case, settings=settings, rig=replace(case.rig, centre_distance=distance))
        distance -= 0.5 * (free_length(fitting) - length)
    return fitting


def _slack_case(slack: Case, case: Case, tight: LaidLoop) -> Case:
    """The slack case at the centre distance at which its polygon of stations is as long, stress-free, as the tight one.

    The length of a polygon differs from the smooth belt's by how the stations come to lie on the pulleys.
    """
    strain, less = (float(c.settings.tension / c.belt.youngs_modulus) for c in (case, slack))
    n, wanted = len(tight.x), tight.chord / (1.0 + strain) * (1.0 + less)
    for _ in range(_SWEEPS):
        missing = n * (wanted - lay_loop(slack, tight.chord, n).chord)
        distance = float(slack.rig.centre_distance) + 0.5 * missing
        slack = replace(slack, rig=replace(slack.rig, centre_distance=distance))
    return slack


def _upper_length(case: Case) -> float:
    """Stress-free length [m] of belt between the tops of the pulleys, along the upper span."""
    at_head, at_tail = (span := HangingBelt.from_case(case).upper).slopes
    loaded = span.length - float(case.rig.head_radius) * at_head + float(case.rig.tail_radius) * at_tail
    return loaded / (1.0 + float(case.settings.tension) / float(case.belt.youngs_modulus))
