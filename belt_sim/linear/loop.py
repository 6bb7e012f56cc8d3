"""A controller on the linear plant: the loop in travel with what a real drive and sensor add, and its margins."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import expm

from belt_sim.errors import InputError, finite, whole
from belt_sim.linear.plant import LinearBelt, state_space
from belt_sim.units import DEGREE, MM

ORDER = 6  # of the rational function that stands for each wrapped arc
WAVES = np.geomspace(1e-4, 20.0, 8000)  # [rad per metre of travel] at which the open loop is drawn
Controller = Callable[[float, float], float]  # (time [s], measured error [m]) -> yaw [rad]


@dataclass(frozen=True, kw_only=True)
class Margins:
    """Of the open loop: gain_margin [1], phase_margin [rad], delay_margin [s] that the loop still bears, crossover
    [rad/s] where the loop has unit gain, nearest: least distance of the Nyquist curve from -1. inf where there is none.
    """

    gain_margin: float
    phase_margin: float
    delay_margin: float
    crossover: float
    nearest: float


@dataclass(frozen=True, kw_only=True)
class ClosedLoop:
    """A run of the loop, all of shape (n,) but y (4, n).

    time [s], travel [m], y: points 1-4 [m], measured: what the sensor shows [m], command: yaw that the controller asks
    for [rad], yaw: yaw of the pulley [rad]; frequency [rad/s], loop: the open loop there (complex), and margins: None
    of a controller that is a function.
    """

    plant: LinearBelt
    point: int
    time: np.ndarray
    travel: np.ndarray
    y: np.ndarray
    measured: np.ndarray
    command: np.ndarray
    yaw: np.ndarray
    frequency: np.ndarray | None = None
    loop: np.ndarray | None = None
    margins: Margins | None = None

    @property
    def settled(self) -> float:
        """Travel [m] from which the point stays within 5 % of its largest distance from its last position."""
        y = self.y[self.point - 1]
        off = np.abs(y - y[-1])
        late = np.flatnonzero(off > 0.05 * off.max())
        return float(self.travel[late[-1]]) if len(late) else 0.0

    def __str__(self) -> str:
        y = self.y[self.point - 1]
        lines = [
            f"point {self.point}: largest {np.abs(y).max() / MM:.3g} mm, last {y[-1] / MM:+.3g} mm, "
            f"settled after {self.settled:.3g} m; largest yaw {np.abs(self.yaw).max() / DEGREE:.3g} deg"
        ]
        if (m := self.margins) is not None:
            lines.append(
                f"phase margin {np.rad2deg(m.phase_margin):.3g} deg, gain margin {m.gain_margin:.3g}, further delay "
                f"{m.delay_margin:.3g} s, crossover {m.crossover:.3g} rad/s, nearest to -1: {m.nearest:.2f}"
            )
        return "\n".join(lines)

    def plot(self, path: Path | str | None = None) -> Any:
        """Draw position and yaw over travel, and the Nyquist curve; return the figure, or the path it was saved to."""
        from belt_sim.show import style

        @style.picture
        def picture() -> Any:
            fig, [axes] = style.figure(12.0, 3.6, columns=3 if self.loop is not None else 2)
            for k, colour in enumerate(style.POINTS):
                axes[0].plot(self.travel, self.y[k] / MM, color=colour, lw=1.4, label=f"point {k + 1}")
            axes[0].set(title="Lateral position", xlabel="belt travel [m]", ylabel="y [mm]")
            axes[0].legend()
            axes[1].plot(self.travel, self.command / DEGREE, color=style.FAINT, lw=1.2, label="asked for")
            axes[1].plot(self.travel, self.yaw / DEGREE, color=style.INK, lw=1.4, label="of the pulley")
            axes[1].set(title="Yaw of the tail pulley", xlabel="belt travel [m]", ylabel="yaw [deg]")
            axes[1].legend()
            if self.loop is not None:
                near = np.abs(self.loop) < 4.0
                axes[2].plot(self.loop.real[near], self.loop.imag[near], color=style.BLUE)
                axes[2].plot(-1.0, 0.0, marker="+", color=style.RED, ms=10, mew=2)
                axes[2].set(title="Nyquist curve (cross: -1)", xlabel="real part", ylabel="imaginary part")
                axes[2].set_aspect("equal", "datalim")
            return style.save(fig, Path(path)) if path is not None else fig

        return picture()


def close_loop(
    plant: LinearBelt,
    controller: Any,
    *,
    point: int = 1,
    reference: float = 0.0,
    y_start: float = 0.0,
    askew: float = 0.0,
    drift: float = 0.0,
    delay: float = 0.0,
    noise: float = 0.0,
    limits: float = np.inf,
    backlash: float = 0.0,
    sample: float = 0.05,
    travel: float = 60.0,
    seed: int = 0,
) -> ClosedLoop:
    """Run ``controller`` on ``plant`` over ``travel`` [m].

    controller: a transfer function or state space of python-control (continuous, from error [m] to yaw [rad]; extra
    ``control``), or a function (time [s], error [m]) -> yaw [rad]. The error is ``reference`` [m] less the reading of
    ``point`` 1-4, so that the feedback is negative. y_start [m]: where the belt lies at first; askew [rad]: a yaw of
    the tail pulley that the controller does not know; drift [m/m]: lateral drift added at the tail's run-up. delay
    [s]: of the sensor; noise [m]: standard deviation of a reading; limits [rad]: largest yaw either way; backlash
    [rad]: play between drive and pulley; sample [s]: of sensor and controller, which holds its yaw between samples.
    The margins count the delay and half a sample, with the wrapped arcs exact, and neither limits nor backlash. Raises
    InputError.
    """
    if point not in (1, 2, 3, 4):
        raise InputError("point", point, "", "use 1, 2, 3 or 4")
    for name, value, unit in (("delay", delay, "s"), ("noise", noise, "m"), ("backlash", backlash, "rad")):
        finite(name, value, unit, "give 0 or more", lambda x: x >= 0)
    for name, value, unit in (("sample", sample, "s"), ("travel", travel, "m")):
        finite(name, value, unit, "give a positive number", lambda x: x > 0)
    for name, value, unit in (("reference", reference, "m"), ("y_start", y_start, "m"), ("askew", askew, "rad")):
        finite(name, value, unit, "give a finite number")
    finite("drift", drift, "m/m", "give a finite number")
    if not isinstance(plant, LinearBelt):
        raise InputError("plant", plant, "", "give a plant: bs.linearise(model=..., tension=..., speed=...)")
    if not limits > 0:
        raise InputError("limits", limits, "rad", "give the largest yaw either way, above 0")
    whole("seed", seed, 0)
    steps, late = round(travel / (plant.speed * sample)), round(delay / sample)
    if not 2 <= steps <= 1_000_000:
        raise InputError("sample", sample, "s", f"{steps} steps in {travel:g} m; give 2 to a million")
    linear = None if callable(controller) and not hasattr(controller, "dt") else _continuous(controller)
    ask = controller if linear is None else _Sampled(linear, sample)
    space = state_space(plant, order=ORDER)
    size = len(space.a)
    constant = np.zeros(size)
    constant[: len(plant.constant)] = plant.constant * plant.speed
    constant[0] += drift * plant.speed
    block = np.zeros((size + 2, size + 2))
    block[:size, :size], block[:size, size], block[:size, size + 1] = space.a, space.b[:, 0], constant
    step = expm(block * sample)
    z, shown = _lying_at(space, y_start), np.zeros((4, steps + 1))
    rng = np.random.default_rng(seed)
    measured, command, yaw = np.zeros(steps + 1), np.zeros(steps + 1), np.zeros(steps + 1)
    turned = 0.0
    for k in range(steps + 1):
        shown[:, k] = space.c @ z
        measured[k] = shown[point - 1, max(k - late, 0)] + noise * rng.standard_normal()
        command[k] = float(ask(k * sample, reference - measured[k]))
        if not np.isfinite(command[k]) or np.abs(shown[:, k]).max() > 1e6:
            raise InputError(
                "controller", f"{command[k]:g}", "rad", f"the loop is unstable: it diverges by {k * sample:.3g} s"
            )
        driven = float(np.clip(command[k], -limits, limits))
        turned = float(np.clip(turned, driven - 0.5 * backlash, driven + 0.5 * backlash))
        yaw[k] = turned + askew
        z = step[:size, :size] @ z + step[:size, size] * yaw[k] + step[:size, size + 1]
    time = sample * np.arange(steps + 1)
    drawn: dict[str, Any] = {}
    if linear is not None:
        frequency = WAVES * plant.speed
        held = np.exp(-1j * frequency * (delay + 0.5 * sample))
        loop = _response(linear, frequency) * plant.response(WAVES)[:, point - 1, 0] * held
        drawn = {"frequency": frequency, "loop": loop, "margins": margins_of(frequency, loop)}
    return ClosedLoop(
        plant=plant, point=point, time=time, travel=time * plant.speed, y=shown, measured=measured, command=command,
        yaw=yaw, **drawn,
    )  # fmt: skip


def margins_of(frequency: np.ndarray, loop: np.ndarray) -> Margins:
    """The margins of an open loop (n,) at ``frequency`` [rad/s], between whose entries it is interpolated."""
    gain, phase = np.log(np.abs(loop)), np.unwrap(np.angle(loop))

    def crossings(values: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Frequencies at which ``values`` crosses 0, and ``other`` there."""
        k = np.flatnonzero(values[:-1] * values[1:] < 0)
        part = values[k] / (values[k] - values[k + 1])
        log = np.log(frequency)
        return np.exp(log[k] + part * (log[k + 1] - log[k])), other[k] + part * (other[k + 1] - other[k])

    at, there = crossings(gain, phase)
    margin = np.mod(there + np.pi, 2.0 * np.pi)
    margin = np.where(margin > np.pi, margin - 2.0 * np.pi, margin)
    least = int(np.argmin(np.abs(margin))) if len(at) else -1
    falls = [np.exp(-g) for n in range(-4, 5) for g in crossings(phase + np.pi * (2 * n + 1), gain)[1] if g < 0]
    return Margins(
        gain_margin=float(min(falls, default=np.inf)),
        phase_margin=float(margin[least]) if len(at) else np.inf,
        delay_margin=float(np.min(np.mod(margin, 2.0 * np.pi) / at)) if len(at) else np.inf,
        crossover=float(at.max()) if len(at) else np.inf,
        nearest=float(np.abs(1.0 + loop).min()),
    )


