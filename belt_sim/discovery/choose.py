"""The choice of a law: singles, then pairs that earn their second term; what cannot be told apart; how stable it is."""

from dataclasses import dataclass

import numpy as np

from belt_sim.discovery.evidence import Course
from belt_sim.discovery.places import TENSION, place_columns
from belt_sim.discovery.search import Scored, distinct, pairs, refined, singles
from belt_sim.discovery.survey import Survey

SINGLES, PAIRS, FIRSTS = 24, 12, 8
WITHIN = 6.0  # chi2: a likelihood ratio of 20
MODELLED = 0.02  # of a gain, to which linear columns can be trusted
AGAIN = 400  # imagined repetitions of the campaign


@dataclass(frozen=True)
class Choice:
    """best: the law with the best score; simple: the best of one term; rivals: those within chance of the best.

    frequency: how often it comes first when all is measured again; possible: chi2 that a free course explains.
    """

    best: Scored
    rivals: tuple[Scored, ...]
    frequency: float
    simple: Scored
    possible: float


def choose(survey: Survey, course: Course) -> Choice:
    """The law that explains most for its numbers."""
    ones = singles(survey)
    fine = [refined(survey, s) for s in distinct(ones, SINGLES)]
    fine.sort(key=lambda s: -s.score)
    two = [refined(survey, s) for s in distinct(pairs(survey, distinct(fine, FIRSTS)), PAIRS)]
    everything = sorted([*fine, *two], key=lambda s: -s.score)
    best = everything[0]
    close = WITHIN + MODELLED * best.gain
    rivals = tuple(
        s
        for s in distinct(everything[1:], len(everything))
        if s.score > best.score - close and s.law.says != best.law.says and len(s.law.terms) <= len(best.law.terms)
    )
    return Choice(best, rivals, _frequency(survey, [best, *rivals]), fine[0], explained(survey, course))


def explained(survey: Survey, course: Course) -> float:
    """chi2 that the mean of a course explains."""
    g, u = survey.ground, course.inputs(survey.ops.grid)
    squeezed = course.place.name == TENSION
    felt = [(u * survey.states.squeeze[:, k] if squeezed else u)[None] for _, k in course.place.parts]
    column = place_columns(survey.ops, course.place, felt)[0].astype(float)
    return g.left() - g.left(g.residual - column)


def _frequency(survey: Survey, laws: list[Scored]) -> float:
    """How often the first of ``laws`` stays first under fresh noise, the data being as it says."""
    if len(laws) == 1:
        return 1.0
    g = survey.ground
    bases = []
    for s in laws:
        rows = survey.columns(s.law)
        flat = rows.reshape(len(rows), -1) - np.einsum(
            "kc,crm->krm", g.onto_shared(rows).sum(axis=1) @ g.inverse, g.shared
        ).reshape(len(rows), -1)
        bases.append(np.linalg.qr(flat.T)[0].T)
    stacked = np.concatenate(bases)
    owner = np.repeat(np.arange(len(bases)), [len(b) for b in bases])
    true = bases[0].T @ (bases[0] @ g.residual.ravel())
    root = np.linalg.cholesky(stacked @ stacked.T + 1e-6 * np.eye(len(stacked)))
    seen = stacked @ true + np.random.default_rng(1).standard_normal((AGAIN, len(stacked))) @ root.T
    gains = np.stack([np.sum(seen[:, owner == k] ** 2, axis=1) for k in range(len(laws))], axis=1)
    paid = gains - np.array([s.gain - s.score for s in laws])
    return float(np.mean(np.argmax(paid, axis=1) == 0))
