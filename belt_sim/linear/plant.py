"""The linear plant, dx/ds = A x(s) + A_d x(s - wrapped arc) + B u, for a belt that sticks; its state space.

x = (y, alpha) where the belt runs up the tail pulley, then the head pulley; u = (yaw of the tail, yaw of the head).
The coefficients are derivatives of the laws that a march takes; the travel s takes the place of time.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import factorial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy import signal
from scipy.interpolate import PchipInterpolator
from scipy.io import savemat
from scipy.linalg import block_diag

from belt_sim.case import Case, Schedule
from belt_sim.errors import CannotRepresent, InputError, Limit, whole
from belt_sim.io import write_with
from belt_sim.jax_setup import LEAST_EFFORT, in_float64, jit_float64
from belt_sim.line.hooks import AFTER_ENGINE, Hooks, apply_hook, as_driven, overrides
from belt_sim.line.runup import RunOff, RunUp, Yaw
from belt_sim.line.spans import Composition, Spans
from belt_sim.units import DEGREE, MM_PER_M, N_PER_MM2

INPUTS = ("yaw", "yaw_head")
OUTPUTS = ("y1", "y2", "y3", "y4")
STATES = ("y_tail", "alpha_tail", "y_head", "alpha_head")
#: How a wrapped arc is replaced: Pade's approximation, or a chain of equal lags.
ARC_MODELS = ("pade", "chain")
_AT_REST = 1e-4  # [rad/m]: so slow that the plant only integrates
_SLOW = 2.0  # [rad/m]: up to here a wrapped arc by Pade 4 is exact to 1e-7
_GRID = 200  # wavenumbers at which the error is looked for


@dataclass(frozen=True, kw_only=True)
class LinearBelt:
    """A belt around a working point.

    now, delayed: A and A_d, shape (n, n) [1, 1/m, 1/m2 by the units of x]; drive: B (n, 2); constant: dx/ds at the
    working point with nothing steered (n,); states: names of x, n = 4, or 2 for a limp rope, which has no angles of its
    own; arcs: wrapped arc that each state comes back after (n,) [m]; places: for each of y1..y4 the state that it
    shows and whether it comes one arc late; speed [m/s], tension [Pa]; beyond: limits that its model is used beyond;
    width: of the belt [m].
    """

    model: str
    tension: float
    speed: float
    states: tuple[str, ...]
    now: np.ndarray
    delayed: np.ndarray
    drive: np.ndarray
    constant: np.ndarray
    arcs: np.ndarray
    places: tuple[tuple[int, bool], ...]
    beyond: tuple[Limit, ...] = ()
    width: float = np.inf

    def response(self, wavenumber: np.ndarray) -> np.ndarray:
        """Lateral position per yaw [m/rad] at ``wavenumber`` [rad/m], shape (k, 4, 2), delays exact.

        Raises InputError for a wavenumber that is not positive: the belt integrates, so there is none at 0.
        """
        k = np.atleast_1d(np.asarray(wavenumber, dtype=float))
        if not np.all(k > 0):
            raise InputError("wavenumber", f"{k.min():g}", "rad/m", "give positive ones")
        p = 1j * k[:, None]
        late = np.exp(-p * self.arcs)
        system = p[..., None] * np.eye(len(self.states)) - self.now - self.delayed * late[:, None, :]
        x = np.linalg.solve(system, np.broadcast_to(self.drive, (len(k), *self.drive.shape)).astype(complex))
        rows = [x[:, state] * (late[:, state, None] if after else 1.0) for state, after in self.places]
        return np.stack(rows, axis=1)

    def response_in_time(self, frequency: np.ndarray) -> np.ndarray:
        """The same at ``frequency`` [Hz] and the belt's speed."""
        return self.response(2 * np.pi * np.atleast_1d(np.asarray(frequency, dtype=float)) / self.speed)

    def __repr__(self) -> str:
        """Slow poles, gains and limits with their units; the arrays are its fields."""
        poles = np.linalg.eigvals(state_space(self, order=4, per_metre=True).a)
        slow = sorted((p for p in poles if p.imag >= 0.0 and _AT_REST < abs(p) < _SLOW), key=abs)
        shown = ["0 (it integrates)", *(f"{p.real:.3g}" + (f" +- {p.imag:.3g}i" if p.imag else "") for p in slow)]
        rates = (1j * _AT_REST * self.response(np.array([_AT_REST]))[0]).real.mean(axis=0) * DEGREE / MM_PER_M
        beyond = [f"{x.id} ({x.load:.3g} times the limit)" for x in self.beyond]
        lines = [
            f"linear plant of {self.model}, {self.tension / N_PER_MM2:g} N/mm2, {self.speed:g} m/s, yaws -> y1..y4",
            f"poles   {', '.join(shown)} rad/m, and faster than {_SLOW:g} rad/m those of the wrapped arcs",
            f"gains   late rate {rates[0]:.4g} (yaw), {rates[1]:.4g} (yaw_head) mm/m per degree",
            f"limits  {'beyond ' + ', '.join(beyond) if beyond else 'within those of the model'}",
        ]
        return "\n".join(lines)

    @property
    def direction(self) -> int:
        """1 where the upper span runs from the head to the tail pulley, else -1."""
        return -1 if self.places[0][1] else 1

    def to_control(self, *, order: int = 4, delay: str = "pade") -> Any:
        """The state space in seconds as a ``control.StateSpace`` of python-control; raises InputError without it."""
        space = state_space(self, order=order, delay=delay)
        names: dict[str, Any] = {"inputs": list(INPUTS), "outputs": list(OUTPUTS), "name": "belt"}
        return python_control("control", "not installed").ss(space.a, space.b, space.c, space.d, **names)


