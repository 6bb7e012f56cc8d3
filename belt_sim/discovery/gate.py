"""The gate: does any generic law still explain more than chance beside the effects that were chosen?

The statistic is the smallest p of the whole dictionary at all places; its distribution when nothing is missing comes
from readings simulated with noise at levels that the readings leave possible, judged at those believed in, as the
readings themselves are.
"""

from dataclasses import dataclass

import numpy as np

from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.left_over.null import NoiseSource
from belt_sim.diagnosis.numerics.tails import chi2_isf, chi2_logsf, gumbel_fit, gumbel_isf, gumbel_sf
from belt_sim.discovery.search import Scored, distinct, of_every_form, ranked
from belt_sim.discovery.survey import Survey, survey_of
from belt_sim.discovery.tables import Products

LEVEL = 0.005  # false alarms of the gate when nothing is missing; unknown effects are far beyond, or nowhere near
DRAWS = 100
FAR = 1000.0  # chi2
SHOWN = 5


@dataclass(frozen=True)
class Gate:
    """failed: something is left that chance does not explain; p: of the best law by chance, all laws tried;
    threshold: the chi2 gain of a law with one size that chance beats in LEVEL of campaigns; best: the first laws.
    """

    failed: bool
    p: float
    threshold: float
    best: tuple[Scored, ...]


@dataclass(frozen=True)
class Chance:
    """What the best law of the dictionary scores when nothing is missing: a Gumbel law of -log p."""

    location: float
    scale: float

    def p(self, surprise: float) -> float:
        """Probability of a best -log p of at least ``surprise``."""
        return gumbel_sf(surprise, self.location, self.scale)

    def gain(self, level: float) -> float:
        """The gain of a law with one size that is beaten with probability ``level``."""
        return float(chi2_isf(np.exp(-gumbel_isf(level, self.location, self.scale)), 1))


def gate(bench: Workbench, fit: Fit, *, draws: int = DRAWS, seed: int = 0, level: float = LEVEL) -> Gate:
    """Test what ``fit`` leaves against the dictionary of generic laws."""
    return judged(survey_of(bench, fit), draws=draws, seed=seed, level=level)[0]


def judged(survey: Survey, *, draws: int = DRAWS, seed: int = 0, level: float = LEVEL) -> tuple[Gate, Chance]:
    """The gate of a survey, and what chance does.

    Campaigns in which nothing is missing are simulated, and the best of the dictionary of each is taken, as of this.
    """
    errors = errors_by_chance(survey, draws, np.random.default_rng(seed + 5))
    most, tables, found = np.zeros(draws), [], []
    for p, n, gain in of_every_form(survey, np.concatenate([errors, survey.ground.residual[None]])):
        most = np.maximum(most, _largest(p, gain[:, :draws]))
        tables.append((p.place, p.forms, n))
        found.append(gain[:, draws])
    chance, laws = Chance(*gumbel_fit(most)), ranked(tables, found)
    p_best = chance.p(float(np.max(surprise(laws.gain, laws.halves))))
    return Gate(p_best < level, p_best, chance.gain(level), tuple(distinct(laws, SHOWN))), chance


def surprise(gain, sizes):
    """-log of the chance of a gain by itself; of gains beyond FAR, where it underflows, in proportion to them."""
    return -chi2_logsf(np.minimum(gain, FAR), sizes) + 0.5 * np.maximum(gain - FAR, 0.0)


def _largest(p: Products, gain: np.ndarray) -> np.ndarray:
    """The largest -log p of a place's forms in every draw, (draws,); gain (F, draws)."""
    wave = np.zeros(len(gain), dtype=bool)
    wave[p.waves] = True
    most = [surprise(gain[mask].max(axis=0), sizes) for mask, sizes in ((wave, 2), (~wave, 1)) if mask.any()]
    return np.max(most, axis=0)


def errors_by_chance(survey: Survey, draws: int, rng: np.random.Generator) -> np.ndarray:
    """Whitened errors (draws, R, m), judged at the noise believed in, as the readings are.

    How far off belief may be is in the draws. Levels read once more off each draw make another statistic than that of
    the readings: of a draw in which a few repeats show little slow noise, what there is would count many times.
    """
    bench, left = survey.bench, survey.bench.samples.y - survey.fit.values
    errors = NoiseSource(bench, left, rng).draw(draws)
    errors[:, ~np.isfinite(bench.fitted.y)] = 0.0
    return survey.ground.white(errors)
