"""A free span as finite elements: cubic Hermite fields for position and tilt, glued by doubling."""

from dataclasses import dataclass

import numpy as np

#: 2**DOUBLINGS elements a span: 0.18 m on the test rig, shorter than the shortest decay length at 4 N/mm2.
DOUBLINGS = 6
_GAUSS = np.polynomial.legendre.leggauss(5)
_ENDS = [0, 1, 4, 5]  # y, theta at the run-off and at the run-up; the tilt is held at 0 there
_FREE = [3, 7]  # the slope of the tilt stays free


@dataclass(frozen=True)
class SpanResponse:
    """What a batch of spans answers to unit boundary values (y_o, theta_o, y_u, theta_u).

    run_up, run_off [1/m2, 1/m, ...], shape (4, batch): in-plane curvature kappa at x = L and x = 0;
    tilt, shape (4, batch): roll of the cross-section at mid-span; nodes, shape (batch, n, 4, 4): the fields
    y, y', phi, phi' at equally spaced x (last axis: the boundary value that is 1).
    """

    run_up: np.ndarray
    run_off: np.ndarray
    tilt: np.ndarray
    nodes: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Sections:
    """Factors on EI, T, Z and F of a span, each (batch,) or (batch, 2**DOUBLINGS) from run-off to run-up, and a spring
    against the roll at mid-span [N m/rad], (batch,).
    """

    bending: np.ndarray | float = 1.0
    torsion: np.ndarray | float = 1.0
    sag: np.ndarray | float = 1.0
    tension: np.ndarray | float = 1.0
    roll_spring: np.ndarray | float = 0.0


