"""What the strip law leaves out at large moments: python -m studies.wide_strip, on a short, wide, slack rig.

A span of fibres whose sections stay straight across: the one at y is stretched by e - y (v'' + phi w'') + (y phi')^2/2,
v and w the centre line's deflections, phi the tilt and e such that every section carries the tension F. Its energy is
that of the fibres, F (v'^2 + w'^2)/2, G b h^3/3 phi'^2/2 and the weight. For small angles that is the strip law; at
larger ones a moment takes M^2/F off the torsional stiffness (the looser edge sags more), the twist stretches the
edges, and fibres may go slack. Two such spans march like the strip's, in steps of travel (Heun).
"""

import math
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from rich.console import Console
from rich.table import Table

from belt_sim.case import Case, Schedule
from belt_sim.jax_setup import jit_float64, prepare
from belt_sim.model import analytic_model
from belt_sim.si import MM, N_PER_MM2
from studies.paper.case import paper_case

FIBRES = ("linear", "stretched", "slack")  # without (y phi')^2/2; with it; and without compression besides
YAW = math.radians(0.05)
TRAVELS = (0.5, 1.0, 2.0)  # [m]
_ELEMENTS, _ACROSS, _STEP = 16, 24, 0.1  # elements in a span, fibres, [m] of the march
_TURN = 5e-5  # [rad], the largest step of a boundary angle
_SLACK = 1e-4  # share of the stiffness that a slack fibre keeps
_AT, _WEIGHT = (np.polynomial.legendre.leggauss(3)[0] + 1.0) / 2.0, np.polynomial.legendre.leggauss(3)[1] / 2.0


def short_wide_rig(yaw: float = YAW) -> Case:
    """a = 3.5 m, R = 0.22 m, b = 0.26 m, h = 0.6 mm, 9 N/mm2; yaw [rad]."""
    case = paper_case(9.0 * N_PER_MM2)
    return replace(
        case,
        rig=replace(case.rig, centre_distance=3.5, head_radius=0.22, tail_radius=0.22),
        belt=replace(case.belt, width=0.26, thickness=0.6e-3),
        settings=replace(case.settings, yaw=Schedule.step(yaw)),
    )


def _hermite(t: float, length: float) -> np.ndarray:
    """Values, slopes and curvatures of the four cubics of an element [m] at t (0..1), shape (3, 4)."""
    value = [1 - 3 * t**2 + 2 * t**3, length * (t - 2 * t**2 + t**3), 3 * t**2 - 2 * t**3, length * (t**3 - t**2)]
    slope = [-6 * t + 6 * t**2, length * (1 - 4 * t + 3 * t**2), 6 * t - 6 * t**2, length * (3 * t**2 - 2 * t)]
    curve = [-6 + 12 * t, length * (-4 + 6 * t), 6 - 12 * t, length * (-2 + 6 * t)]
    return np.array([value, np.array(slope) / length, np.array(curve) / length**2])


