"""Bonds of a grid of particles: a span of them, pushed sideways in its middle, gives like a string or like a beam."""

from dataclasses import dataclass

import numpy as np
import pytest
from paper_cases import paper_case

from belt_sim.case import Case
from belt_sim.space.scene import Lattice, calibrate

ACROSS = 2  # lines of particles


@dataclass(frozen=True, kw_only=True)
class PushedSpan:
    """rest, moved (n, 2, 2): x and y [m] of the particles of both lines; force [N] in its middle."""

    rest: np.ndarray
    moved: np.ndarray
    force: float

    @property
    def give(self) -> float:
        """Deflection of its middle per newton [m/N]."""
        middle = len(self.rest) // 2
        return float((self.moved - self.rest)[middle, :, 1].mean()) / self.force


def pushed_span(case: Case, chord: float, bonds: tuple[str, ...], force: float = 1.0) -> PushedSpan:
    """Equilibrium in the plane, linear about the belt at its tension, whose pull the lines carry.

    A bond with stiffness k and pull P answers a stretch with k and a turn with P / length.
    """
    stations = 2 * round(0.5 * float(case.rig.span_length) / chord) + 1
    lattice = calibrate(case.belt, chord, ACROSS, bonds)
    y = 0.5 * lattice.width * np.array([-1.0, 1.0])
    rest = np.stack(np.broadcast_arrays(np.arange(stations)[:, None] * chord, y), axis=2)
    places, whole = rest.reshape(-1, 2), np.zeros((rest.size, rest.size))
    for a, b, stretch, pull in _bonds(stations, lattice, 0.5 * float(case.tension_force)):
        way = places[b] - places[a]
        length = float(np.hypot(*way))
        along = np.outer(way, way) / length**2
        block = stretch / length * along + pull / length * (np.eye(2) - along)
        for p, q, sign in ((a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)):
            whole[2 * p : 2 * p + 2, 2 * q : 2 * q + 2] += sign * block
    load = np.zeros((stations, ACROSS, 2))
    load[stations // 2, :, 1] = force / ACROSS
    free = np.ones(load.shape, bool)
    free[[0, -1]] = False
    moved, flat = np.zeros(load.size), free.ravel()
    moved[flat] = np.linalg.solve(whole[np.ix_(flat, flat)], load.ravel()[flat])
    return PushedSpan(rest=rest, moved=rest + moved.reshape(rest.shape), force=force)


def _bonds(stations: int, lattice: Lattice, pull: float) -> list[tuple[int, int, float, float]]:
    """(node, node, EA [N], pull [N]) of every bond; node = 2 station + line."""
    found = [(2 * i + j, 2 * i + 2 + j, lattice.lines / ACROSS, pull) for i in range(stations - 1) for j in (0, 1)]
    if lattice.transverse:
        found += [(2 * i, 2 * i + 1, lattice.transverse, 0.0) for i in range(stations)]
    if lattice.diagonal:
        pairs = [(2 * i + j, 2 * i + 3 - j) for i in range(stations - 1) for j in (0, 1)]
        found += [(a, b, lattice.diagonal, 0.0) for a, b in pairs]
    return found


def test_bonds_without_diagonals_give_like_a_string_and_with_them_like_a_beam():
    case = paper_case(40.0)
    length, bonds = float(case.rig.span_length), ("longitudinal", "transverse", "diagonal")
    string = length / (4.0 * float(case.tension_force))
    square, braced = (pushed_span(case, 0.04, b).give for b in (bonds[:2], bonds))
    assert square == pytest.approx(string, rel=0.01)
    u = np.sqrt(float(case.tension_force) / float(case.belt.bending_stiffness)) * length / 4.0
    beam = string * (1.0 - np.tanh(u) / u)  # clamped, under tension, pushed in its middle
    assert braced == pytest.approx(beam, rel=0.01)
