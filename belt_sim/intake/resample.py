"""Dense records on one grid of travel, averaged over its step: nothing that a belt does is lost; repeats compare."""

import math
from dataclasses import dataclass

import numpy as np

#: Samples a run that are aimed at, and the fewest that a step may leave.
AIMED, LEFT = 600, 60
#: Travel from time and speed is a little uneven; a step this share below twice the spacing still has two rows.
UNEVEN = 0.95
#: Decimals of a reading in SI that are kept.
DECIMALS = 10
#: Repeats are cut to the shortest of them when they differ by less than this share.
ALIKE = 0.1


@dataclass(frozen=True, kw_only=True)
class Track:
    """One run on its travel [m], shape (n,): time [s] or None, signals name -> (n,), nan where blank."""

    name: str
    travel: np.ndarray
    time: np.ndarray | None
    signals: dict[str, np.ndarray]

    def cut(self, count: int) -> "Track":
        time = None if self.time is None else self.time[:count]
        return Track(
            name=self.name,
            travel=self.travel[:count],
            time=time,
            signals={n: y[:count] for n, y in self.signals.items()},
        )


def step_for(tracks: list[Track]) -> float:
    """A step [m] that keeps some hundred samples a run; 0 where records are so sparse that they stay as they are."""
    spacing = [float(np.median(np.diff(np.unique(t.travel)))) for t in tracks if len(np.unique(t.travel)) > 2]
    if not spacing or _on_one_grid(tracks):
        return 0.0
    longest = max(float(t.travel[-1]) for t in tracks)
    step = _nice(max(longest / AIMED, UNEVEN * 2.0 * max(spacing)))
    return step if step <= longest / LEFT else 0.0


def _on_one_grid(tracks: list[Track]) -> bool:
    """Whether all records stand at the same travels already, and not at too many of them."""
    first = max(tracks, key=lambda t: len(t.travel)).travel
    if len(first) > 4 * AIMED:
        return False
    return all(
        len(np.unique(t.travel)) == len(t.travel) and np.allclose(t.travel, first[: len(t.travel)], atol=1e-6)
        for t in tracks
    )


def _nice(step: float) -> float:
    """The next of 1, 2, 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(step))
    return float(next(f"{f * power:.6g}" for f in (1.0, 2.0, 5.0, 10.0) if f * power >= step * (1.0 - 1e-9)))


def resampled(track: Track, step: float) -> Track:
    """Averages over bins of ``step`` [m] about its multiples; with step 0 only rows of one travel fall together."""
    if step > 0.0:
        bins = np.rint(track.travel / step).astype(int)
    else:
        bins = np.unique(track.travel, return_inverse=True)[1].reshape(-1)
    places, where = np.unique(bins, return_inverse=True)
    count = len(places)
    travel = places * step if step > 0.0 else _mean(track.travel, where, count)
    keep = np.ones(count, dtype=bool)
    if step > 0.0 and count > 2 and track.travel[-1] < travel[-1] - 0.25 * step:
        keep[-1] = False  # a bin that is hardly begun
    return Track(
        name=track.name,
        travel=np.round(travel, 9)[keep],
        time=None if track.time is None else _mean(track.time, where, count)[keep],
        signals={n: _mean(y, where, count)[keep] for n, y in track.signals.items()},
    )


def _mean(values: np.ndarray, where: np.ndarray, count: int) -> np.ndarray:
    """Mean of the finite values of each bin, shape (count,)."""
    there = np.isfinite(values)
    number = np.bincount(where[there], minlength=count)
    total = np.bincount(where[there], weights=values[there], minlength=count)
    return np.where(number > 0, total / np.maximum(number, 1), np.nan)


def merged(tracks: list[Track]) -> Track:
    """Records of one run from several files or curves, on all their travels."""
    if len(tracks) == 1:
        return tracks[0]
    travel = np.unique(np.concatenate([t.travel for t in tracks]))
    names = dict.fromkeys(n for t in tracks for n in t.signals)
    signals = {n: np.full(len(travel), np.nan) for n in names}
    timed = all(t.time is not None for t in tracks)
    time = np.full(len(travel), np.nan) if timed else None
    for track in tracks:
        at = np.searchsorted(travel, track.travel)
        if time is not None and track.time is not None:
            time[at] = track.time
        for name, y in track.signals.items():
            signals[name][at] = np.where(np.isfinite(y), y, signals[name][at])
    return Track(name=tracks[0].name, travel=travel, time=time, signals=signals)


def cut_alike(groups: list[list[int]], tracks: list[Track]) -> list[Track]:
    """Repeats (groups of positions) cut to the shortest, where they differ by little, so that they compare."""
    out = list(tracks)
    for group in groups:
        counts = [len(tracks[k].travel) for k in group]
        if max(counts) - min(counts) <= ALIKE * max(counts):
            for k in group:
                out[k] = tracks[k].cut(min(counts))
    return out


def counted_from_yaw(tracks: list[Track], yaw_at: list[float]) -> tuple[list[Track], list[str]]:
    """Readings counted from where each point was when the yaw was applied [m], and what was taken off, in words."""
    out: list[Track] = []
    off: dict[str, list[float]] = {}
    for track, at in zip(tracks, yaw_at, strict=True):
        starts = {name: at_yaw(track.travel, y, at) for name, y in track.signals.items()}
        signals = {name: np.round(y - starts[name], DECIMALS) for name, y in track.signals.items()}
        out.append(Track(name=track.name, travel=track.travel, time=track.time, signals=signals))
        for name, start in starts.items():
            off.setdefault(name, []).append(1e3 * start)
    told = [f"{name} {min(x):.4g} to {max(x):.4g}" for name, x in off.items() if max(map(abs, x)) > 1e-3]
    if not told:
        return out, []
    return out, [f"readings count from where each point was at the yaw; taken off: {', '.join(told)} (mm or mrad)"]


def at_yaw(travel: np.ndarray, y: np.ndarray, yaw_at: float) -> float:
    """Reading [SI] at the yaw: the mean of what stands before it, else a line through the first readings after it."""
    there = np.isfinite(y)
    before = there & (travel < yaw_at)
    if before.sum() >= 3:
        return float(np.mean(y[before]))
    s, values = travel[there] - yaw_at, y[there]
    if not len(s):
        return 0.0
    near = s <= max(0.01 * (s[-1] - s[0]), 4.0 * float(np.median(np.diff(s))) if len(s) > 4 else 0.0)
    if near.sum() < 4:
        return float(values[0])
    return float(np.polynomial.Polynomial.fit(s[near], values[near], 1)(0.0))
