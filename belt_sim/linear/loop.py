"""A controller on the linear plant: the loop in travel, and its margins."""

from dataclasses import dataclass, replace
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import block_diag, expm

from belt_sim.errors import InputError, finite, whole
from belt_sim.linear.plant import LinearBelt, StateSpace, linear_belt, lying_at, python_control, state_space
from belt_sim.model import ModelName, analytic_model
from belt_sim.settings import BOUNDS, make_case
from belt_sim.units import DEGREE, MM

LOST_AT, _DIVERGED = 10.0, 1e6  # [m] off the middle: a run that comes to the second ends at the first
LOOP_ORDER = 6  # of the rational function that stands for each wrapped arc
LONGEST_WAY = 1000  # samples that a reading may be late: the loop's eigenvalues take a second
GROWS = 1e-6  # [1/m]: less is rounding of a mode that stands, e-fold in 1000 km
LOOP_WAVES = np.geomspace(1e-4, 20.0, 8000)  # [rad per metre of travel] at which the open loop is drawn


@dataclass(frozen=True, kw_only=True)
class Margins:
    """Of the open loop: gain_margin [1], phase_margin [rad], delay_margin [s] that the loop still bears, crossover
    [rad/s] of unit gain where phase_margin is, nearest: least distance of the Nyquist curve from -1. inf where there is
    none. phase_margin is the smallest change of phase at any crossover that makes a stable loop unstable: a lag, or a
    lead if by_lead. Then delay_margin, which is a lag, belongs to another crossover.
    """

    gain_margin: float
    phase_margin: float
    delay_margin: float
    crossover: float
    nearest: float
    by_lead: bool = False


