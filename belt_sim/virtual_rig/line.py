"""A batch of belt lines as they truly are: their spans as finite elements, the machine, and what loads do to a span.

A span has cubic Hermite fields for position and tilt; its elements are glued by doubling. Arrays have an entry a run.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from belt_sim.case import Numbers

#: 2**DOUBLINGS elements a span: 0.18 m on the test rig, shorter than the shortest decay length at 4 N/mm2.
DOUBLINGS = 6
_GAUSS = np.polynomial.legendre.leggauss(5)


#: Rows of what a span answers to its ends: curvature kappa in its plane at x = L and x = 0, roll at mid-span.
RUN_UP, RUN_OFF, TILT = range(3)
#: Those rows per unit boundary value (y_o, theta_o, y_u, theta_u), [1/m2, 1/m, ...], shape (3, 4, batch); and the
#: fields y, y', phi, phi' at equally spaced x, shape (batch, n, 4, 4), last axis: the boundary value that is 1.
SpanResponse = tuple[np.ndarray, np.ndarray]


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


AS_STATED = Sections()


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


def solve_span(
    length, bending, force, torsion, sag_curvature, sections: Sections = AS_STATED, yields=None, loads=None, tilts=()
) -> SpanResponse:
    """Condense a batch of spans onto their ends by gluing neighbours, pair by pair; numbers shape (batch,), SI.

    yields: how (slope, tilt) at the run-off and at the run-up give way to (couple about z, couple about x) there, a
    pair of arrays (batch, 2, 2) [rad/(N m)]; None = held. loads: in the place of unit boundary values, what acts on the
    nodes, (batch, n, 4), while the ends are at rest but for ``tilts``, those of the run-off and the run-up.
    """
    count = 2**DOUBLINGS
    # of every element, (batch, 1), or (batch, elements) of a span that changes along its way
    stated = (bending, sections.bending), (force, sections.tension), (torsion, sections.torsion)
    rows = [
        value[:, None] * np.reshape(factor, np.shape(factor) if np.ndim(factor) == 2 else (-1, 1))
        for value, factor in (*stated, (sag_curvature, sections.sag))
    ]
    factors = np.broadcast_arrays(*rows)
    pieces = element(np.broadcast_to(length[:, None] / count, factors[0].shape), *factors)
    if np.any(sections.roll_spring):
        pieces = np.broadcast_to(pieces, (len(length), count, 8, 8)).copy()
        pieces[:, count // 2 - 1, 6, 6] += sections.roll_spring
    if loads is None:
        given, load = np.zeros((1, 8, 4)), np.zeros((1, 1, 8, 4))
        given[0, [0, 1, 4, 5]] = np.eye(4)
    else:
        given, load = np.zeros((len(length), 8, 1)), np.zeros((len(length), count, 8, 1))
        load[:, 0, :4, 0], load[:, :, 4:, 0] = loads[:, 0], loads[:, 1:]
        for row, tilt in zip((2, 6), tilts, strict=False):
            given[:, row, 0] = tilt
    eliminated = []
    for _ in range(DOUBLINGS):
        left, right, load_left, load_right = (
            x if x.shape[1] == 1 else x[:, first::2] for x in (pieces, load) for first in (0, 1)
        )
        between = left[..., 4:, 4:] + right[..., :4, :4]
        to_ends = np.concatenate([left[..., 4:, :4], right[..., :4, 4:]], axis=-1)
        from_ends = np.concatenate([left[..., :4, 4:], right[..., 4:, :4]], axis=-2)
        follows = -np.linalg.solve(between, to_ends)
        alone = np.linalg.solve(between, load_left[..., 4:, :] + load_right[..., :4, :])
        pieces = np.zeros_like(left)
        pieces[..., :4, :4], pieces[..., 4:, 4:] = left[..., :4, :4], right[..., 4:, 4:]
        pieces += from_ends @ follows
        load = np.concatenate([load_left[..., :4, :], load_right[..., 4:, :]], axis=-2) - from_ends @ alone
        eliminated.append((follows, alone))
    stiffness, load = pieces[:, 0], load[:, 0]
    # all values at both ends, (batch, 8, k): as given, but for how slope and tilt give way to the couples that the span
    # has there, and for the slopes of the tilt, which are free
    free = [3, 7]
    ends: np.ndarray = np.broadcast_to(given, (len(length), *given.shape[1:])).copy()
    if yields is None:
        ends[:, free] = np.linalg.solve(stiffness[:, free][:, :, free], load[:, free] - stiffness[:, free] @ ends)
    else:
        system = np.tile(np.eye(8), (len(stiffness), 1, 1))
        for couples, end in zip(([1, 2], [5, 6]), yields, strict=True):
            system[:, couples] -= end @ stiffness[:, couples]
            ends[:, couples] -= end @ load[:, couples]
        system[:, free], ends[:, free] = stiffness[:, free], load[:, free]
        ends = np.linalg.solve(system, ends)
    moments = stiffness @ ends - load
    nodes = np.stack([ends[:, :4], ends[:, 4:]], axis=1)
    for follows, alone in reversed(eliminated):  # values at all nodes from those at the ends, the way back
        merged = np.empty((len(nodes), 2 * nodes.shape[1] - 1, *nodes.shape[2:]))
        merged[:, ::2] = nodes
        merged[:, 1::2] = follows @ np.concatenate([nodes[:, :-1], nodes[:, 1:]], axis=2) + alone
        nodes = merged
    run_up, run_off = moments[:, 5] / factors[0][:, -1:], -moments[:, 1] / factors[0][:, :1]
    return np.stack([run_up.T, run_off.T, nodes[:, count // 2, 2].T]), nodes


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


@dataclass(frozen=True, kw_only=True)
class Line:
    """All fields [SI], shape (batch,); those with a default are those of a faultless line.

    run: index of the run in its campaign; yaw, yaw_head: angles that the pulleys are turned to at travel
    yaw_at; offset_tail, offset_head: angles that they are off from travel 0 on; sag_roll: share of the
    sag-roll coupling, 0 for a flat strip (Th2), 1 for the strip; slippery: 1/mu on both pulleys, 0 = sticking;
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
    slippery: Numbers = 0.0
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

    @property
    def radii(self) -> np.ndarray:
        """Of the tail and of the head pulley [m], (2, batch)."""
        return np.stack([self.tail_radius, self.head_radius])

    @property
    def wraps(self) -> np.ndarray:
        """Wrapped arcs of the tail and of the head pulley [m], (2, batch)."""
        return np.stack([self.wrap_tail, self.wrap_head])

    def span(
        self, *, to_tail: bool | np.ndarray = True, sections: Sections = AS_STATED, loads=None, tilts=()
    ) -> SpanResponse:
        """The response of the free span that runs to the tail (or to the head) pulley, which may be another in every
        lane; else as of ``solve_span``, but tension of the sections (batch,).

        With a bending layer the ends give way. The belt lies on the pulley to where its layer begins, whose slope is
        (length/R) exp(-x/length) towards the straight line. There a couple M about z twists it. The rate of twist t
        obeys D b^3/12 t'' - T t = M times that slope, t = 0 at the pulley: the difference of two exponentials.
        """
        line, yields = self, []
        if np.any(self.layer):
            line = replace(self, stress=self.stress * sections.tension)
            plate = line.youngs_modulus * line.thickness**3 / (12 * (1 - line.poisson_ratio**2))
            length = np.sqrt(plate / (line.stress * line.thickness))
            twist = np.sqrt(plate * line.width**3 / 12 / line.torsion)  # the other length, along which a twist dies out
            upper, both = np.where((line.direction > 0) == to_tail, 1.0, -1.0), (line.head_radius, line.tail_radius)
            for pulleys, at_runup in ((both, -1.0), (both[::-1], 1.0)):
                radius = np.where(to_tail, *pulleys)
                rolled = length**3 / (length + twist) / radius  # integral of t, times T/M
                turned = rolled * length / (2 * radius) / (1 + twist / length)  # of the layer's slope times t
                slope = -line.layer * turned / line.torsion
                cross = at_runup * upper * line.layer * rolled / line.torsion
                yields.append(np.stack([np.stack([slope, cross], -1), np.stack([cross, 0 * cross], -1)], -2))
        stated = self.span_length, self.bending, self.force, self.torsion, self.sag_roll * self.sag_curvature
        return solve_span(*stated, sections, yields or None, loads, tilts)

    @cached_property
    def runup_sensitivity(self) -> np.ndarray:
        """Curvature in the middle of every element per unit run-up angle [1/m], shape (batch, n)."""
        coupling = self.sag_roll * self.sag_curvature
        return curvature_along(self.span()[1], self.span_length, coupling)[:, :, 3]