@dataclass(frozen=True)
class PlantSchedule:
    """Plants of one rig, belt and model in order of tension; their coefficients are interpolated monotonically."""

    plants: tuple[LinearBelt, ...]

    def __repr__(self) -> str:
        tensions = ", ".join(f"{p.tension / N_PER_MM2:g}" for p in self.plants)
        return f"plants of {self.plants[0].model} at {tensions} N/mm2; .plant_at(tension) gives any between them"

    def plant_at(self, tension: float) -> LinearBelt:
        """The plant at ``tension`` [N/mm2], no further than the plants reach (InputError beyond)."""
        known = np.array([p.tension for p in self.plants])
        asked = tension * N_PER_MM2
        if not known[0] <= asked <= known[-1]:
            reach = f"{known[0] / N_PER_MM2:g} to {known[-1] / N_PER_MM2:g}"
            raise InputError("tension", f"{tension:g}", "N/mm2", f"stay within {reach}, where plants were computed")
        coefficients: dict[str, Any] = {
            name: PchipInterpolator(np.log(known), np.stack([getattr(p, name) for p in self.plants]))(np.log(asked))
            for name in ("now", "delayed", "drive", "constant")
        }
        nearest = min(self.plants, key=lambda p: abs(p.tension - asked))
        return replace(nearest, tension=float(asked), **coefficients)


