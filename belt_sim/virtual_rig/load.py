"""What loads do to a span: forces and couples beside the pulleys, and a roll of its end."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.line import Line
from belt_sim.virtual_rig.span import DOUBLINGS, curvature_along, element, hermite

_COUPLES = [1, 2]  # slope and tilt of a node's (y, y', phi, phi')
_FREE = 3


@dataclass(frozen=True)
class UnitLoad:
    """A unit load on one span, shape (batch,) each: what it adds at fixed ends.

    upper: on the span above (whichever way the belt runs); run_up, run_off: curvature there [1/m]; tilt: roll at
    mid-span [rad]; row, shape (4, batch): y at the load's place per boundary value (y_o, theta_o, y_u, theta_u);
    give: y there per unit of the load. A load that is spread has no place: row and give are 0.
    """

    upper: bool
    run_up: np.ndarray
    run_off: np.ndarray
    tilt: np.ndarray
    row: np.ndarray
    give: np.ndarray


def force_at(line: Line, upper: bool, share) -> UnitLoad:
    """1 N towards +y at a share of the span's length, counted from the head to the tail pulley."""
    return _point_load(line, upper, share, slope=False)


def couple_at(line: Line, upper: bool, share) -> UnitLoad:
    """1 N m about the vertical, turning y' upwards along the travel, at a share of the way from head to tail."""
    return _point_load(line, upper, share, slope=True)


def uniform_force(line: Line, upper: bool) -> UnitLoad:
    """1 N/m towards +y all along."""
    return _spread_load(line, upper, [0, 1])


def uniform_roll_couple(line: Line, upper: bool) -> UnitLoad:
    """1 N m per m about the long axis all along, lifting the side y > 0."""
    return _spread_load(line, upper, [2, 3])


def roll_at_tail(line: Line, upper: bool) -> UnitLoad:
    """1 rad of roll, the side y > 0 up, of the tail pulley where the span meets it."""
    last = (line.direction > 0) == upper
    no_loads = np.zeros((len(line.stress), 2**DOUBLINGS + 1, 4))
    return _without_place(upper, *_solve(line, upper, no_loads, (np.where(last, 0.0, 1.0), np.where(last, 1.0, 0.0))))


def tilt_sensitivity(line: Line, upper: bool) -> np.ndarray:
    """Curvature in the middle of every element by 1 N m about the long axis at mid-span, (batch, n) [1/(N m2)].

    By Betti's theorem natural curvature there tilts mid-span by EI times as much.
    """
    loads = np.zeros((len(line.stress), 2**DOUBLINGS + 1, 4))
    loads[:, 2 ** (DOUBLINGS - 1), 2] = 1.0
    nodes = _solve(line, upper, loads)[0][..., None]
    return curvature_along(nodes, line.span_length, line.sag_roll * line.sag_curvature)[..., 0]


def _spread_load(line: Line, upper: bool, fields: list[int]) -> UnitLoad:
    """1 a metre on these fields, a value and its slope, of every element's two nodes."""
    h = line.span_length / 2**DOUBLINGS
    pair = np.stack([h / 2, h**2 / 12, h / 2, -(h**2) / 12], -1)
    loads = np.zeros((len(line.stress), 2**DOUBLINGS + 1, 4))
    loads[:, :-1, fields] += pair[:, None, :2]
    loads[:, 1:, fields] += pair[:, None, 2:]
    return _without_place(upper, *_solve(line, upper, loads))


