"""States: what a law may read along each run, on the grid of an unknown's input."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from operator import itemgetter

import jax
import numpy as np

from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.discovery.design import curve_row, span_ends
from belt_sim.discovery.impulse_responses import MOMENT, ImpulseResponses, SpanChange
from belt_sim.effects.law import COURSES, ROLLS, SPANS, TRAVEL, WRAPPED, Form, Place
from belt_sim.line.influence import stretch_adds, stretch_ends

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
    leaves the tail and the head pulley after it has run up.
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

    def variables_at(self, place: Place) -> "States":
        """What a law at a place reads: where the belt runs up, now; over a wrap, what the belt that leaves it had when
        it ran up, for that belt it happened to."""
        return self.landing_states if place.kind in WRAPPED else self

    @cached_property
    def landing_states(self) -> "States":
        """The same with y, alpha and kappa as what leaves a pulley had them when it ran up."""

        def at_run_up(x: np.ndarray) -> np.ndarray:
            return np.stack([self.delay(x[:, k], k) for k in (0, 1)], axis=1)

        return replace(self, y=at_run_up(self.y), alpha=at_run_up(self.alpha), kappa=at_run_up(self.kappa))

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
            ends = self.ends[:, first : first + 3]
            return self.changes[place.relative].per_change(ends, int(channel in ROLLS)) * self.span_share(place, pulley)
        if place.where in SPANS:
            return self.span_share(place, pulley)
        if place.name == TRAVEL:  # a belt that is further than the encoder says shows what comes later
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
            own = jax.tree.map(itemgetter(run), response)
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
        if place.where not in SPANS or pulley is None:
            return 1.0
        return (self.forward[:, None] == (SPANS[pulley] == place.where)).astype(float)

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

    def reading_at(r: int, k: int) -> np.ndarray:
        return rows[r, k] - np.interp(runs[r].yaw_at, grid, rows[r, k]) if k < 4 else 0.0 * grid

    reading = np.stack([[reading_at(r, k) for k in ks] for r, ks in enumerate(at)])
    speed, forward = np.array([r.speed for r in runs]), np.array([r.direction > 0 for r in runs])
    rig = bench.samples.cases.rig
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
        belt_part=belt_part_at(rig, forward, grid),
        head_delay=float(rig.span_length + rig.wrap_tail),
        belt_length=float(rig.belt_length),
        wraps=(float(rig.wrap_tail), float(rig.wrap_head)),
        signals=tuple(s.name for s in bench.samples.signals),
    )


def belt_part_at(rig, forward: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Which part of the belt runs up tail and head pulley along s, (R, 2, J), in belt lengths (see States).

    A forward run brings it from the tail pulley over the lower span to the head pulley, one in reverse over the upper.
    """
    span, wrap = float(rig.span_length), float(rig.wrap_tail)
    ahead, back = s - np.array([[0.0], [span + wrap]]), np.array([[-wrap], [span]]) - s
    return np.where(forward[:, None, None], ahead, back) / float(rig.belt_length)