def stack(lines: list[Line]) -> Line:
    """Several batches as one."""
    names = Line.__dataclass_fields__
    return Line(**{name: np.concatenate([getattr(line, name) for line in lines]) for name in names})


@dataclass
class UnitLoad:
    """A unit load on one span, shape (batch,) each: what it adds at fixed ends.

    upper: on the span above (whichever way the belt runs); to_tail: whether that runs to the tail pulley; adds, shape
    (3, batch): curvature at the run-up and at the run-off [1/m], roll at mid-span [rad]; row, shape (4, batch): y at
    the load's place per boundary value (y_o, theta_o, y_u, theta_u); give: y there per unit of the load. A load that is
    spread has no place: row and give are 0. In a march: whose it is, and what it remembers, now and at the nodes
    (n, batch).
    """

    upper: bool
    to_tail: np.ndarray
    adds: np.ndarray
    row: np.ndarray
    give: np.ndarray
    fault: Any = None
    now: Numbers = 0.0
    kept: Any = None

    def act(self, s, line: Line, ends: np.ndarray, kept) -> tuple[np.ndarray, Any]:
        """How much of it acts, and what it then remembers, given the spans' ends (2, 4, ..., batch)."""
        at = np.where(self.to_tail, *ends)
        free = sum(row * value for row, value in zip(self.row, at, strict=True))
        return self.fault.push(s, line, self, free, kept)


