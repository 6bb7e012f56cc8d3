"""Where on the belt every run starts: one free number per run, the same for the belt and both pulleys.

What comes round with the belt or a pulley is the same in every run, but for where it begins. Whatever comes round with
the belt has its own harmonics at every sensor, and pulleys their own waves; a start turns them all. All runs are turned
until they have one shape in common. That must gain more than the same place at every start does, by what so many free
numbers cost (trial factor), or runs are taken to start at one place.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from belt_sim.campaign import Campaign
from belt_sim.diagnosis.fits.linearisation import Linearisation
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.noise.metric import Levels
from belt_sim.diagnosis.readings.samples import Samples

HARMONICS = 12  # of the belt's length, at most
LARGEST = 1e-3  # [m], one sigma of the first harmonic of what comes round; that of others falls with their number
ASKEW = 10.0  # one sigma of a wobble, in units of its scale
PARTS = 16  # of the shortest wave, between places that are tried
PLACES = (96, 400)  # fewest and most places that are tried
EVEN = float(np.sqrt(12.0))  # width of an even distribution over its sigma
MOVED = 1e-4  # [m], over which derivatives along a start are taken
WIDER = 2.0  # a start may be off by so many times what the shape in common tells, which is not yet the effect's own
CHANCE = 2.0  # log odds asked for, over the trial factor: noise turned to fit its own shape gains up to 1.6 of that
MOST_LEFT = 2.0  # chi2 a reading beyond candidates and waves: 1 where they hold, 9 where a lack passed for starts
ROUNDS = 6  # of turning the runs and asking for their shape
REFERENCES = 3  # runs whose own shape may begin


@dataclass(frozen=True)
class PeriodicWaves:
    """Waves in all runs: gram (R, P, P) and moments (R, P) of whitened pairs of cosine and sine, in units of one sigma,
    with what is left of the readings; rates (R, P/2): by how many radians a metre of start turns a pair; left: chi2 a
    reading that neither waves nor other candidates take up.
    """

    gram: np.ndarray
    moments: np.ndarray
    rates: np.ndarray
    left: float = 1.0

    def rotations(self, r: int, starts: np.ndarray) -> np.ndarray:
        """Matrices (k, P, P) that turn common numbers into those of a run that starts at ``starts`` (k,)."""
        angle = starts[:, None] * self.rates[r]
        found = np.zeros((len(starts), *self.gram.shape[1:]))
        even, odd = np.arange(0, self.gram.shape[1], 2), np.arange(1, self.gram.shape[1], 2)
        found[:, even, even] = found[:, odd, odd] = np.cos(angle)
        found[:, even, odd], found[:, odd, even] = np.sin(angle), -np.sin(angle)
        return found

    def fit_common(self, starts: np.ndarray, runs: Sequence[int]) -> tuple[np.ndarray, float]:
        """The likeliest common numbers (P,) of some runs that start at ``starts`` (R,), and what they gain [chi2]."""
        turns = {r: self.rotations(r, starts[r : r + 1])[0] for r in runs}
        gram = np.eye(self.gram.shape[1]) + sum(t.T @ self.gram[r] @ t for r, t in turns.items())
        moments = sum(t.T @ self.moments[r] for r, t in turns.items())
        numbers = np.linalg.solve(gram, moments)
        return numbers, float(moments @ numbers)

    def likeliest_start(self, r: int, numbers: np.ndarray, places: np.ndarray) -> float:
        """Where a run starts if the common numbers are so: the best of evenly spaced ``places``, between its
        neighbours by a parabola."""
        own = self.rotations(r, places) @ numbers
        gain = 2.0 * own @ self.moments[r] - np.einsum("ki,ij,kj->k", own, self.gram[r], own)
        k = int(np.argmax(gain))
        before, here, after = gain[k - 1], gain[k], gain[(k + 1) % len(gain)]
        bend = min(before - 2.0 * here + after, -1e-9)
        return float(places[k] + 0.5 * (before - after) / bend * (places[1] - places[0]))

    def sigmas(self, starts: np.ndarray, first: int) -> np.ndarray:
        """One sigma of every start (R,), the common numbers being as uncertain; 0 of the run whose start is 0."""
        numbers, others = self.fit_common(starts, range(len(starts)))[0], [r for r in range(len(starts)) if r != first]
        gram, cross, own = np.eye(len(numbers)), [], []
        for r in range(len(starts)):
            here, beyond = self.rotations(r, starts[r] + np.array([0.0, MOVED]))
            shape = (beyond - here) @ numbers / MOVED
            gram += here.T @ self.gram[r] @ here
            cross.append(here.T @ self.gram[r] @ shape)
            own.append(shape @ self.gram[r] @ shape)
        between = np.array(cross)[others]
        normal = np.diag(np.array(own)[others]) - between @ np.linalg.solve(gram, between.T)
        found = np.zeros(len(starts))
        found[others] = np.sqrt(np.diagonal(np.linalg.pinv(normal, hermitian=True)))
        return found

    def align(self, places: np.ndarray) -> tuple[np.ndarray, float]:
        """Starts and their sigmas (R, 2) that have most in common, those of one run 0, and what they gain [chi2]."""
        runs = range(len(self.gram))
        none = np.zeros(len(self.gram))
        alone = [self.fit_common(none, [r])[1] for r in runs]
        best, most = (none, none), -np.inf
        for first in np.argsort(alone)[::-1][:REFERENCES]:
            starts, numbers = none, self.fit_common(none, [first])[0]
            for _ in range(ROUNDS):
                starts = np.array([0.0 if r == first else self.likeliest_start(r, numbers, places) for r in runs])
                numbers, gain = self.fit_common(starts, runs)
            if gain > most:
                best, most = (starts, self.sigmas(starts, first)), gain
        return np.stack(best, axis=1), most


def find_starts(bench: Workbench, linearisation: Linearisation) -> Campaign | None:
    """The campaign with where on the belt its runs start; None where that is stated, or one place does as well."""
    runs = bench.samples.runs
    round_ones = any(c.comes_round for c in bench.forward.classes)
    if not round_ones or len(runs) < 2 or any(run.start is not None for run in runs):
        return None
    turning = periodic_waves(bench, linearisation)
    if turning.left > MOST_LEFT:
        return None
    rig = bench.samples.cases.rig
    length, shortest = float(np.max(rig.belt_length)), 2.0 * np.pi / float(turning.rates.max())
    count = int(np.clip(np.ceil(PARTS * length / shortest), *PLACES))
    same = turning.fit_common(np.zeros(len(runs)), range(len(runs)))[1]
    starts, gain = turning.align(length * np.arange(count) / count)
    if 0.5 * (gain - same) <= CHANCE * (len(runs) - 1) * np.log(count):
        return None
    u = np.clip(WIDER * starts[:, 1], length / count / EVEN, length / EVEN) * (starts[:, 1] > 0.0)
    found = {run.name: (float(s), float(off)) for run, s, off in zip(runs, starts[:, 0] % length, u, strict=True)}
    stated = {run.name: (run.start, run.start_u) for run in bench.campaign.runs} | found
    turned = [replace(r, start=stated[r.name][0], start_u=stated[r.name][1]) for r in bench.campaign.runs]
    return replace(bench.campaign, runs=tuple(turned))


def places_tried(bench: Workbench) -> tuple[int, ...]:
    """Of how many places the start of every run was chosen, where it was."""
    length = float(np.max(bench.samples.cases.rig.belt_length))
    return tuple(max(1, round(length / (EVEN * r.start_u))) for r in bench.samples.runs if r.start_u > 0.0)


def periodic_waves(bench: Workbench, linearisation: Linearisation) -> PeriodicWaves:
    """What comes round in the residual of the linearised fit, beside what all other candidates could do.

    Noise is as stated (repeats that start elsewhere on the belt differ by more), or larger where all that may be there
    leaves more.
    """
    samples, metric = bench.samples, bench.metric_at(Levels())
    waves, rates = zip(_belt_waves(samples), *_pulley_waves(bench, linearisation), strict=True)
    rows = np.concatenate([*waves, (samples.y - linearisation.fit.values)[None]])
    others = [linearisation.slopes[p] for p, s in enumerate(bench.forward.slots) if not s.effect.comes_round]
    known = np.concatenate([bench.shapes, bench.shared, np.reshape(others, (-1, *samples.y.shape))])
    grams, moments, left, count = [], [], 0.0, 0
    for r in range(len(samples.runs)):
        white, rank = _project_out(metric.roots[r], rows[:, r], known[:, r])
        grams.append(white[:-1] @ white[:-1].T)
        moments.append(white[:-1] @ white[-1])
        rest = white[-1] @ white[-1] - moments[-1] @ np.linalg.solve(grams[-1] + np.eye(len(grams[-1])), moments[-1])
        left, count = left + rest, count + int(np.isfinite(samples.y[r]).sum()) - rank - len(grams[-1])
    noise = max(1.0, left / max(count, 1))
    return PeriodicWaves(np.array(grams) / noise, np.array(moments) / noise, np.concatenate(rates, axis=1), noise)


def _belt_waves(samples: Samples) -> tuple[np.ndarray, np.ndarray]:
    """Cosine and sine (P, R, S, n) of the harmonics of the belt's length at each lateral sensor, of one sigma and zero
    where the yaw is applied; and the rates (R, P/2) at which a start turns each pair [rad/m]."""
    lateral = [k for k, s in enumerate(samples.signals) if s.kind == "lateral"]
    length, direction = float(np.max(samples.cases.rig.belt_length)), np.asarray(samples.cases.settings.direction)
    harmonics = np.arange(1, HARMONICS + 1)
    many = harmonics[:, None, None]
    phase = 2.0 * np.pi * direction[:, None] * samples.travel / length
    at_yaw = 2.0 * np.pi * direction * samples.yaw_at / length
    waves = np.zeros((len(lateral), HARMONICS, 2, *samples.y.shape))
    for part, wave in enumerate((np.cos, np.sin)):
        for k, s in enumerate(lateral):
            waves[k, :, part, :, s] = LARGEST / many * (wave(many * phase) - wave(many * at_yaw[:, None]))
    rates = np.tile(2.0 * np.pi * harmonics / length, len(lateral)) * direction[:, None]
    return waves.reshape(-1, *samples.y.shape), rates


def _pulley_waves(bench: Workbench, linearisation: Linearisation) -> list[tuple[np.ndarray, np.ndarray]]:
    """The same of the wobble of either pulley, where that is a candidate."""
    rig, runs = bench.samples.cases.rig, len(bench.samples.runs)
    shapes = {bench.forward.slots[p].name: linearisation.slopes[p] for p in bench.forward.index("wobble")}
    return [
        (
            ASKEW * np.stack([shapes[f"beta_cos{end}"], shapes[f"beta_sin{end}"]]),
            np.full((runs, 1), 1.0 / np.max(radius)),
        )
        for end, radius in (("", rig.tail_radius), ("_head", rig.head_radius))
        if shapes
    ]


def _project_out(root: np.ndarray, rows: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, int]:
    """Rows (k, S, n) of a run, whitened by its ``root`` (S, n, n), without what ``known`` (m, S, n) ones span, as
    (k, S*n); and the rank of these."""
    filled = (np.where(np.isfinite(x), x, 0.0) for x in (rows, known))
    white, beside = (np.einsum("snm,ksm->ksn", root, x).reshape(len(x), -1) for x in filled)
    size, taken = np.linalg.svd(beside, full_matrices=False)[1:]
    taken = taken[size > 1e-6 * size.max(initial=1e-300)]
    return white - (white @ taken.T) @ taken, len(taken)
