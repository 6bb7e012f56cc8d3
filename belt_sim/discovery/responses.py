"""Impulse responses of every run, the design matrices made of them, and the states that a law may read."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from itertools import product
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case
from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.forward import BATCH_ROWS, room_for
from belt_sim.diagnosis.noise import Metric
from belt_sim.diagnosis.samples import Samples
from belt_sim.diagnosis.workbench import Workbench
from belt_sim.effects.base import Effect, effect, parameter
from belt_sim.effects.law import (
    AT_PULLEYS,
    BY_THE_BELT,
    COURSES,
    PLACE_KINDS,
    PULLEYS,
    RELATIVE,
    ROLLS,
    SPAN_NAMES,
    Form,
    Place,
)
from belt_sim.jax_setup import PROGRAMS, StoredProgram, in_float64, program_key
from belt_sim.line.hooks import apply_hook, as_driven, overrides, true_travel
from belt_sim.line.march import march_open, plan_steps
from belt_sim.line.runup import add
from belt_sim.line.span import (
    StretchResponse,
    log_of_change,
    response_by_change,
    stretch_adds,
    stretch_ends,
    stretch_response,
)

# Impulse responses of every run: what a short pulse of input at every channel of the march does to it.
#
# A channel is an elementary entry of the march that takes an input u(travel). At fixed tension the march is linear in
# small inputs and does not change with travel, so one pulse a run and channel gives the whole operator.


#: every kind of input at the tail and at the head pulley
CHANNELS = tuple(f"{kind}_{pulley}" for kind in AT_PULLEYS for pulley in PULLEYS)

RUNS_AT_ONCE = 2  # runs that are marched together, each with every channel: more take memory and are no quicker
CELLS = 240  # of the input along the longest run, at most
SHORTEST = 3.0  # cells in a wave
SAMPLED = 2.0  # gaps between readings in a wave, at least (Nyquist)
OUTSIDE_MARCH = {"encoder", "sensor_travel", "sensor", "scene"}  # hooks that a march does not call
Y, MOMENT, TILT_ROW = 0, 8, 10  # first rows of what is kept, see ImpulseResponses
_SCALES = {"rad": 1e-4, "1/m": 1e-5, "m": 1e-4}
_ALONG: Any = {"plausible": (0.0, 1e3), "scale": 1.0, "null": 1.0, "modifier": True}


@effect
class Pulse(Effect):
    """A triangular pulse of input at every channel: yaw of a pulley's surface, turn and drift at the run-ups, shift and
    twist over the wrapped arcs."""

    law = "run-up"
    reference = "none: an input to take impulse responses with"
    alike = {
        channel: parameter(unit, "height", plausible=(-1.0, 1.0), scale=_SCALES[unit])
        for channel in CHANNELS
        for unit in [PLACE_KINDS[channel.partition("_")[0]].unit]
    }
    middle: float = parameter("m", "travel at its height", **_ALONG)
    half: float = parameter("m", "travel from there to its foot", **_ALONG)

    def _at(self, state, name):
        height = jnp.stack([getattr(self, f"{name}_{pulley}") for pulley in PULLEYS])
        return height * jnp.maximum(0.0, 1.0 - jnp.abs(state.travel - self.middle) / self.half)

    def yaw(self, yaw, state, case):
        tail, head = self._at(state, "yaw")
        return add(yaw, tail=tail, head=head)

    def runup(self, runup, state, case):
        return add(runup, turn=self._at(state, "turn"), drift=self._at(state, "drift"))

    def wrap(self, runoff, state, case):
        return add(runoff, y=self._at(state, "shift"), alpha=self._at(state, "twist"))


@dataclass(frozen=True, kw_only=True)
class ImpulseResponses:
    """What the march of every run does with an input.

    grid (J,): travels [m] at which an input is given, linear in between; fine (n,): travels of the records;
    curves (R, 12, n): y and angle at run-up tail, run-up head, run-off tail, run-off head, then moment and tilt of the
    span up the tail and up the head; pulses (R, channels, 12, n): what a pulse of height 1 at grid[1] adds, in single
    precision.
    """

    grid: np.ndarray
    fine: np.ndarray
    curves: np.ndarray
    pulses: np.ndarray

    def cell_responses(self, rows: np.ndarray, where: np.ndarray) -> np.ndarray:
        """Responses to inputs in every cell: rows (..., n) of pulses -> (..., len(where), J) at travels ``where``."""
        step = self.grid[1] - self.grid[0]
        back = where[:, None] - self.grid[None, :] + step  # travel since the pulse's foot
        # rows (..., n), zero before their start, at ``where`` (a, J); the first cell is half a pulse
        place = np.clip(back / (self.fine[1] - self.fine[0]), 0.0, rows.shape[-1] - 1.001)
        low = place.astype(int)
        part = (place - low).astype(rows.dtype)
        found = rows[..., low] * (1.0 - part) + rows[..., low + 1] * part
        found[..., 0] *= 0.5
        return found


def impulse_responses(bench: Workbench, fit: Fit, among: Sequence[str] = ()) -> ImpulseResponses:
    """Responses with the effects of a fit at work; among: ids of all that are at work in any of several fits, which
    then share compiled code."""
    forward = bench.forward
    samples, effects = forward.samples, forward.effects_at(fit.vector, (*fit.ids, *among))
    true_end = np.max(in_float64(true_travel)(effects, samples.cases, samples.end))  # whatever the encoder says
    step = forward.step * max(2, int(np.ceil(max(float(true_end), samples.end) / CELLS / forward.step)))
    cells = int(np.ceil(max(float(true_end), samples.end) / step)) + 1
    travel = step * (cells + 1)
    steps, _, slots = plan_steps(samples.cases, travel=travel, step=forward.step, keep=forward.step)
    acting = tuple(e for e in effects if overrides(e) - OUTSIDE_MARCH)
    march, cases = (
        _compile_march(forward.model, tuple(map(type, acting)), *room_for(steps, slots)),
        _padded(samples, RUNS_AT_ONCE),
    )
    found = []
    for low in range(0, len(cases.settings.tension), RUNS_AT_ONCE):
        settings = jax.tree.map(lambda x, low=low: x[low : low + RUNS_AT_ONCE], cases.settings)
        made = march(acting, replace(cases, settings=settings), step, travel / steps, steps)
        curves, pulses = (np.asarray(x)[..., : steps + 1] for x in made)
        found.append((curves, pulses.astype(np.float32)))
    curves, pulses = (np.concatenate(rows)[: len(samples.runs)] for rows in zip(*found, strict=True))
    fine = np.linspace(0.0, travel, steps + 1)
    return ImpulseResponses(grid=step * np.arange(cells), fine=fine, curves=curves, pulses=pulses)


def _padded(samples: Samples, at_once: int) -> Case:
    """The cases of all runs, the last one again until they fill rows of so many."""
    rows = np.arange(-(-len(samples.runs) // at_once) * at_once).clip(max=len(samples.runs) - 1)
    return replace(samples.cases, settings=jax.tree.map(lambda x: np.asarray(x)[rows], samples.cases.settings))


@lru_cache(PROGRAMS)
def _compile_march(model, classes, room: int, history: int):
    march = partial(march_open, model=model, room=room, slots=history, only=("y", "angle", "moment", "tilt"))

    def one(effects: tuple[Effect, ...], case: Case, step, spacing, steps):
        """Rows (12, n) of one run, and what a pulse at each channel adds (channels, 12, n)."""

        def rows(heights):
            pulse = Pulse(**dict(zip(CHANNELS, heights, strict=True)), middle=step, half=step)
            curves: Any = march(case, (*effects, pulse), spacing, steps)
            forward = case.settings.direction > 0
            # from points 1-4 back to run-up tail, run-up head, run-off tail, run-off head
            places = jnp.where(forward, jnp.array([0, 2, 1, 3]), jnp.array([1, 3, 0, 2]))
            spans = jnp.where(forward, jnp.array([0, 1]), jnp.array([1, 0]))
            return jnp.concatenate([curves.y[places], curves.angle[places], curves.moment[spans], curves.tilt[spans]])

        none = jnp.zeros(len(CHANNELS))
        along = jax.vmap(lambda d: jax.jvp(rows, (none,), (d,)))(jnp.eye(len(CHANNELS)))
        return along[0][0], along[1]

    axes = (None, Case(rig=None, belt=None, settings=0), None, None, None)  # type: ignore[arg-type]
    key = program_key("impulse responses", model, classes, room, history)
    return StoredProgram(jax.vmap(one, in_axes=axes), key, brief=True)


@dataclass(frozen=True)
class SpanChange:
    """What a relative change of tension or of a stiffness adds to a span: coefficients (R, 7, 2, 3) of powers 1 to 7 of
    log(1 + change), of the curvature at the run-up and of the roll at mid-span, per unit of ``span_ends``; stretch
    (R, ...): what the same does on a stretch of the belt; None of tension."""

    coefficients: np.ndarray
    stretch: StretchResponse | None

    def per_end(self, change: np.ndarray, row: int) -> np.ndarray:
        """What a change (R, F, J) adds, however large, per unit of each of the three ends, (3, R, F, J); row: 0
        curvature, 1 roll."""
        x = log_of_change(change, np)
        found = np.zeros((self.coefficients.shape[-1], *x.shape))
        for c in self.coefficients[:, ::-1, row].swapaxes(0, 1):
            found = (found + c.T[:, :, None, None]) * x
        return found


def span_changes(bench: Workbench, fit: Fit, among: Sequence[str] = ()) -> dict[str, SpanChange]:
    """What relative changes of tension, bending and torsion do, with the effects of a fit at work; among: as in
    ``impulse_responses``."""
    forward = bench.forward
    there = forward.effects_at(fit.vector, (*fit.ids, *among))
    effects = tuple(e for e in there if overrides(e) & {"settings", "span"})
    made = _compile_changes(forward.model, tuple(map(type, effects)))(effects, _padded(forward.samples, BATCH_ROWS))
    made = jax.tree.map(lambda x: np.asarray(x)[: len(bench.samples.runs)], made)
    return {k: SpanChange(rows, StretchResponse(**s) if s else None) for k, (rows, s) in made.items()}


@lru_cache(PROGRAMS)
def _compile_changes(model, classes):
    def one(effects, case):
        case = as_driven(case, effects)
        span = apply_hook((*model.built_in, *effects), "span", model.span(case), case)
        at, ends = jnp.array([0, 2]), slice(0, 3)  # run-up and middle; the ends of a belt do not roll
        return {
            k: (
                response_by_change(span, case, k)[:, at, ends],
                vars(stretch_response(span, k)) if k in BY_THE_BELT else {},
            )
            for k in dict.fromkeys(PLACE_KINDS[kind].relative for kind in RELATIVE)
        }

    many = jax.vmap(one, in_axes=(None, Case(rig=None, belt=None, settings=0)))  # type: ignore[arg-type]
    return StoredProgram(many, program_key("span changes", model, classes), brief=True)


# Design matrices: what an input at a place does to the whitened readings; and what is taken out beside it.
#
# Runs are whitened one by one, so that columns of single runs can be weighted and summed at will. Parameters that runs
# share (the belt's stiffness, and the effects that are chosen already) are taken out by projection.


HIDDEN = 2e-3  # share of a column that must be left beside what is chosen
CHOSEN = 1e-8  # prior precision of a chosen effect's parameters, in whitened units


def posterior_modes(gram: np.ndarray, prior: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues (..., c) of the posterior precision of parameters in units of their ``prior`` precision (c,), and W
    (..., c, c) with the covariance W diag(1 / eigenvalues) W^T.

    gram (..., c, c): the posterior precision, which is no less than the prior one: where columns nearly are sums of
    others rounding may say so, and an eigenvalue below 1, or below 0, would make any evidence of it.
    """
    scale = 1.0 / np.sqrt(prior)
    values, vectors = np.linalg.eigh(gram * scale[:, None] * scale)
    return np.maximum(values, 1.0), scale[:, None] * vectors


