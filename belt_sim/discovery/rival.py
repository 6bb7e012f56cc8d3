"""One law against several known effects: the single generic law that explains most, put into the march.

Where several effects of the library together imitate one that it has not, one law at one place does as well as all of
them (Occam).
"""

import numpy as np

from belt_sim.diagnosis.unknown import OneLaw
from belt_sim.discovery.refit import refit
from belt_sim.discovery.search import cost, distinct, exponents_of, refined, singles
from belt_sim.discovery.survey import Survey
from belt_sim.discovery.words import formula

REFINED = 8  # laws whose shape numbers are fitted
TRIES = 2  # laws put into closed loop
PROMISE = 0.75  # share of a gain that a law has to promise in the linear range: a law of the state gains in the march


def one_law(survey: Survey, least: float) -> OneLaw | None:
    """The single law that explains most; None where none promises a chi2 of ``least`` beyond its price."""
    survey = survey.informed(survey.courses()[0])
    ones = singles(survey)
    searched = 2.0 * float(np.log(len(ones) / len(exponents_of(survey))))
    fine = sorted((refined(survey, s) for s in distinct(ones, REFINED)), key=lambda s: -s.score)
    tried = [s for s in fine[:TRIES] if s.gain - cost(s.law) - searched > PROMISE * least]
    closed = [r for r in (refit(survey, s) for s in tried) if r is not None]
    best = max(closed, key=lambda r: r.gain - cost(r.scored.law), default=None)
    if best is None:
        return None
    law = best.scored.law
    words = f"{law.terms[0].place.words}: {formula(law)}"
    return OneLaw(words, best.fit.values, cost(law) + searched)