def hermite(t: np.ndarray, h: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cubic Hermite functions of t = x/h and their first and second derivatives in x, shape (..., 4)."""
    t, h = np.broadcast_arrays(t, h)
    zero, one = np.zeros_like(t), np.ones_like(t)
    value = [1 - 3 * t**2 + 2 * t**3, h * (t - 2 * t**2 + t**3), 3 * t**2 - 2 * t**3, h * (t**3 - t**2)]
    first = [(6 * t**2 - 6 * t) / h, one - 4 * t + 3 * t**2, (6 * t - 6 * t**2) / h, 3 * t**2 - 2 * t + zero]
    second = [(12 * t - 6) / h**2, (6 * t - 4) / h, (6 - 12 * t) / h**2, (6 * t - 2) / h]
    return np.stack(value, -1), np.stack(first, -1), np.stack(second, -1)


def element(h, bending, force, torsion, sag_curvature) -> np.ndarray:
    """Stiffness of one element, shape (batch, 8, 8), unknowns (y, y', phi, phi') at both ends.

    Second derivative of the energy 1/2 int EI (y'' + Z phi)^2 + F y'^2 + T phi'^2 dx, whose stationarity is
    EI kappa'' = F y'' and T phi'' = EI Z kappa (physics sheet, section 3).
    """
    lateral, roll = [0, 1, 4, 5], [2, 3, 6, 7]
    stiffness = np.zeros((*np.shape(h), 8, 8))
    for x, weight in zip(*_GAUSS, strict=True):
        value, first, second = hermite(np.full_like(h, (1 + x) / 2), h)
        curvature, slope, twist = np.zeros((3, *np.shape(h), 8))
        curvature[..., lateral] = second
        curvature[..., roll] = sag_curvature[..., None] * value
        slope[..., lateral] = first
        twist[..., roll] = first
        for factor, row in ((bending, curvature), (force, slope), (torsion, twist)):
            stiffness += (weight * h / 2 * factor)[..., None, None] * row[..., :, None] * row[..., None, :]
    return stiffness


def solve_span(length, bending, force, torsion, sag_curvature, yields=None) -> SpanResponse:
    """Condense a batch of spans onto their ends; all arguments shape (batch,), SI.

    yields: how the slope and the tilt at the run-off and at the run-up give way to the couples there, a pair of
    arrays (batch, 2, 2) [rad/(N m)]; None = held.
    """
    stiffness = element(length / 2**DOUBLINGS, bending, force, torsion, sag_curvature)
    middles = []
    for _ in range(DOUBLINGS):
        stiffness, middle = _glue(stiffness, stiffness)
        middles.append(middle)
    ends = _clamped_ends(stiffness) if yields is None else _compliant_ends(stiffness, yields)
    moments = stiffness[:, [5, 1]] @ ends / bending[:, None, None]
    nodes = _recover(ends, middles)
    return SpanResponse(
        run_up=moments[:, 0].T, run_off=-moments[:, 1].T, tilt=nodes[:, nodes.shape[1] // 2, 2].T, nodes=nodes
    )


def solve_varied_span(length, bending, force, torsion, sag_curvature, sections: Sections, yields=None) -> SpanResponse:
    """The same for a span whose properties change along it; its fields are not worked out (``nodes`` is empty)."""
    shape = (len(length), 2**DOUBLINGS)

    def per_element(value, factor=1.0) -> np.ndarray:
        factor = np.asarray(factor, dtype=float)
        return np.broadcast_to(value[:, None] * (factor[:, None] if factor.ndim == 1 else factor), shape)

    rigid = per_element(bending, sections.bending)
    pieces = element(
        per_element(length / shape[1]),
        rigid,
        per_element(force, sections.tension),
        per_element(torsion, sections.torsion),
        per_element(sag_curvature, sections.sag),
    )
    while pieces.shape[1] > 2:
        pieces = _glue(pieces[:, ::2], pieces[:, 1::2])[0]
    left, right = pieces[:, 0].copy(), pieces[:, 1]
    left[:, 6, 6] += sections.roll_spring
    stiffness, middle = _glue(left, right)
    ends = _clamped_ends(stiffness) if yields is None else _compliant_ends(stiffness, yields)
    run_up, run_off = ((stiffness[:, row] @ ends)[:, 0] / rigid[:, place, None] for row, place in (([5], -1), ([1], 0)))
    return SpanResponse(
        run_up=run_up.T, run_off=-run_off.T, tilt=(middle @ ends)[:, 2].T, nodes=np.empty((shape[0], 0, 4, 4))
    )


def _clamped_ends(stiffness: np.ndarray) -> np.ndarray:
    """All values at both ends, shape (batch, 8, 4), per unit of y and slope there; no tilt."""
    ends = np.zeros((len(stiffness), 8, 4))
    ends[:, _ENDS] = np.eye(4)
    ends[:, _FREE] = -np.linalg.solve(stiffness[:, _FREE][:, :, _FREE], stiffness[:, _FREE][:, :, _ENDS])
    return ends


def _compliant_ends(stiffness: np.ndarray, yields: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """The same where slope and tilt give way to the couples that the span has there."""
    system, given = np.tile(np.eye(8), (len(stiffness), 1, 1)), np.zeros((8, 4))
    given[_ENDS] = np.eye(4)
    for couples, end in zip(([1, 2], [5, 6]), yields, strict=True):
        system[:, couples] -= end @ stiffness[:, couples]
    system[:, _FREE] = stiffness[:, _FREE]
    return np.linalg.solve(system, np.broadcast_to(given, (len(stiffness), 8, 4)))


def curvature_along(nodes: np.ndarray, length, sag_curvature) -> np.ndarray:
    """In-plane curvature kappa = y'' + Z phi in the middle of every element, (batch, n - 1, k), of fields y, y', phi,
    phi' at the nodes, (batch, n, 4, k)."""
    h = length / (nodes.shape[1] - 1)
    value, _, second = hermite(np.full_like(h, 0.5), h)
    left, right = nodes[:, :-1], nodes[:, 1:]
    lateral = np.concatenate([left[:, :, :2], right[:, :, :2]], axis=2)
    roll = np.concatenate([left[:, :, 2:], right[:, :, 2:]], axis=2)
    bent = np.einsum("bd,bndk->bnk", second, lateral)
    return bent + sag_curvature[:, None, None] * np.einsum("bd,bndk->bnk", value, roll)


def _glue(left: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Glue two pieces and eliminate the node between them: stiffness of the pair, middle from ends."""
    pair = np.zeros_like(left)
    pair[..., :4, :4], pair[..., 4:, 4:] = left[..., :4, :4], right[..., 4:, 4:]
    to_middle = np.concatenate([left[..., 4:, :4], right[..., :4, 4:]], axis=-1)
    middle = -np.linalg.solve(left[..., 4:, 4:] + right[..., :4, :4], to_middle)
    from_middle = np.concatenate([left[..., :4, 4:], right[..., 4:, :4]], axis=-2)
    return pair + from_middle @ middle, middle


def _recover(ends: np.ndarray, middles: list[np.ndarray]) -> np.ndarray:
    """Values at all nodes from the values at the ends, the way back through the doublings."""
    nodes = np.stack([ends[:, :4], ends[:, 4:]], axis=1)
    for middle in reversed(middles):
        pairs = np.concatenate([nodes[:, :-1], nodes[:, 1:]], axis=2)
        between = middle[:, None] @ pairs
        merged = np.empty((nodes.shape[0], 2 * nodes.shape[1] - 1, 4, 4))
        merged[:, ::2], merged[:, 1::2] = nodes, between
        nodes = merged
    return nodes