@dataclass(frozen=True, kw_only=True)
class StateSpace:
    """dz/dt = a z + b u, y = c z + d u in seconds (per_metre False) or metres of travel (True).

    u: yaw of the tail and of the head pulley [rad]; y: y1..y4 [m]; order and delay: how a wrapped arc was replaced.
    """

    plant: LinearBelt
    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray
    order: int
    delay: str
    per_metre: bool

    def response(self, frequency: np.ndarray) -> np.ndarray:
        """y per u [m/rad] at angular ``frequency`` [rad/s, or rad/m of travel], shape (k, 4, 2)."""
        p = 1j * np.atleast_1d(np.asarray(frequency, dtype=float))[:, None, None]
        return self.c @ np.linalg.solve(p * np.eye(len(self.a)) - self.a, self.b.astype(complex)) + self.d

    def error(self, highest: float) -> float:
        """Largest difference from the exact plant up to ``highest`` [rad/s or rad/m], as a share of each entry's size.

        Entries are yaw to y1..y4; ``highest`` should be a little above where the controller stops acting.
        """
        w = np.geomspace(1e-3 * highest, highest, _GRID)
        exact = self.plant.response(w if self.per_metre else w / self.plant.speed)
        size = np.abs(exact)
        seen = size > 1e-9 * size.max()
        return float(np.max(np.abs(self.response(w) - exact)[seen] / size[seen]))

    def save_mat(self, path: Path | str) -> Path:
        """Write a MAT file (level 5) with A, B, C, D and what they are; Matlab: ``ss(A, B, C, D)``."""
        plant = self.plant
        content = {"A": self.a, "B": self.b, "C": self.c, "D": self.d, "inputs": list(INPUTS), "outputs": list(OUTPUTS)}
        about = {"model": plant.model, "tension_Pa": plant.tension, "speed_m_per_s": plant.speed}
        about |= {"delay": self.delay, "order": self.order, "per_metre": float(self.per_metre)}
        return write_with(Path(path), lambda p: savemat(p, content | about, appendmat=False))


def state_space(plant: LinearBelt, *, order: int = 3, delay: str = "pade", per_metre: bool = False) -> StateSpace:
    """``plant`` with every wrapped arc, exp(-p length), replaced by a rational function of ``order``.

    delay: "pade", of order (order, order), exact to p^(2 order) and of magnitude 1 at every wavenumber; or "chain",
    ``order`` lags of length/order each, which also damps. Raises InputError for an order outside 1..12 or an unknown
    delay.
    """
    whole("order", order, 1, 12)
    if delay not in ARC_MODELS:
        raise InputError("delay", delay, "", f"use one of {', '.join(ARC_MODELS)}")
    if delay == "chain":
        a = order * (np.eye(order, k=-1) - np.eye(order))
        b, c, d = order * np.eye(order, 1), np.eye(1, order, k=order - 1), np.zeros((1, 1))
    else:  # of exp(-p): bottom sum c_k p^k, top sum c_k (-p)^k,
        # c_k = (2n-k)! / (k! (n-k)!) (Baker & Graves-Morris 1996)
        powers = range(order, -1, -1)
        bottom = np.array([factorial(2 * order - k) / (factorial(k) * factorial(order - k)) for k in powers])
        a, b, c, d = signal.tf2ss(bottom * (-1.0) ** np.array(powers), bottom)
    lengths, n = plant.arcs.astype(float), len(plant.states)
    a_late, b_late = (block_diag(*(part / length for length in lengths)) for part in (a, b))
    c_late, d_late = (block_diag(*[part] * len(lengths)) for part in (c, d))

    a = np.block([[plant.now + plant.delayed @ d_late, plant.delayed @ c_late], [b_late, a_late]])
    b = np.concatenate([plant.drive, np.zeros((len(a_late), len(INPUTS)))])
    rows = []
    for state, after in plant.places:
        shown = np.eye(1, n, state)
        rows.append(np.hstack([shown @ d_late, shown @ c_late]) if after else np.hstack([shown, 0 * shown @ c_late]))
    scale = 1.0 if per_metre else plant.speed
    c, d = np.concatenate(rows), np.zeros((len(OUTPUTS), len(INPUTS)))
    how: dict[str, Any] = {"order": order, "delay": delay, "per_metre": per_metre}
    return StateSpace(plant=plant, a=a * scale, b=b * scale, c=c, d=d, **how)


def python_control(name: str, value: str) -> Any:
    """Python-control; raises InputError of this name and value where it is not installed."""
    try:
        import control
    except ImportError:
        raise InputError(name, value, "", "pip install belt-sim[control]") from None
    return control


def lying_at(space: StateSpace, y: float) -> np.ndarray:
    """State of a belt that has long lain ``y`` [m] off the middle."""
    states = len(space.plant.states)
    z = np.zeros(len(space.a))
    z[:states] = [y * name.startswith("y_") for name in space.plant.states]
    z[states:] = np.linalg.solve(space.a[states:, states:], -space.a[states:, :states] @ z[:states])
    return z