def _continuous(controller: Any) -> Any:
    """A controller as a continuous state space of python-control."""
    try:
        import control
    except ImportError:
        raise InputError("controller", "of python-control", "", "pip install belt-sim[control]") from None
    try:
        made = control.ss(controller)
    except Exception as error:  # python-control has errors of many kinds
        raise InputError("controller", controller, "", f"no transfer function or state space: {error}") from None
    if made.ninputs != 1 or made.noutputs != 1 or made.dt not in (0, None):
        raise InputError(
            "controller", f"{made.ninputs} inputs", "", "give a continuous one of one input and one output"
        )
    return made


def _response(linear: Any, frequency: np.ndarray) -> np.ndarray:
    return np.asarray(linear(1j * frequency)).reshape(-1)


class _Sampled:
    """A continuous state space, discretised with a held input (zero-order hold)."""

    def __init__(self, linear: Any, sample: float) -> None:
        size = linear.nstates
        block = np.zeros((size + 1, size + 1))
        block[:size, :size], block[:size, size:] = linear.A, linear.B
        self.step, self.size = expm(block * sample), size
        self.c, self.d, self.x = np.asarray(linear.C)[0], float(np.asarray(linear.D)[0, 0]), np.zeros(size)

    def __call__(self, time: float, error: float) -> float:
        """The yaw [rad] for this sample's error [m]."""
        asked = float(self.c @ self.x + self.d * error)
        self.x = self.step[: self.size, : self.size] @ self.x + self.step[: self.size, self.size] * error
        return asked


def _lying_at(space: Any, y: float) -> np.ndarray:
    """State of a belt that has long lain ``y`` [m] off the middle."""
    states = len(space.plant.states)
    z = np.zeros(len(space.a))
    z[:states] = [y * name.startswith("y_") for name in space.plant.states]
    z[states:] = np.linalg.solve(space.a[states:, states:], -space.a[states:, :states] @ z[:states])
    return z