def _without_place(upper: bool, nodes: np.ndarray, run_up: np.ndarray, run_off: np.ndarray) -> UnitLoad:
    """The load that ``_solve`` was given, which acts at no one place."""
    nothing = np.zeros_like(run_up)
    return UnitLoad(upper, run_up, run_off, nodes[:, nodes.shape[1] // 2, 2], np.zeros((4, len(nothing))), nothing)


def _point_load(line: Line, upper: bool, share, *, slope: bool) -> UnitLoad:
    count = 2**DOUBLINGS
    share = np.broadcast_to(np.asarray(share, dtype=float), line.stress.shape)
    along = np.where((line.direction > 0) == upper, share, 1 - share) * count
    k = np.clip(along.astype(int), 0, count - 1)
    value, first, _ = hermite(along - k, line.span_length / count)
    lanes = np.arange(len(k))
    loads = np.zeros((len(k), count + 1, 4))
    chosen = first if slope else value
    for node, part in ((k, chosen[:, :2]), (k + 1, chosen[:, 2:])):
        loads[lanes, node, :2] += part

    def y_at_place(nodes):  # of shape (batch, n, 4, ...)
        pair = np.concatenate([nodes[lanes, k, :2], nodes[lanes, k + 1, :2]], axis=1)
        return np.einsum("bi,bi...->b...", value, pair)

    nodes, run_up, run_off = _solve(line, upper, loads)
    free = _on_span(line, upper, line.span().nodes, line.span(to_tail=False).nodes)
    return UnitLoad(upper, run_up, run_off, nodes[:, count // 2, 2], y_at_place(free).T, y_at_place(nodes))


def _on_span(line: Line, upper: bool, to_tail: np.ndarray, to_head: np.ndarray) -> np.ndarray:
    """What belongs to the upper (or the lower) span, lane by lane."""
    chosen = (line.direction > 0) == upper
    return np.where(chosen.reshape(-1, *(1,) * (to_tail.ndim - 1)), to_tail, to_head)


def _solve(
    line: Line, upper: bool, loads: np.ndarray, rolls: Sequence[np.ndarray | float] = (0.0, 0.0)
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fields (batch, n, 4) of a loaded span between ends at rest, curvature at run-up and run-off (batch,).

    Elimination node after node; at the ends y and slope are 0 and the tilt is one of ``rolls``, but for how they give
    way to the couples there.
    """
    coupling = line.sag_roll * line.sag_curvature
    stiffness = element(line.span_length / 2**DOUBLINGS, line.bending, line.force, line.torsion, coupling)
    a, b = stiffness[:, :4, :4], stiffness[:, :4, 4:]
    c, d = stiffness[:, 4:, :4], stiffness[:, 4:, 4:]
    pairs = zip(line.end_compliance(True), line.end_compliance(False), strict=True)
    off, up = (_on_span(line, upper, tail, head) for tail, head in pairs)
    first = _end(a, b, loads[:, 0], off, rolls[0])
    last = _end(d, c, loads[:, -1], up, rolls[1])
    count = loads.shape[1]
    upwards, rest = [], []
    diagonal, right, force = first
    for k in range(count - 1):
        upwards.append(np.linalg.solve(diagonal, right))
        rest.append(np.linalg.solve(diagonal, force[..., None])[..., 0])
        diagonal_next, left, force_next = (a + d, c, loads[:, k + 1]) if k < count - 2 else last
        diagonal = diagonal_next - left @ upwards[-1]
        force = force_next - (left @ rest[-1][..., None])[..., 0]
        right = b
    nodes = [np.linalg.solve(diagonal, force[..., None])[..., 0]]
    for ahead, there in zip(reversed(upwards), reversed(rest), strict=True):
        nodes.append(there - (ahead @ nodes[-1][..., None])[..., 0])
    fields = np.stack(nodes[::-1], axis=1)
    moment_up = np.einsum("bij,bj->bi", d, fields[:, -1]) + np.einsum("bij,bj->bi", c, fields[:, -2]) - loads[:, -1]
    moment_off = np.einsum("bij,bj->bi", a, fields[:, 0]) + np.einsum("bij,bj->bi", b, fields[:, 1]) - loads[:, 0]
    return fields, moment_up[:, 1] / line.bending, -moment_off[:, 1] / line.bending


def _end(own: np.ndarray, other: np.ndarray, load: np.ndarray, yields: np.ndarray, roll: np.ndarray | float):
    """Rows of an end node: y = 0, slope and tilt = (0, roll) + yields @ couples, no moment on the tilt's slope."""
    diagonal, beside, force = np.zeros_like(own), np.zeros_like(other), np.zeros_like(load)
    diagonal[:, 0, 0] = 1.0
    diagonal[:, _COUPLES, _COUPLES] = 1.0
    diagonal[:, _COUPLES] -= yields @ own[:, _COUPLES]
    beside[:, _COUPLES] = -yields @ other[:, _COUPLES]
    force[:, _COUPLES] = -np.einsum("bij,bj->bi", yields, load[:, _COUPLES])
    force[:, _COUPLES[1]] += roll
    diagonal[:, _FREE], beside[:, _FREE], force[:, _FREE] = own[:, _FREE], other[:, _FREE], load[:, _FREE]
    return diagonal, beside, force