# plant.json: the plant as numbers, for programs without FMI or Matlab.


def plant_json(space: StateSpace, highest: float, provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Exact plant with its delays [per metre of travel, SI], and the state space with its error up to ``highest``."""
    plant = space.plant
    return {
        "schema": "belt-plant/1",
        "model": plant.model,
        "tension_n_per_mm2": plant.tension / N_PER_MM2,
        "inputs": list(INPUTS),
        "outputs": list(OUTPUTS),
        **({"beyond_validity": {x.id: x.load for x in plant.beyond}} if plant.beyond else {}),
        "delayed_plant": {
            "states": list(plant.states),
            "delay_m": plant.arcs.tolist(),
            **{name: getattr(plant, name).tolist() for name in ("now", "delayed", "drive", "constant")},
            "shown": [{"state": plant.states[k], "one_arc_late": late} for k, late in plant.places],
        },
        "state_space": {
            **{name: getattr(space, name).tolist() for name in ("a", "b", "c", "d")},
            "delay": space.delay,
            "order": space.order,
            "highest_rad_per_m": highest,
            "relative_error": space.error(highest),
        },
        "provenance": dict(provenance),
    }


# The laws of an analytic model and its effects, differentiated at a working point.


_CORRECTIONS = 3  # yaw and moment answer to each other where the drive gives way
#: Working points at which the plant is compared with the laws: travel from one belt length to two, positions up to a
#: belt width and angles up to _ANGLE [rad] away from the straight belt. Laws that are linear agree to _ROUNDING.
_POINTS, _ANGLE, _ROUNDING = 16, 0.01, 1e-9
_STRAIGHT = (np.zeros(4), np.zeros(4), np.zeros(2))


@in_float64
def linear_belt(case: Case, model: Composition, effects: Sequence[Hooks] = ()) -> LinearBelt:
    """The plant of ``case`` under ``model`` with ``effects``, around the straight belt.

    Raises CannotRepresent for an effect that the model cannot represent, or whose law is not linear with coefficients
    that stay the same along the travel.
    """
    model.admit(effects)
    for effect in effects:
        if overrides(effect, (*AFTER_ENGINE, "slide")):
            reason = "a linear plant gives where the belt is, not what a sensor shows of it, and it does not slip"
            raise CannotRepresent(f"effects = {effect.id}: {reason}; leave it out")
    driven = as_driven(case, effects)
    if effects and (cause := _nonlinearity(case, effects, model)):
        named = [e.id for e in effects if _nonlinearity(case, (e,), model)] or [e.id for e in effects]
        raise CannotRepresent(f"effects = {', '.join(named)}: {cause}; leave it out, or use simulate")
    limp = model.span(case).limp
    constant, now, delayed, drive = (np.asarray(x) for x in _derivatives(driven, tuple(effects), model=model))
    keep = np.array([0, 2]) if limp else np.arange(4)
    arcs = np.array([case.rig.wrap_tail, case.rig.wrap_tail, case.rig.wrap_head, case.rig.wrap_head], dtype=float)
    tail, head = (0, 1) if limp else (0, 2)
    forward = [(tail, False), (tail, True), (head, False), (head, True)]
    places = forward if float(case.settings.direction) > 0 else [forward[k] for k in (1, 0, 3, 2)]
    return LinearBelt(
        model=model.name,
        tension=float(driven.settings.tension),
        speed=float(case.settings.speed),
        states=tuple(STATES[k] for k in keep),
        now=now[np.ix_(keep, keep)],
        delayed=delayed[np.ix_(keep, keep)],
        drive=drive[keep],
        constant=constant[keep],
        arcs=arcs[keep],
        places=tuple(places),
        width=float(case.belt.width),
    )


def _nonlinearity(case: Case, effects: Sequence[Hooks], model: Composition) -> str | None:
    """Why no linear plant represents ``effects``; None if one does.

    The laws at random working points are compared with their tangent at the straight belt, and with themselves at
    other travels. What effects do to the yaw before it reaches the pulleys is no part of the plant.
    """
    steered = replace(case, settings=replace(case.settings, yaw=Schedule.step(_ANGLE), yaw_head=Schedule.step(_ANGLE)))
    driven = as_driven(steered, effects)
    but_tension = jax.tree.leaves(replace(driven.settings, tension=case.settings.tension))
    if not all(map(np.array_equal, but_tension, jax.tree.leaves(steered.settings))):
        return "it changes the yaw on its way to the pulleys, and a linear plant gets the yaw as commanded"
    random, width = np.random.default_rng(0), float(case.belt.width)
    sizes = np.array([width, _ANGLE, width, _ANGLE]), np.array([width, _ANGLE, width, _ANGLE]), np.full(2, _ANGLE)
    points = [random.uniform(-1.0, 1.0, (_POINTS, len(size))) * size for size in sizes]
    travel = random.uniform(1.0, 2.0, _POINTS) * float(case.rig.belt_length)
    linear, lasting = _linear_and_lasting(driven, tuple(effects), travel, *points, model=model)
    if not linear:
        return "its law is not linear in position, angle and yaw of the belt"
    return None if lasting else "its law changes along the travel, and the coefficients of a linear plant do not"


@partial(jit_float64, effort=LEAST_EFFORT, static_argnames=("model",))
def _derivatives(case: Case, effects: tuple[Hooks, ...], *, model: Composition):
    """dx/ds at x = 0 and its derivatives along x (4, 4), the delayed x (4, 4) and the yaws (4, 2)."""
    spans = Spans.from_case(case, (*model.built_in, *effects), model)
    rate = partial(_rate, spans, case.rig.belt_length)
    return rate(*_STRAIGHT), *jax.jacfwd(rate, argnums=(0, 1, 2))(*_STRAIGHT)


@partial(jit_float64, effort=LEAST_EFFORT, static_argnames=("model",))
def _linear_and_lasting(case: Case, effects: tuple[Hooks, ...], travel, *points, model: Composition):
    """Whether dx/ds at ``points``, shapes (k, 4), (k, 4), (k, 2), lies on its tangent at x = 0, and whether it is the
    same at ``travel`` [m], shape (k,)."""
    rate = partial(_rate, Spans.from_case(case, (*model.built_in, *effects), model))
    straight, tangent = jax.linearize(partial(rate, case.rig.belt_length), *_STRAIGHT)
    here = jax.vmap(partial(rate, case.rig.belt_length))(*points)
    rounding = _ROUNDING * jnp.max(jnp.abs(here - straight), axis=0)
    on_tangent = jnp.abs(straight + jax.vmap(tangent)(*points) - here) <= rounding
    return jnp.all(on_tangent), jnp.all(jnp.abs(jax.vmap(rate)(travel, *points) - here) <= rounding)


def _rate(spans: Spans, travel, x, late, yaws):
    """dx/ds of x = (y, alpha) at the tail's, then the head's run-up, when the wraps give ``late`` back."""
    commanded, y = Yaw(tail=yaws[0], head=yaws[1]), x[0::2]
    sticking = RunOff(
        y=late[0::2], alpha=late[1::2], moment=jnp.zeros(2)
    )  # as they come off the tail, then off the head

    off, yaw, alpha = sticking, commanded, x[1::2]
    for left in reversed(range(1 + _CORRECTIONS)):
        if spans.span.limp:  # a straight line from run-off to run-up
            alpha = (y + yaw.aside_runup - off.y[::-1] - yaw.aside_runoff) / spans.span.length - yaw.runup
        state = spans.state(travel, travel, y, alpha, off, yaw)
        if left:
            off = apply_hook(spans.effects, "wrap", sticking, state, spans.case)
            yaw = apply_hook(spans.effects, "yaw", commanded, state, spans.case)
    push = apply_hook(spans.effects, "runup", RunUp(drift=jnp.zeros(2), turn=jnp.zeros(2)), state, spans.case)
    moved = jnp.stack([-alpha + push.drift, -(state.kappa + push.turn)], axis=1)
    return moved.ravel()