@dataclass(frozen=True)
class ResidualProjector:
    """Inner products beside the parameters that runs share.

    metric: of single runs; residual (R, m): whitened; shared (c, R, m): whitened columns of the shared parameters;
    prior (c,): their prior precision.
    """

    metric: Metric
    residual: np.ndarray
    shared: np.ndarray
    prior: np.ndarray

    @cached_property
    def gram(self) -> np.ndarray:
        """Posterior precision (c, c) of the shared parameters."""
        return np.einsum("crm,drm->cd", self.shared, self.shared) + np.diag(self.prior)

    @cached_property
    def inverse(self) -> np.ndarray:
        """Posterior covariance (c, c) of the shared parameters."""
        precision, modes = posterior_modes(self.gram, self.prior)
        return (modes / precision) @ modes.T

    def whiten(self, shapes: np.ndarray) -> np.ndarray:
        """Shapes or readings (k, R, S, n) -> (k, R, m)."""
        return self.metric.whiten(shapes).reshape(len(shapes), len(self.residual), -1)

    @cached_property
    def shared_residual(self) -> np.ndarray:
        """Products (c,) of the shared columns with the residual."""
        return np.einsum("crm,rm->c", self.shared, self.residual)

    @cached_property
    def shared_evidence(self) -> float:
        """Twice the log evidence of the shared parameters, beside what does not depend on them."""
        explained = self.shared_residual @ self.inverse @ self.shared_residual
        return float(explained - np.log(posterior_modes(self.gram, self.prior)[0]).sum())

    def chi2(self, residual: np.ndarray | None = None) -> float:
        """chi2 of the residual with the shared parameters fitted."""
        residual = self.residual if residual is None else residual
        along = np.einsum("crm,rm->c", self.shared, residual)
        return float(np.sum(residual**2) - along @ self.inverse @ along)

    def gram_of(self, rows: np.ndarray) -> np.ndarray:
        """Gram matrix (k, k) of whitened rows (k, R, m) with the shared columns taken out."""
        onto = (rows.swapaxes(0, 1) @ self.shared.transpose(1, 2, 0)).swapaxes(0, 1).sum(axis=1)
        return np.einsum("krm,lrm->kl", rows, rows) - onto @ self.inverse @ onto.T

    def fit_sizes(self, columns: np.ndarray) -> tuple[float, np.ndarray]:
        """chi2 explained and sizes (k,) of whitened columns (k, R, m)."""
        flat = columns.reshape(len(columns), -1)
        onto, own = flat @ self.shared.reshape(len(self.shared), -1).T, flat @ flat.T
        left = own - onto @ self.inverse @ onto.T
        pull = flat @ self.residual.ravel() - onto @ self.inverse @ self.shared_residual
        scale = 1.0 / np.sqrt(np.maximum(np.diag(own), 1e-300))
        if not np.isfinite(left).all() or np.any(np.diag(left) * scale**2 < HIDDEN):
            return 0.0, np.zeros(len(pull))
        inverse = np.linalg.pinv(left * np.outer(scale, scale), rcond=1e-6, hermitian=True)
        sizes = scale * (inverse @ (pull * scale))
        return float(pull @ sizes), sizes


