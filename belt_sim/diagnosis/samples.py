"""Readings of a campaign as arrays of one shape, and what sensors beside the points read."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.campaign import Campaign, Run, SignalSheet, case_of, leave_out_bad_readings
from belt_sim.campaign.quality import reading_at_yaw
from belt_sim.campaign.types import sensor_place
from belt_sim.case import Case
from belt_sim.curves import SensorPlace
from belt_sim.effects.base import Effect
from belt_sim.errors import InputError
from belt_sim.line.hooks import Hooks, apply_hook, overrides
from belt_sim.line.runup import Reading

# A campaign's samples as arrays of one shape: runs x signals x samples, thinned where they are needlessly dense.


MAX_SAMPLES = 256  # per run; denser records are averaged in bins, which loses nothing that a belt can do
YAW_PLACE_SIGMAS = 2.0  # sigmas of the place of the yaw, within which it may have jumped
JUMP = 0.1  # [m] about the start and the change of yaw in which a tilt is not judged: it jumps there, within one step


@dataclass(frozen=True, kw_only=True)
class Samples:
    """Measured values y, shape (R, S, n) [m or rad], nan where blank; travel, time (R, n) [m, s]; cases: R cases in
    one, batched in their settings only; per (R,): bin sizes that white noise was averaged over.
    """

    runs: tuple[Run, ...]
    signals: tuple[SignalSheet, ...]
    cases: Case
    travel: np.ndarray
    time: np.ndarray
    y: np.ndarray
    yaw_at: np.ndarray
    per_bin: np.ndarray

    @property
    def end(self) -> float:
        """Longest travel of any run [m]."""
        return float(np.nanmax(self.travel))

    @cached_property
    def widths(self) -> np.ndarray:
        """From one sample to the next in every run (R,) [m]."""
        steps = np.sort(np.abs(np.diff(self.travel, axis=1, prepend=self.travel[:, :1])), axis=1)
        run, count = np.arange(len(steps)), (steps > 0.0).sum(axis=1)  # of moves; what fills a short run up is zero
        first = steps.shape[1] - count
        middle = [steps[run, np.minimum(first + (count - k) // 2, steps.shape[1] - 1)] for k in (0, 1)]
        return np.where(count > 0, 0.5 * (middle[0] + middle[1]), 0.0)

    @cached_property
    def distinct(self) -> tuple[np.ndarray, np.ndarray]:
        """Runs by number, of which no two are set and read alike (k,), and which of these every run (R,) is alike: a
        model predicts a run and its repeat as one."""
        known = (*jax.tree.leaves(self.cases.settings), self.travel, self.time, self.yaw_at, self.per_bin)
        places = dict[bytes, int]()
        rows = np.column_stack(known)
        alike = np.array([places.setdefault(row.tobytes(), len(places)) for row in rows], dtype=int)
        return np.unique(alike, return_index=True)[1], alike

    def of_runs(self, which: np.ndarray) -> "Samples":
        """Those of some runs, by number."""
        each = {n: getattr(self, n)[which] for n in ("travel", "time", "y", "yaw_at", "per_bin")}
        settings = jax.tree.map(lambda x: x[which], self.cases.settings)
        runs = tuple(self.runs[k] for k in which)
        return replace(self, runs=runs, cases=replace(self.cases, settings=settings), **each)


def samples_of(campaign: Campaign, *, leave_out_bad: bool = True) -> Samples:
    """The signals of a campaign, without spikes and short dropouts unless that is not wanted (readings without noise
    look like these); raises InputError when it has none.
    """
    if leave_out_bad:
        campaign, _ = leave_out_bad_readings(campaign)
    runs = tuple(r for r in campaign.runs if len(r.travel))
    if not runs:
        raise InputError(
            "signals.csv", "no samples", "", "comparing curves needs travel and signals of at least one run"
        )
    names = [s.name for s in campaign.signals]
    thinned = []  # travel, time, values (S, n) and bin size of every run
    for run in runs:
        values = np.stack([run.signals.get(name, np.full(len(run.travel), np.nan)) for name in names])
        time = run.time if run.time is not None else run.travel / run.speed
        per_bin = max(1, -(-len(run.travel) // MAX_SAMPLES))
        whole, read = len(run.travel) // per_bin * per_bin, (run.travel, time, values)
        if per_bin > 1:
            read = tuple(x[..., :whole].reshape(*x.shape[:-1], -1, per_bin).mean(axis=-1) for x in read)
        thinned.append((*read, per_bin))
    n = max(len(t[0]) for t in thinned)
    shape = (len(runs), len(names), n)
    travel, time, y = np.zeros(shape[::2]), np.zeros(shape[::2]), np.full(shape, np.nan)
    lateral = [k for k, s in enumerate(campaign.signals) if s.kind == "lateral"]
    jump = [k for k, s in enumerate(campaign.signals) if s.kind == "tilt" or sensor_place(s.at)]
    for k, (s, t, values, per_bin) in enumerate(thinned):
        travel[k, : len(s)], travel[k, len(s) :] = s, s[-1]
        time[k, : len(s)], time[k, len(s) :] = t, t[-1]
        y[k, :, : len(s)] = values
        for j in lateral:
            y[k, j] -= reading_at_yaw(s - runs[k].yaw_at, values[j])
        # means of readings before and after the start, or a change of yaw, say nothing of either
        near = max(JUMP, 0.5 * float(np.median(np.diff(s))) if per_bin > 1 and len(s) > 1 else 0.0)
        at_yaw = np.abs(s - runs[k].yaw_at) <= max(near, YAW_PLACE_SIGMAS * runs[k].yaw_at_u)
        y[k, jump, : len(s)] = np.where((np.abs(s) <= near) | at_yaw, np.nan, y[k, jump, : len(s)])
    return Samples(
        runs=runs,
        signals=campaign.signals,
        cases=join_cases([case_of(campaign, run) for run in runs]),
        travel=travel,
        time=time,
        y=y,
        yaw_at=np.array([run.yaw_at for run in runs]),
        per_bin=np.array([b for *_, b in thinned], dtype=float),
    )


def join_cases(cases: list[Case]) -> Case:
    """One Case whose settings have a leading axis; rig and belt are those of the first."""
    settings = jax.tree.map(
        lambda *leaves: np.stack([np.asarray(x, dtype=float) for x in leaves]), *[c.settings for c in cases]
    )
    return Case(rig=cases[0].rig, belt=cases[0].belt, settings=settings)


def zero_is_read(samples: Samples, signal: SignalSheet) -> np.ndarray:
    """Whether zero of every run (R,) is read off its record, which begins before the yaw, or on a running belt."""
    running = np.array([run.runs_already for run in samples.runs])
    return (running | (samples.travel[:, 0] < samples.yaw_at)) & (signal.kind == "lateral")


# Readings of lateral sensors that stand at none of points 1-4: inside a span, or on a wrap.
#
# A belt that sticks passes a place on a wrap as it ran up, a while before; inside a span the law of the span says where
# it is (``march_open``). Instruments act there as at the nearest point of the tail or head pulley, and the belt's edge
# passes the place earlier or later than it passes that point.


SEEN_AT_REST = 0.5  # [m] of travel before the yaw, over which a sensor that moves with it is seen at rest
INSIDE = ("bend", "hold")  # hooks of effects that shape a span between its ends, which readings there would show


def places_of(samples: Samples) -> tuple[SensorPlace, ...]:
    """Places of the signals that stand at none of the points, each once."""
    found = (sensor_place(s.at) for s in samples.signals)
    return tuple(dict.fromkeys(place for place in found if place is not None))


def shapes_a_span(effect: Hooks | type[Hooks]) -> bool:
    """Whether an effect shapes a span between its ends, so that a sensor there would see what is not computed."""
    return bool(overrides(effect, INSIDE))


def travel_lead(place: SensorPlace, case: Case):
    """Travel [m] by which the belt passes the place before it passes the point that belongs to it; negative: after."""
    sign = 1.0 if place.where in ("upper_span", "head_wrap") else -1.0
    return sign * case.settings.direction * place.distance


def indicate_place(place: SensorPlace, y, case: Case, effects: Sequence[Effect], shown, seen, time):
    """What the instruments make of true positions y (n,) at a place."""
    four = jnp.broadcast_to(y, (4, len(shown)))
    earlier = seen + travel_lead(place, case)
    reading = Reading(travel=shown, sensor_travel=earlier, time=time, y=four, tilt=jnp.zeros((2, len(shown))))
    return apply_hook(effects, "sensor", reading, case).y[place.point]