class WideSpan:
    """One span; ``fields`` [m, rad and 1]: v and slope, w and slope, phi and slope at the nodes, e at Gauss points."""

    def __init__(self, case: Case, fibres: str = "stretched") -> None:
        self.case, self.fibres, length = case, fibres, float(case.rig.span_length)
        even = np.linspace(0.0, 1.0, _ELEMENTS + 1)
        self.nodes = length * (0.25 * (1.0 - np.cos(np.pi * even)) + 0.5 * even)  # closer at the ends
        self.n, long = 2 * (_ELEMENTS + 1), np.diff(self.nodes)
        self.weight, self.shape = (long[:, None] * _WEIGHT).ravel(), np.zeros((3, 3 * _ELEMENTS, self.n))
        for k in range(_ELEMENTS):
            for g, t in enumerate(_AT):
                self.shape[:, 3 * k + g, 2 * k : 2 * k + 4] = _hermite(t, long[k])
        n, z = self.n, float(case.sag_curvature)
        self.given = np.array([0, 1, n - 2, n - 1])
        level = [n, 2 * n - 2, 2 * n, 3 * n - 2]
        self.free = np.setdiff1d(np.arange(3 * n + len(self.weight)), [*self.given, *level])
        self.fields = np.zeros(3 * n + len(self.weight))
        self.fields[n : 2 * n : 2] = -0.5 * z * self.nodes * (length - self.nodes)
        self.fields[n + 1 : 2 * n : 2] = -0.5 * z * (length - 2.0 * self.nodes)
        self.fields[3 * n :] = float(case.settings.tension / case.belt.youngs_modulus)
        self.scale = np.where(self.free < 3 * n, 1.0, 1e-3)
        self.energy, self.slope = jit_float64(self._energy), jit_float64(jax.grad(self._energy))
        self.curve = jit_float64(jax.hessian(self._energy))

    def _energy(self, free, given):
        """[J] of the free fields when v and its slopes at the ends are as given, shape (4,)."""
        case, n, belt = self.case, self.n, self.case.belt
        z = jnp.zeros(len(self.fields)).at[self.free].set(free).at[self.given].set(given)
        (_, vx, vxx), (w, wx, wxx), (phi, twist, _) = (self.shape @ z[k * n : (k + 1) * n] for k in range(3))
        e, force = z[3 * n :], case.tension_force
        own = belt.shear_modulus * belt.width * belt.thickness**3 / 3.0
        rest = (
            force * (e - 0.5 * vx**2 - 0.5 * wx**2) - 0.5 * own * twist**2 - belt.mass_per_length * case.rig.gravity * w
        )
        return jnp.sum(self.weight * (self._stretch(e, vxx + phi * wxx, twist) - rest))

    def _stretch(self, e, bent, twist):
        """Energy of the fibres [J/m]."""
        belt, force = self.case.belt, self.case.tension_force
        if self.fibres == "linear":
            torsion = force * belt.width**2 / 12.0
            return 0.5 * (
                belt.youngs_modulus * belt.area * e**2 + belt.bending_stiffness * bent**2 + torsion * twist**2
            )
        y, share = np.polynomial.legendre.leggauss(_ACROSS)
        y, share = 0.5 * belt.width * y, 0.5 * belt.width * share
        strain = e[:, None] - y * bent[:, None] + 0.5 * (y * twist[:, None]) ** 2
        kept = jnp.where((strain > 0.0) | (self.fibres != "slack"), 1.0, _SLACK)
        return 0.5 * belt.youngs_modulus * belt.thickness * (kept * strain**2) @ share

    def hold(self, given: np.ndarray) -> tuple[float, float, float]:
        """EI v'' [N m] at the run-off and the run-up, mid-span tilt [rad]; given: v, v' at the run-off and run-up."""
        start, n = self.fields[self.given].copy(), self.n
        parts = max(1, math.ceil(np.abs(given - start)[[1, 3]].max() / _TURN))
        for k in range(parts):
            self._rest(start + (given - start) * (k + 1) / parts)
        ends = [(0, 0.0), (_ELEMENTS - 1, 1.0)]
        bent = [_hermite(t, self.nodes[k + 1] - self.nodes[k])[2] @ self.fields[2 * k : 2 * k + 4] for k, t in ends]
        moments = float(self.case.belt.bending_stiffness) * np.array(bent)
        return float(moments[0]), float(moments[1]), float(self.fields[2 * n + n // 2 - 1 + (n // 2 + 1) % 2])

    def _rest(self, given: np.ndarray) -> None:
        """Newton with a line search; where the energy is not convex the step is shortened by its diagonal."""
        free = self.fields[self.free]
        level = float(self.energy(free, given))
        for _ in range(200):
            g = np.asarray(self.slope(free, given)) * self.scale
            h = np.asarray(self.curve(free, given)) * self.scale * self.scale[:, None]
            step, convex = _downhill(g, h)
            share, before = 1.0, level
            while share > 1e-6:
                level = float(self.energy(free + share * step * self.scale, given))
                if level <= before + 1e-4 * share * float(g @ step) + 1e-12 * abs(before):
                    break
                share *= 0.5
            free = free + share * step * self.scale
            if convex and np.abs(step).max() < 1e-6:
                break
        self.fields[self.free], self.fields[self.given] = free, given


def _downhill(g: np.ndarray, h: np.ndarray) -> tuple[np.ndarray, bool]:
    more = 0.0
    while True:
        try:
            c = np.linalg.cholesky(h + more * np.diag(np.abs(np.diag(h))))
            return -np.linalg.solve(c.T, np.linalg.solve(c, g)), more == 0.0
        except np.linalg.LinAlgError:
            more = max(2.0 * more, 1e-6)


@dataclass
class March:
    """Points 1 and 3 of a belt of two wide spans, stuck: rows of ``state`` are y_1, alpha_1, y_3, alpha_3 [m, rad]."""

    upper: WideSpan
    lower: WideSpan
    state: np.ndarray

    @staticmethod
    def from_case(case: Case, fibres: str, travel: float) -> "March":
        """After ``travel`` [m]."""
        run = March(WideSpan(case, fibres), WideSpan(case, fibres), np.zeros((round(travel / _STEP) + 1, 4)))
        for k in range(len(run.state) - 1):
            first = run._rates(k, k * _STEP, run.state[k])
            guess = run.state[k] + _STEP * first
            run.state[k + 1] = run.state[k] + 0.5 * _STEP * (first + run._rates(k, (k + 1) * _STEP, guess))
        return run

    def _rates(self, known: int, travel: float, now: np.ndarray) -> np.ndarray:
        case = self.upper.case
        yaw, bending = float(case.settings.yaw.change[0]), float(case.belt.bending_stiffness)
        back, travels = travel - math.pi * float(case.rig.tail_radius), _STEP * np.arange(known + 1)
        y1, a1, y3, a3 = (np.interp(back, travels, c) if back > 0.0 else 0.0 for c in self.state[: known + 1].T)
        _, up, _ = self.upper.hold(np.array([y3, a3, now[0], yaw + now[1]]))
        _, down, _ = self.lower.hold(np.array([y1, a1 - yaw, now[2], now[3]]))
        return np.array([-now[1], -up / bending, -now[3], -down / bending])


def main() -> None:
    case, console = short_wide_rig(), Console()
    table = Table("yaw deg", "fibres", "entry", "carry-over N m", "tilt mrad", title="one span, its run-up turned")
    for degrees in (0.005, 0.01, 0.02, 0.03, 0.05):
        for fibres in FIBRES:
            off, up, tilt = WideSpan(case, fibres).hold(np.array([0.0, 0.0, 0.0, math.radians(degrees)]))
            table.add_row(f"{degrees:g}", fibres, f"{up:.2f}", f"{off:.2f}", f"{tilt / MM:.3f}")
    console.print(table)
    table = Table("model", *(f"{s:g} m" for s in TRAVELS), title="y of point 1 / 3, mm, at 0.05 deg")
    strip = analytic_model("strip").run(case, travel=TRAVELS[-1])
    rows = {"strip law": (strip.travel, strip.y[0], strip.y[2])}
    for fibres in FIBRES:
        y = March.from_case(case, fibres, TRAVELS[-1]).state
        rows[fibres] = (_STEP * np.arange(len(y)), y[:, 0], y[:, 2])
    for name, (travel, one, three) in rows.items():
        at = [f"{np.interp(s, travel, one) / MM:.4f} / {np.interp(s, travel, three) / MM:.4f}" for s in TRAVELS]
        table.add_row(name, *at)
    console.print(table)


if __name__ == "__main__":
    prepare()
    main()