def single_precision(x: np.ndarray) -> np.ndarray:
    """Numbers in single precision; those too small for all its digits are 0: a few of them, as there are in what fades
    away, make a matrix product take seven times as long.
    """
    found = x.astype(np.float32)
    found[np.abs(found) < np.finfo(np.float32).tiny] = 0.0
    return found


CELLS_AT_ONCE = 64  # cells whose responses are whitened together: more take memory


def design_matrix(
    bench: Workbench, projector: ResidualProjector, responses: ImpulseResponses, shown: np.ndarray, name: str
) -> np.ndarray:
    """Whitened responses (J, R, m) to an input of height 1 in each cell of the grid: at a channel, at a lateral sensor
    by the name of its signal, or in a roll that tilt sensors show; shown (R, n + 1): true travels of all readings, and
    of the yaw."""
    samples, grid = bench.samples, responses.grid
    found = np.zeros((len(grid), *samples.y.shape), np.float32)
    for (r, run), (s, signal) in product(enumerate(samples.runs), enumerate(samples.signals)):
        row = curve_row(signal.at, run.direction)
        if row is None:
            continue  # the search for a law does not read it
        if name in CHANNELS:
            read = responses.cell_responses(responses.pulses[r, CHANNELS.index(name), row], shown[r])
        elif signal.name == name or (name in ROLLS and row == TILT_ROW + ROLLS.index(name)):  # itself
            read = np.maximum(0.0, 1.0 - np.abs(shown[r][:, None] - grid[None]) / (grid[1] - grid[0]))
        else:
            continue
        found[:, r, s] = (read[:-1] - (read[-1] if signal.kind == "lateral" else 0.0)).T
    rows = np.empty((len(samples.runs), len(grid), found[0, 0].size), np.float32)  # of a run side by side in memory
    for some in (slice(k, k + CELLS_AT_ONCE) for k in range(0, len(grid), CELLS_AT_ONCE)):
        rows[:, some] = single_precision(projector.whiten(found[some])).swapaxes(0, 1)
    return rows.swapaxes(0, 1)