def unit_load(line: Line, upper: bool, kind: str, share=None) -> UnitLoad:
    """A unit load of a kind on the span above, or below.

    kind: force, 1 N towards +y at ``share`` of the span's length, counted from the head to the tail pulley; couple,
    1 N m about the vertical there, turning y' upwards along the travel; spread_force, 1 N/m towards +y all along;
    spread_roll, 1 N m per m about the long axis, lifting the side y > 0; roll_at_tail, 1 rad of roll, the side y > 0
    up, of the tail pulley where the span meets it.
    """
    count, to_tail = 2**DOUBLINGS, (line.direction > 0) == upper
    tilts: tuple[np.ndarray, ...] = ()
    h, lanes = line.span_length / count, np.arange(len(line.stress))
    loads = np.zeros((len(lanes), count + 1, 4))  # on the nodes: force, couples, and on the slope of the tilt
    if kind == "roll_at_tail":
        tilts = ~to_tail, to_tail
    elif share is None:
        fields = [2, 3] if kind == "spread_roll" else [0, 1]
        pair = np.stack([h / 2, h**2 / 12, h / 2, -(h**2) / 12], -1)  # on value and slope at either end of an element
        loads[:, :-1, fields] += pair[:, None, :2]
        loads[:, 1:, fields] += pair[:, None, 2:]
    else:
        share = np.broadcast_to(np.asarray(share, dtype=float), line.stress.shape)
        along = np.where(to_tail, share, 1 - share) * count
        k = np.clip(along.astype(int), 0, count - 1)
        value, first, _ = hermite(along - k, h)
        chosen = first if kind == "couple" else value
        loads[lanes, k, :2] += chosen[:, :2]
        loads[lanes, k + 1, :2] += chosen[:, 2:]

    adds, by_load = line.span(to_tail=to_tail, loads=loads, tilts=tilts)
    row, give = np.zeros((4, len(lanes))), np.zeros(len(lanes))
    if share is not None:  # y at the place, from the fields (batch, n, 4, k) by the ends and by the load
        nodes = line.span(to_tail=to_tail)[1], by_load
        ends = (np.concatenate([x[lanes, k, :2], x[lanes, k + 1, :2]], axis=1) for x in nodes)
        at_ends, at_load = (np.einsum("bi,bik->bk", value, end) for end in ends)
        row, give = at_ends.T, at_load[:, 0]
    return UnitLoad(upper, to_tail, adds[:, 0], row, give)


def tilt_sensitivity(line: Line, upper: bool) -> np.ndarray:
    """Curvature in the middle of every element by 1 N m about the long axis at mid-span, (batch, n) [1/(N m2)].

    By Betti's theorem natural curvature there tilts mid-span by EI times as much.
    """
    loads = np.zeros((len(line.stress), 2**DOUBLINGS + 1, 4))
    loads[:, 2 ** (DOUBLINGS - 1), 2] = 1.0
    nodes = line.span(to_tail=(line.direction > 0) == upper, loads=loads)[1]
    return curvature_along(nodes, line.span_length, line.sag_roll * line.sag_curvature)[..., 0]