@dataclass(frozen=True, kw_only=True)
class ClosedLoop:
    """A run of the loop, all of shape (n,) but y (4, n).

    time [s], travel [m], y: points 1-4 [m], measured: what the sensor shows [m], command: yaw that the controller asks
    for [rad], yaw: yaw of the pulley [rad]; frequency [rad/s], loop: the open loop there (complex), growth: of the
    slowest decaying or fastest growing mode of the sampled loop without limits and backlash [1/m], and margins: None of
    a controller that is a function; no margins of an unstable loop.
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
    growth: float | None = None
    margins: Margins | None = None

    @property
    def settled(self) -> float:
        """Travel [m] from which the point stays within 5 % of its largest distance from its last position; inf if that
        is not so for the last third of the run, or if its slowest mode has not decayed to 5 %."""
        y = self.y[self.point - 1]
        off = np.abs(y - y[-1])
        if not off.any():  # the belt never moved
            return 0.0
        late = np.flatnonzero(off > 0.05 * off.max())
        there = float(self.travel[late[-1]]) if len(late) else 0.0
        left = self.growth is not None and self.growth * self.travel[-1] > np.log(0.05)
        return np.inf if left or there > 2.0 / 3.0 * self.travel[-1] else there

    @property
    def unstable(self) -> bool:
        """Whether a mode of the loop grows; of a controller that is a function, unknown and taken not to."""
        return self.growth is not None and self.growth > GROWS

    def __str__(self) -> str:
        y, far = self.y[self.point - 1], self.settled
        settled = f"settled after {far:.3g} m" if np.isfinite(far) else f"not settled within {self.travel[-1]:.3g} m"
        lines = [
            f"point {self.point}: largest {np.abs(y).max() / MM:.3g} mm, last {y[-1] / MM:+.3g} mm, "
            f"{settled}; largest yaw {np.abs(self.yaw).max() / DEGREE:.3g} deg"
        ]
        if self.unstable and self.growth:
            lines.append(f"UNSTABLE: any disturbance grows 2.7 times every {1.0 / self.growth:.3g} m of travel")
        if (m := self.margins) is not None:
            lead = " (against a lead: less lag makes the loop unstable)" if m.by_lead else ""
            lines.append(
                f"phase margin {np.rad2deg(m.phase_margin):.3g} deg{lead}, gain margin {m.gain_margin:.3g}, "
                f"further delay {m.delay_margin:.3g} s, crossover {m.crossover:.3g} rad/s, "
                f"nearest to -1: {m.nearest:.2f}"
            )
        return "\n".join(lines)

    def plot(self, path: Path | str | None = None) -> Any:
        """Draw position and yaw over travel, and the Nyquist curve; return the figure, or the path it was saved to."""
        from belt_sim.show import style

        @style.picture
        def picture() -> Any:
            fig, axes = style.figure(12.0, 3.6, columns=3 if self.loop is not None else 2)
            for k, colour in enumerate(style.POINT_COLOURS):
                axes[0].plot(self.travel, self.y[k] / MM, color=colour, lw=1.4, label=f"point {k + 1}")
            axes[0].set(title="Lateral position", xlabel="belt travel [m]", ylabel="y [mm]")
            axes[0].legend()
            axes[1].plot(self.travel, self.command / DEGREE, color=style.FAINT_INK, lw=1.2, label="asked for")
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
    plant: LinearBelt | ModelName, controller: Any, *, point: int = 1, reference: float = 0.0, y_start: float = 0.0,
    askew: float = 0.0, drift: float = 0.0, delay: float = 0.0, noise: float = 0.0, limits: float = np.inf,
    backlash: float = 0.0, sample: float = 0.05, travel: float = 60.0, seed: int = 0, tension: float | None = None,
    speed: float | None = None, direction: float | None = None, rig: Any = None, belt: Any = None,
) -> ClosedLoop:  # fmt: skip
    """Run ``controller`` over ``travel`` [m] on a plant of ``bs.linearise``, or on that of a model by its name at a
    tension, speed, direction, rig and belt as ``bs.linearise`` takes them.

    controller: a transfer function or state space of python-control (continuous, from error [m] to yaw [rad]; extra
    ``control``), a number (gain [rad/m]), or a function (time [s], error [m]) -> yaw [rad]. The error is ``reference``
    [m] less the reading of ``point`` 1-4, so that the feedback is negative. y_start [m]: where the belt lies at first;
    askew [rad]: a yaw of the tail pulley that the controller does not know; drift [m/m]: lateral drift added at the
    tail's run-up. delay [s]: of the sensor; noise [m]: standard deviation of a reading; limits [rad]: largest yaw
    either way; backlash [rad]: play between drive and pulley; sample [s]: of sensor and controller, which holds its yaw
    between samples. The margins count the delay and half a sample, with the wrapped arcs exact, and neither limits nor
    backlash. A run that diverges ends 10 m off; of a controller that is a function it raises InputError, as other bad
    input does.
    """
    if point not in (1, 2, 3, 4):
        raise InputError("point", point, "", "use 1, 2, 3 or 4")
    for name, value, unit in (("delay", delay, "s"), ("noise", noise, "m"), ("backlash", backlash, "rad")):
        finite(name, value, unit, "give 0 or more", lambda x: x >= 0)
    for name, value, unit in (("sample", sample, "s"), ("travel", travel, "m")):
        finite(name, value, unit, "give a positive number", lambda x: x > 0)
    for name, value, unit in (("reference", reference, "m"), ("y_start", y_start, "m"), ("drift", drift, "m/m")):
        finite(name, value, unit, "give a finite number")
    angles = {"askew": askew, "backlash": backlash} | ({} if limits == np.inf else {"limits": limits})
    for name, value in angles.items():
        BOUNDS["yaw"].check(finite(name, value, "rad"), "rad", name=name)
    stated = {"tension": tension, "speed": speed, "direction": direction, "rig": rig, "belt": belt}
    stated = {name: value for name, value in stated.items() if value is not None}
    if isinstance(plant, str):
        plant = linear_belt(make_case(**stated), analytic_model(plant))
    elif not isinstance(plant, LinearBelt) or stated:
        remedy = "give a plant, bs.linearise(model=..., tension=..., speed=...), or a model's name and its settings"
        raise InputError("plant", repr(plant)[:40], "", remedy)
    for name, value in (("reference", reference), ("y_start", y_start)):
        if abs(value) > plant.width:
            raise InputError(name, value, "m", f"the belt is {plant.width:g} m wide; give at most that, in m")
    if not limits > 0:
        raise InputError("limits", limits, "rad", "give the largest yaw either way, above 0")
    whole("seed", seed, 0)
    steps, late = round(travel / (plant.speed * sample)), round(delay / sample)
    if not 2 <= steps <= 1_000_000:
        raise InputError("sample", sample, "s", f"{steps} steps in {travel:g} m; give 2 to a million")
    if late > LONGEST_WAY:
        raise InputError("delay", delay, "s", f"give at most {LONGEST_WAY} samples of {sample:g} s, or longer samples")
    linear = None if callable(controller) and not hasattr(controller, "dt") else _continuous(controller)

    # the run, sample by sample: what is held is exact
    space, rng = state_space(plant, order=LOOP_ORDER), np.random.default_rng(seed)
    constant = np.zeros(len(space.a))
    constant[: len(plant.constant)] = plant.constant * plant.speed
    constant[0] += drift * plant.speed
    moves, (by_yaw, by_itself) = _held(space.a, np.column_stack([space.b[:, 0], constant]), sample)
    drawn: dict[str, Any] = {}
    if linear is not None:
        inside, (by_error,) = _held(linear.A, linear.B, sample)
        x = np.zeros(len(inside))  # state of the controller
        drawn = _open_loop(space, linear, point=point, late=late, sample=sample, delay=delay)
    z, turned, end, samples = lying_at(space, y_start), 0.0, steps + 1, steps + 1
    shown, (measured, command, yaw) = np.zeros((4, samples)), np.zeros((3, samples))
    for k in range(samples):
        # the sensor reads the belt, ``late`` samples ago
        shown[:, k] = space.c @ z
        measured[k] = shown[point - 1, max(k - late, 0)] + noise * rng.standard_normal()
        # the controller answers, unless the loop has diverged
        error = reference - measured[k]
        if linear is None:
            command[k] = float(controller(k * sample, error))
        else:
            command[k] = linear.C[0] @ x + float(linear.D[0, 0]) * error
            x = inside @ x + by_error * error
        if not np.isfinite(command[k]) or np.abs(shown[:, k]).max() > _DIVERGED:
            end = int(np.argmax(np.abs(shown[:, : k + 1]).max(axis=0) > LOST_AT))
            if linear is None or end < 2:
                remedy = f"the loop is unstable: it diverges by {k * sample:.3g} s; give limits, or a smaller gain"
                raise InputError("controller", f"{command[k]:g}", "rad", remedy)
            break
        # the drive turns the pulley through its play, and the belt moves on until the next sample
        driven = float(np.clip(command[k], -limits, limits))
        turned = float(np.clip(turned, driven - 0.5 * backlash, driven + 0.5 * backlash))
        yaw[k] = turned + askew
        z = moves @ z + by_yaw * yaw[k] + by_itself
    time = sample * np.arange(end)
    curves: dict[str, Any] = {"y": shown[:, :end], "measured": measured[:end], "command": command[:end]}
    curves |= {"time": time, "travel": time * plant.speed, "yaw": yaw[:end]}
    return ClosedLoop(plant=plant, point=point, **curves, **drawn)


def _open_loop(space: StateSpace, linear: Any, *, point: int, late: int, sample: float, delay: float) -> dict[str, Any]:
    """frequency, loop, growth and, where it is stable, margins of a ``ClosedLoop`` with a controller as a state space.

    growth is the logarithm of the largest eigenvalue of the sampled loop: belt, readings on their way, controller.
    """
    plant, frequency = space.plant, LOOP_WAVES * space.plant.speed
    held = np.exp(-1j * frequency * (delay + 0.5 * sample))
    loop = np.asarray(linear(1j * frequency)).reshape(-1) * plant.response(LOOP_WAVES)[:, point - 1, 0] * held

    turns, (by_yaw,) = _held(space.a, space.b[:, :1], sample)
    inside, (by_error,) = _held(linear.A, linear.B, sample)
    n = len(turns)
    steps = block_diag(turns, np.eye(late, k=-1), inside)
    reading = np.zeros(len(steps))
    if late:
        reading[n + late - 1] = 1.0
        steps[n, :n] = space.c[point - 1]
    else:
        reading[:n] = space.c[point - 1]
    steers = -float(linear.D[0, 0]) * reading
    steers[n + late :] = linear.C[0]
    steps[:n] += np.outer(by_yaw, steers)
    steps[n + late :] -= np.outer(by_error, reading)
    growth = float(np.log(np.abs(np.linalg.eigvals(steps)).max())) / (plant.speed * sample)

    drawn: dict[str, Any] = {"frequency": frequency, "loop": loop, "growth": growth}
    if growth <= GROWS:
        found = margins_of(frequency, loop)
        drawn["margins"] = replace(found, phase_margin=abs(found.phase_margin), by_lead=found.phase_margin < 0.0)
    return drawn


def _held(a: np.ndarray, b: np.ndarray, sample: float) -> tuple[np.ndarray, np.ndarray]:
    """A and the columns of B of dx/dt = a x + b u over a sample [s] in which u is held."""
    block = np.zeros((len(a) + b.shape[1],) * 2)
    block[: len(a)] = np.hstack([a, b])
    step = expm(block * sample)[: len(a)]
    return step[:, : len(a)], step[:, len(a) :].T


def margins_of(frequency: np.ndarray, loop: np.ndarray) -> Margins:
    """The margins of an open loop (n,) at ``frequency`` [rad/s], between whose entries it is interpolated; its phase
    margin is below 0 where a lead takes the curve to -1: of an unstable loop, or of one that is stable conditionally.
    """
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
    turns = range(int(phase.min() // (2.0 * np.pi)) - 1, int(phase.max() // (2.0 * np.pi)) + 1)
    falls = [np.exp(-g) for n in turns for g in crossings(phase - np.pi * (2 * n + 1), gain)[1] if g < 0]
    return Margins(
        gain_margin=float(min(falls, default=np.inf)),
        phase_margin=float(margin[least]) if len(at) else np.inf,
        delay_margin=float(np.min(np.mod(margin, 2.0 * np.pi) / at)) if len(at) else np.inf,
        crossover=float(at[least]) if len(at) else np.inf,
        nearest=float(np.abs(1.0 + loop).min()),
    )


def _continuous(controller: Any) -> Any:
    """A controller as a continuous state space of python-control."""
    control = python_control("controller", "of python-control")
    if isinstance(controller, Real):
        finite("controller", float(controller), "rad/m", "give a finite gain")
        controller = control.tf([float(controller)], [1.0])
    try:
        made = control.ss(controller)
    except Exception as error:  # python-control has errors of many kinds
        given = error if hasattr(controller, "dt") else "give one, a number or a function (time, error)"
        raise InputError("controller", controller, "", f"no transfer function or state space: {given}") from None
    if made.ninputs != 1 or made.noutputs != 1 or made.dt not in (0, None):
        raise InputError(
            "controller", f"{made.ninputs} inputs", "", "give a continuous one of one input and one output"
        )
    return made