def is_shown(samples: Samples, responses: ImpulseResponses, name: str) -> bool:
    """Whether readings show an input at a channel, or at a sensor."""
    there = np.isfinite(samples.y).any(axis=2)
    rows = [[curve_row(s.at, run.direction) for s in samples.signals] for run in samples.runs]
    at = [(r, row) for r, s in np.argwhere(there) if (row := rows[r][s]) is not None]
    if name in CHANNELS:
        return any(np.any(responses.pulses[r, CHANNELS.index(name), row]) for r, row in at)
    read = there.any(axis=0) & [row is not None for row in rows[0]]
    return name in {s.name for s, seen in zip(samples.signals, read, strict=True) if seen and s.kind == "lateral"}


def curve_row(at: str, direction: float) -> int | None:
    """Row of ImpulseResponses.curves that a signal at a place shows; None of a place that no row is of."""
    if at in ("upper_mid_span", "lower_mid_span"):
        return TILT_ROW + (0 if (at == "upper_mid_span") == (direction > 0) else 1)
    points = [f"point_{k}" for k in ((1, 3, 2, 4) if direction > 0 else (2, 4, 1, 3))]
    return Y + points.index(at) if at in points else None


def span_ends(rows: np.ndarray) -> np.ndarray:
    """Boundary values (R, 6, J) of the spans that run up the tail and the head pulley, by ``ImpulseResponses.curves``
    (R, 8 or more, J): y at run-up less y at run-off, angle at run-off and at run-up."""
    y, angle = rows[:, :4], rows[:, 4:8]
    found = [(y[:, up] - y[:, off], angle[:, off], angle[:, up]) for up, off in ((0, 3), (1, 2))]
    return np.stack([*found[0], *found[1]], axis=1)


