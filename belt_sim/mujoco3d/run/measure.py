"""What a run shows: points 1-4, angles, entry moments, tilt, sag, tension."""

from dataclasses import dataclass

import numpy as np

from belt_sim.case import Case
from belt_sim.mujoco3d.wrap.contact import Contact
from belt_sim.mujoco3d.wrap.hold import HEAD, TAIL

_NEAR = 4  # stations to either side of a wrap's end among which the belt passes the pulley's axis
_LINKS = 2  # links over which the entry moment is averaged; the last link, which turns, is left out

#: rows of a reading
POINTS, ANGLES, MOMENTS, EDGES, TILTS, SAGS, TENSION = (
    slice(0, 4),
    slice(4, 8),
    slice(8, 10),
    slice(10, 12),
    slice(12, 14),
    slice(14, 16),
    16,
)
READING_SIZE = 17


@dataclass(frozen=True)
class Ends:
    """Stations at the ends of the wraps: points 1 (tail, upper), 2 (tail, lower), 3 (head, lower), 4 (head, upper)."""

    tail_upper: int
    tail_lower: int
    head_lower: int
    head_upper: int

    @staticmethod
    def of(contact: Contact) -> "Ends":
        head, tail = contact.wraps[HEAD], contact.wraps[TAIL]
        return Ends(tail.first, tail.last, head.first, head.last)


def reading(case: Case, contact: Contact, tail_x: float) -> np.ndarray:
    """One instant: y of points 1-4 [m], their angles [rad], entry moments [N m] and slack-edge stress [Pa] at the
    run-ups of the upper and lower span, tilts [rad], sags [m], tension [N] at the upper run-up; shape (17,)."""
    ends, sign = Ends.of(contact), float(case.settings.direction)
    out = np.empty(READING_SIZE)
    places = ((ends.tail_upper, tail_x), (ends.tail_lower, tail_x), (ends.head_lower, 0.0), (ends.head_upper, 0.0))
    for k, (station, x) in enumerate(places):
        out[k], slope = _at_axis(contact, station, x)
        out[4 + k] = sign * slope
    runups = (ends.tail_upper, ends.head_lower) if sign > 0 else (ends.head_upper, ends.tail_lower)
    stiffness = float(case.belt.bending_stiffness)
    for k, station in enumerate(runups):
        first = station - _LINKS - 1 if sign > 0 else station + 1
        tension, out[8 + k] = _section_forces(contact, first, stiffness)
        out[10 + k] = _slack_edge(case, tension, out[8 + k])
        if k == 0:
            out[TENSION] = tension
    n = contact.scene.mesh.stations
    head_lower = ends.head_lower + n * round((ends.tail_lower - ends.head_lower) / n + 0.5)
    upper, lower = (ends.head_upper + ends.tail_upper) // 2, (ends.tail_lower + head_lower) // 2
    # before the belt has gone round the numbers of the head's wrap lie below the tail's
    out[TILTS] = [_tilt(contact, upper), _tilt(contact, lower)]
    out[SAGS] = [
        contact.scene.loop.radius_head - contact.nodes(upper % n)[:, 2].mean(),
        -contact.scene.loop.radius_head - contact.nodes(lower % n)[:, 2].mean(),
    ]
    return out


def _around(contact: Contact, first: int, count: int) -> np.ndarray:
    mesh = contact.scene.mesh
    k = np.arange(first, first + count) % mesh.stations
    return mesh.rest[k] + contact.slides[k]


def _at_axis(contact: Contact, station: int, x: float) -> tuple[float, float]:
    """y and dy/ds of the centre line (s along station numbers) where the belt passes the pulley's axis."""
    centre = _around(contact, station - _NEAR, 2 * _NEAR + 1).mean(axis=1)
    ahead = centre[:, 0] - x
    crossing = np.flatnonzero(ahead[1:-2] * ahead[2:-1] <= 0.0)
    i = 1 + (int(crossing[0]) if len(crossing) else _NEAR - 1)
    share = ahead[i] / (ahead[i] - ahead[i + 1])
    y = centre[i, 1] + share * (centre[i + 1, 1] - centre[i, 1])
    slope = (centre[i + 2, 1] - centre[i - 1, 1]) / (3.0 * contact.scene.mesh.chord)
    return float(y), float(slope)


def _section_forces(contact: Contact, first: int, bending_stiffness: float) -> tuple[float, float]:
    """Tension [N] and in-plane bending moment EI (kappa - kappa_c) [N m], mean over _LINKS links.

    kappa = y'', kappa_c the natural curvature.
    """
    mesh = contact.scene.mesh
    nodes = _around(contact, first, _LINKS + 1)
    free = mesh.lengths[np.arange(first, first + _LINKS) % mesh.stations]
    strain = (np.linalg.norm(np.diff(nodes, axis=0), axis=2) / free - 1.0).mean(axis=0)
    tension = float(mesh.line_stiffness @ strain)
    if mesh.across == 1:
        return tension, 0.0
    weight = mesh.line_stiffness * mesh.line_y
    return tension, -bending_stiffness * float(weight @ strain) / float(weight @ mesh.line_y)


def _slack_edge(case: Case, tension: float, moment: float) -> float:
    """Stress of the slacker edge of the real strip [Pa]: N / (b h) - 6 |M| / (b^2 h)."""
    area, width = float(case.belt.area), float(case.belt.width)
    return tension / area - 6.0 * abs(moment) / (area * width)


def _tilt(contact: Contact, station: int) -> float:
    nodes = contact.nodes(station % contact.scene.mesh.stations)
    if len(nodes) == 1:
        return 0.0
    across = nodes[0] - nodes[-1]
    return float(np.arctan2(across[2], across[1]))


def edges(case: Case, contact: Contact) -> tuple[np.ndarray, np.ndarray]:
    """The real belt's edges at +b/2 and -b/2 [m], closed loops, shape (n + 1, 3), drawn out from the model's lines."""
    mesh = contact.scene.mesh
    nodes = mesh.rest + contact.slides
    centre, left = nodes.mean(axis=1), nodes[:, 0] - nodes.mean(axis=1)
    if mesh.across > 1:
        left = left * (0.5 * float(case.belt.width) / mesh.line_y[0])
    loops = [np.concatenate([e, e[:1]]) for e in (centre + left, centre - left)]
    return loops[0], loops[1]
