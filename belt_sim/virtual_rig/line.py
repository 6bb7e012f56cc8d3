"""A batch of belt lines as they truly are: their spans as finite elements, the machine, and what loads do to a span.

A span has cubic Hermite fields for position and tilt; its elements are glued by doubling. Arrays have an entry a run.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from belt_sim.case import Belt, Numbers, Rig

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
    ends = _values_at_ends(stiffness, yields)
    moments = stiffness[:, [5, 1]] @ ends / bending[:, None, None]
    nodes = np.stack([ends[:, :4], ends[:, 4:]], axis=1)
    for middle in reversed(middles):  # values at all nodes from those at the ends, the way back
        between = middle[:, None] @ np.concatenate([nodes[:, :-1], nodes[:, 1:]], axis=2)
        merged = np.empty((nodes.shape[0], 2 * nodes.shape[1] - 1, 4, 4))
        merged[:, ::2], merged[:, 1::2] = nodes, between
        nodes = merged
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
    ends = _values_at_ends(stiffness, yields)
    run_up, run_off = ((stiffness[:, row] @ ends)[:, 0] / rigid[:, place, None] for row, place in (([5], -1), ([1], 0)))
    return SpanResponse(
        run_up=run_up.T, run_off=-run_off.T, tilt=(middle @ ends)[:, 2].T, nodes=np.empty((shape[0], 0, 4, 4))
    )


def _values_at_ends(stiffness: np.ndarray, yields: tuple[np.ndarray, np.ndarray] | None) -> np.ndarray:
    """All values at both ends, shape (batch, 8, 4), per unit of y and slope there, without tilt but for how slope and
    tilt give way to the couples that the span has there."""
    given = np.zeros((8, 4))
    given[_ENDS] = np.eye(4)
    if yields is None:
        ends = np.tile(given, (len(stiffness), 1, 1))
        ends[:, _FREE] = -np.linalg.solve(stiffness[:, _FREE][:, :, _FREE], stiffness[:, _FREE][:, :, _ENDS])
        return ends
    system = np.tile(np.eye(8), (len(stiffness), 1, 1))
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


@dataclass(frozen=True, kw_only=True)
class Line:
    """All fields [SI], shape (batch,); those with a default are those of a faultless line.

    run: index of the run in its campaign; yaw, yaw_head: angles that the pulleys are turned to at travel
    yaw_at; offset_tail, offset_head: angles that they are off from travel 0 on; sag_roll: share of the
    sag-roll coupling, 0 for a flat strip (Th2), 1 for the strip; friction: mu on both pulleys, inf = sticking;
    cover: extra rotation per metre and moment [1/(N m2)]; compliance [rad/(N m)] of the tail pulley's yaw;
    cant [rad] of the tail pulley; deflection [1/(N m)]: curvature of both axes per force; layer: share of the bending
    layer with which the belt leaves its pulleys; start: travel [m] that the belt had behind it at travel 0.
    """

    run: np.ndarray
    span_length: np.ndarray
    wrap_tail: np.ndarray
    wrap_head: np.ndarray
    tail_radius: np.ndarray
    head_radius: np.ndarray
    width: np.ndarray
    thickness: np.ndarray
    youngs_modulus: np.ndarray
    density: np.ndarray
    poisson_ratio: np.ndarray
    gravity: np.ndarray
    stress: np.ndarray
    yaw: np.ndarray
    yaw_head: Numbers = 0.0
    yaw_at: Numbers = 0.0
    speed: Numbers = 0.5
    direction: Numbers = 1.0
    sag_roll: Numbers = 0.0
    offset_tail: Numbers = 0.0
    offset_head: Numbers = 0.0
    friction: Numbers = np.inf
    cover: Numbers = 0.0
    compliance: Numbers = 0.0
    cant: Numbers = 0.0
    deflection: Numbers = 0.0
    layer: Numbers = 0.0
    residual: Numbers = 0.0
    start: Numbers = 0.0

    @property
    def bending(self) -> np.ndarray:
        """EI = E b^3 h / 12 [N m2]."""
        return self.youngs_modulus * self.width**3 * self.thickness / 12

    @property
    def force(self) -> np.ndarray:
        """F = sigma b h [N]."""
        return self.stress * self.width * self.thickness

    @property
    def sag_curvature(self) -> np.ndarray:
        """Z = rho g / sigma [1/m]."""
        return self.density * self.gravity / self.stress

    @property
    def torsion(self) -> np.ndarray:
        """T = F b^2/12 + G b h^3/3 [N m2], and what the stress at rest does to a twist, integral of s y^2."""
        shear = self.youngs_modulus / (2 * (1 + self.poisson_ratio))
        places, weights = np.polynomial.legendre.leggauss(3)  # exact for the fourth order that it has
        at_rest = self.residual * sum(w * (1 - 3 * u**2) * u**2 for u, w in zip(places, weights, strict=True))
        return (
            self.force * self.width**2 / 12
            + shear * self.width * self.thickness**3 / 3
            + self.thickness * (self.width / 2) ** 3 * at_rest
        )

    @property
    def belt_length(self) -> np.ndarray:
        """Length of the endless belt [m]."""
        return 2 * self.span_length + self.wrap_tail + self.wrap_head

    def along_bent_axes(self, y, past):
        """State (4, ...) at the run-ups and (y, alpha) (2, ...) of what leaves the tail and the head pulley, their
        angles counted from the straight line between the bearings: a bent pulley is yawed where the belt lies."""
        if not np.any(self.deflection):
            return y, past
        bow, lean = self.deflection * self.force, np.zeros_like(y)
        lean[1::2] = -bow * y[::2]
        return y + lean, tuple(np.stack([off[0], off[1] + bow * off[0]]) for off in past)

    def span(self, tension_share: float | np.ndarray = 1.0, *, to_tail: bool = True) -> SpanResponse:
        """The response at a share of the tension of the free span that runs to the tail (or to the head) pulley."""
        line = replace(self, stress=self.stress * tension_share)
        coupling = line.sag_roll * line.sag_curvature
        yields = line.end_compliance(to_tail) if np.any(self.layer) else None
        return solve_span(line.span_length, line.bending, line.force, line.torsion, coupling, yields)

    def varied_span(self, sections: Sections, *, to_tail: bool) -> SpanResponse:
        """The response of the span that runs to the tail (or to the head) pulley, its properties changed by factors."""
        coupling = self.sag_roll * self.sag_curvature
        yields = self.end_compliance(to_tail) if np.any(self.layer) else None
        whole = self.span_length, self.bending, self.force, self.torsion, coupling
        return solve_varied_span(*whole, sections, yields)

    def end_compliance(self, to_tail: bool) -> tuple[np.ndarray, np.ndarray]:
        """How run-off and run-up give way to the span: (slope, tilt) per (couple about z, couple about x), symmetric.

        Shape (batch, 2, 2) each [rad/(N m)]. The belt lies on the pulley to where its bending layer begins, whose slope
        is (length/R) exp(-x/length) towards the straight line. There a couple M about z twists it. The rate of twist t
        obeys D b^3/12 t'' - T t = M times that slope, t = 0 at the pulley: the difference of two exponentials.
        """
        plate = self.youngs_modulus * self.thickness**3 / (12 * (1 - self.poisson_ratio**2))
        length = np.sqrt(plate / (self.stress * self.thickness))
        upper = np.where((self.direction > 0) == to_tail, 1.0, -1.0)
        pulleys = (self.head_radius, self.tail_radius) if to_tail else (self.tail_radius, self.head_radius)
        twist = np.sqrt(plate * self.width**3 / 12 / self.torsion)  # the other length, along which a twist dies out
        found = []
        for radius, at_runup in zip(pulleys, (-1.0, 1.0), strict=True):
            rolled = length**3 / (length + twist) / radius  # integral of t, times T/M
            turned = rolled * length / (2 * radius) / (1 + twist / length)  # of the layer's slope times t
            slope = -self.layer * turned / self.torsion
            cross = at_runup * upper * self.layer * rolled / self.torsion
            found.append(np.stack([np.stack([slope, cross], -1), np.stack([cross, 0 * cross], -1)], -2))
        return found[0], found[1]

    def belt_coordinate(self, place: str, s):
        """Which part of the belt lies at a point at travel s [m], counted from what was at point 4 at travel 0."""
        along = {
            "point_4": 0.0 * self.span_length,
            "point_1": self.span_length,
            "point_2": self.span_length + self.wrap_tail,
            "point_3": 2 * self.span_length + self.wrap_tail,
        }
        return along[place] - self.direction * (s + self.start)

    @cached_property
    def runup_sensitivity(self) -> np.ndarray:
        """Curvature in the middle of every element per unit run-up angle [1/m], shape (batch, n)."""
        coupling = self.sag_roll * self.sag_curvature
        return curvature_along(self.span().nodes, self.span_length, coupling)[:, :, 3]


_OF_RIG = ("span_length", "wrap_tail", "wrap_head", "tail_radius", "head_radius", "gravity")
_OF_BELT = ("width", "thickness", "youngs_modulus", "density", "poisson_ratio")


def line_from(rig: Rig, belt: Belt, **settings: np.ndarray) -> Line:
    """A faultless batch on one machine (its numbers may be arrays); ``settings``: the remaining fields."""
    constants = {name: getattr(rig, name) for name in _OF_RIG} | {name: getattr(belt, name) for name in _OF_BELT}
    count = len(settings["stress"])
    line = Line(run=np.arange(count), **constants, **settings)
    return replace(line, **{name: np.broadcast_to(np.asarray(v), (count,)) for name, v in vars(line).items()})


def stack(lines: list[Line]) -> Line:
    """Several batches as one."""
    names = Line.__dataclass_fields__
    return Line(**{name: np.concatenate([getattr(line, name) for line in lines]) for name in names})


_COUPLES = [1, 2]  # slope and tilt of a node's (y, y', phi, phi')
_FREE_END = 3


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


def uniform_load(line: Line, upper: bool, *, roll: bool = False) -> UnitLoad:
    """1 N/m towards +y all along; roll: 1 N m per m about the long axis instead, lifting the side y > 0."""
    h, fields = line.span_length / 2**DOUBLINGS, [2, 3] if roll else [0, 1]  # a value and its slope at a node
    pair = np.stack([h / 2, h**2 / 12, h / 2, -(h**2) / 12], -1)
    loads = np.zeros((len(line.stress), 2**DOUBLINGS + 1, 4))
    loads[:, :-1, fields] += pair[:, None, :2]
    loads[:, 1:, fields] += pair[:, None, 2:]
    return _without_place(upper, *_solve(line, upper, loads))


def _without_place(upper: bool, nodes: np.ndarray, run_up: np.ndarray, run_off: np.ndarray) -> UnitLoad:
    """The load that ``_solve`` was given, which acts at no one place."""
    nothing = np.zeros_like(run_up)
    return UnitLoad(upper, run_up, run_off, nodes[:, nodes.shape[1] // 2, 2], np.zeros((4, len(nothing))), nothing)


def unit_load(line: Line, upper: bool, share, *, couple: bool = False) -> UnitLoad:
    """1 N towards +y at a share of the span's length, counted from the head to the tail pulley; couple: 1 N m about the
    vertical instead, turning y' upwards along the travel."""
    count = 2**DOUBLINGS
    share = np.broadcast_to(np.asarray(share, dtype=float), line.stress.shape)
    along = np.where((line.direction > 0) == upper, share, 1 - share) * count
    k = np.clip(along.astype(int), 0, count - 1)
    value, first, _ = hermite(along - k, line.span_length / count)
    lanes = np.arange(len(k))
    loads = np.zeros((len(k), count + 1, 4))
    chosen = first if couple else value
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
    diagonal[:, _FREE_END], beside[:, _FREE_END], force[:, _FREE_END] = (
        own[:, _FREE_END],
        other[:, _FREE_END],
        load[:, _FREE_END],
    )
    return diagonal, beside, force