# States: what a law may read along each run, on the grid of an unknown's input.


LITTLE = 1e-6  # size of a law of a stretch, to which its work goes with its size


@dataclass(frozen=True, kw_only=True)
class States:
    """Along every run, on the grid s (J,) [m].

    Per pulley (R, 2, J): y [m], alpha [rad], kappa [1/m] where the belt runs up, kappa_mean [1/m]: mean of the span
    that does; beta (R, J) [rad]: commanded yaw; yaw_set (R, J): 1 once it is set; since (R, J): travel since then; per
    signal (R, S, J): reading [m] and its rate reading_rate [m/s]; ends (R, 6, J): of the spans, as ``span_ends`` has
    them; tension [Pa], speed [m/s] (R,); changes: kind of relative change of the spans -> how it acts; forward (R,):
    whether the upper span runs up the tail pulley; belt_part (R, 2, J): the part of the belt that runs up, in belt
    lengths from the one that is at the tail pulley when a forward run starts; head_delay, belt_length: travel [m] by
    which it reaches the head pulley after the tail pulley, and the same pulley again; wraps: travel [m] by which it
    leaves the tail and the head pulley after it has run up; gap: largest travel [m] between
    readings of the run that has them closest.
    """

    s: np.ndarray
    y: np.ndarray
    alpha: np.ndarray
    kappa: np.ndarray
    kappa_mean: np.ndarray
    beta: np.ndarray
    yaw_set: np.ndarray
    since: np.ndarray
    reading: np.ndarray
    reading_rate: np.ndarray
    tension: np.ndarray
    speed: np.ndarray
    ends: np.ndarray
    changes: Mapping[str, SpanChange]
    forward: np.ndarray
    belt_part: np.ndarray
    head_delay: float
    belt_length: float
    wraps: tuple[float, float]
    signals: tuple[str, ...]
    gap: float = 0.0

    @property
    def shortest_wave(self) -> float:
        """Wavelength [m] below which no wave is searched: three cells, or twice the distance of readings (aliasing)."""
        return max(SHORTEST * float(self.s[1] - self.s[0]), SAMPLED * self.gap)

    @cached_property
    def at_landing(self) -> "States":
        """What a law over a wrap reads: what the belt that leaves it had when it ran up, for that belt it happened
        to."""
        landed: dict[str, Any] = {
            n: np.stack([self.delay(getattr(self, n)[:, k], k) for k in (0, 1)], 1) for n in ("y", "alpha", "kappa")
        }
        return replace(self, **landed)

    def delay(self, x: np.ndarray, pulley: int) -> np.ndarray:
        """What x (..., J) was one wrap of a pulley before; what lay there at the start lay straight."""
        before = self.s - self.wraps[pulley]
        return np.where(before < 0.0, 0.0, self._interpolate(x, before))

    def _interpolate(self, x: np.ndarray, where: np.ndarray) -> np.ndarray:
        """x (..., J) at travels ``where`` (J,)."""
        cells = where / (self.s[1] - self.s[0])
        low = np.clip(cells.astype(int), 0, len(self.s) - 2)
        return x[..., low] * (1.0 - cells + low) + x[..., low + 1] * (cells - low)

    def channel_gain(self, place: Place, channel: str, pulley: int | None) -> np.ndarray | float:
        """What an input of 1 at a place is to one of its channels: 1, (R, J), or (R, 1)."""
        if place.relative:
            first = 3 * int(pulley or 0)
            slope = self.changes[place.relative].coefficients[:, 0, int(channel in ROLLS)]  # of a small change
            return np.einsum("ri,rij->rj", slope, self.ends[:, first : first + 3]) * self.span_share(place, pulley)
        if place.where in SPAN_NAMES:
            return self.span_share(place, pulley)
        if place.name == "travel":  # a belt that is further than the encoder says shows what comes later
            return np.gradient(self.reading[:, self.signals.index(channel)], self.s[1] - self.s[0], axis=-1)
        return 1.0

    def stretch_per_end(
        self, place: Place, channel: str, pulley: int, change: np.ndarray, at: np.ndarray, wide: np.ndarray
    ) -> np.ndarray:
        """What stretches of another stiffness add to a channel per unit of the ends of the span, (3, R, F, J).

        change (R, F, 1), at, wide (F, 1): the numbers of laws of a stretch (``belt_sim.effects.law``).
        """
        response, found = self.changes[place.relative].stretch, []
        for run, part in enumerate(self.belt_part[:, pulley]):
            own = jax.tree.map(lambda x, run=run: x[run], response)
            behind = (at - part) * (1.0 if self.forward[run] else -1.0)
            lies = stretch_ends(own.x[-1], self.belt_length, behind, wide, np)
            added, more = stretch_adds(own, -change[run] * own.x[-1], wide * self.belt_length, lies, np)
            if channel in ROLLS or own.ends is None:
                found.append(added[2 if channel in ROLLS else 0])
            else:  # and where it runs up itself
                more = more * COURSES["belt_section"][1](part, at, wide, np)
                found.append(added[0] + more * (added[0] + own.ends[0][:, None, None]))
        return np.stack(found, axis=1)

    def stretch_input(self, place: Place, channel: str, pulley: int, forms: Sequence[Form]) -> np.ndarray:
        """What laws of a stretch, of size 1, add to a channel, (R, F, J), as far as that goes with the size."""
        at, wide = (np.array([getattr(f, n) for f in forms])[:, None] for n in ("at", "wide"))
        little = np.full((len(self.tension), len(forms), 1), LITTLE)
        first = 3 * pulley
        added = self.stretch_per_end(place, channel, pulley, little, at, wide) / LITTLE
        return np.einsum("irfj,rij->rfj", added, self.ends[:, first : first + 3])

    def span_share(self, place: Place, pulley: int | None) -> np.ndarray | float:
        """Of what acts on one span: 1 in the runs (R, 1) in which that span runs up a pulley; else 1."""
        if place.where not in SPAN_NAMES or pulley is None:
            return 1.0
        return (self.forward[:, None] == (SPAN_NAMES[pulley] == place.where)).astype(float)

    def channel_input(self, place: Place, u: np.ndarray, channel: str, pulley: int | None) -> np.ndarray:
        """What an input u (..., R, J) at a place is at one of its channels; of what the belt carries u is that at the
        tail pulley, and the head pulley meets it later."""
        if not place.is_carried or pulley != 1:
            return u * self.channel_gain(place, channel, pulley)
        before = self.s - self.head_delay  # it was there, or will be
        return self._interpolate(u, np.where(before < 0.0, before + self.belt_length, before))


def states_of(bench: Workbench, responses: ImpulseResponses, changes: Mapping[str, SpanChange]) -> States:
    """States of the model."""
    runs, grid = bench.samples.runs, responses.grid
    rows = np.stack([[np.interp(grid, responses.fine, row) for row in kept[: MOMENT + 2]] for kept in responses.curves])
    y, ends, spacing = rows[:, :4], span_ends(rows), grid[1] - grid[0]
    bending = float(bench.samples.cases.belt.bending_stiffness)
    settings = bench.forward.samples.cases.settings  # as the runs most likely had them
    yaw, head = np.asarray(settings.yaw.last()), np.asarray(settings.yaw_head.last())
    since = grid[None] - np.array([[r.yaw_at] for r in runs])
    at = [[curve_row(s.at, r.direction) for s in bench.samples.signals] for r in runs]

    zeros = [[np.interp(run.yaw_at, grid, row) for row in own[:4]] for run, own in zip(runs, rows, strict=True)]
    still = 0.0 * grid
    reading = np.stack(
        [[still if k is None or k >= 4 else rows[r, k] - zeros[r][k] for k in own] for r, own in enumerate(at)]
    )
    speed, forward = np.array([r.speed for r in runs]), np.array([r.direction > 0 for r in runs])
    rig = bench.samples.cases.rig
    # a forward run brings the belt from the tail pulley over the lower span to the head pulley, one in reverse over the
    # upper
    span, wrap = float(rig.span_length), float(rig.wrap_tail)
    ahead, back = grid - np.array([[0.0], [span + wrap]]), np.array([[-wrap], [span]]) - grid
    samples = bench.samples
    used = [s[np.isfinite(y).any(axis=0)] for s, y in zip(samples.travel, samples.y, strict=True)]  # places of readings
    return States(
        s=grid,
        y=y[:, :2],
        alpha=-np.gradient(y[:, :2], spacing, axis=-1),
        kappa=rows[:, MOMENT : MOMENT + 2] / bending,
        kappa_mean=(ends[:, [2, 5]] - ends[:, [1, 4]]) / float(rig.span_length),
        beta=np.where(since >= 0.0, (yaw + head)[:, None], 0.0),
        yaw_set=np.where(since >= 0.0, 1.0, 0.0),
        since=np.maximum(since, 0.0),
        reading=reading,
        reading_rate=np.gradient(reading, spacing, axis=-1) * speed[:, None, None],
        tension=np.asarray(settings.tension),
        speed=speed,
        ends=ends,
        changes=changes,
        forward=forward,
        belt_part=np.where(forward[:, None, None], ahead, back) / float(rig.belt_length),
        head_delay=float(rig.span_length + rig.wrap_tail),
        belt_length=float(rig.belt_length),
        wraps=(wrap, float(rig.wrap_head)),
        signals=tuple(s.name for s in bench.samples.signals),
        gap=min((float(np.max(np.diff(s))) for s in used if len(s) > 1), default=0.0),
    )
