"""Best-first search: beside the likeliest set every other candidate, then others in the place of its members."""

from itertools import combinations

import numpy as np

from belt_sim.diagnosis.decision.decide import explanations
from belt_sim.diagnosis.decision.policy import POLICY
from belt_sim.diagnosis.decision.table import EvidenceTable, Ids, Row
from belt_sim.diagnosis.fits.belt_starts import places_tried
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.heldout import held_out, prior_of_fit
from belt_sim.diagnosis.fits.linearisation import Linearisation
from belt_sim.diagnosis.fits.plausibility import is_plausible
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.search.joint_fits import JointFits

ROUNDS = 8
PAIRS = 3  # that are fitted because they promise more together than any effect alone
MAX_EFFECTS = 4


class Search:
    """fits: about the likeliest set that was found."""

    def __init__(self, bench: Workbench, linearisation: Linearisation, inflation: float) -> None:
        """linearisation: about the fit of no effect; inflation: as in ``EvidenceTable``."""
        self.inflation, self.count = inflation, len(bench.forward.classes)
        price = 2.0 * float(np.log(max(self.count, 1))) + 4.0  # of one size, one in so many candidates [chi2]
        self.fits = JointFits(bench, price, linearisation, fits={frozenset(): linearisation.fit})
        self.about: Ids = frozenset()

    def run(self) -> None:
        """Grow the likeliest set, then look in the place of each of its members, until nothing is likelier.

        Explanations are compared about one point: noise levels, and with them what a gain counts, differ elsewhere.
        """
        self.fits.fit_all(self.fits.best_pairs(PAIRS))
        for _ in range(ROUNDS):
            best = self._likeliest()
            if best != self.about:
                self._move(best)
            ids = self.fits.fits[best].ids
            if len(best) < MAX_EFFECTS:
                self.fits.trials(ids)
            if self._likeliest() == best:
                for name in ids:
                    self.fits.trials(tuple(i for i in ids if i != name))
                if self._likeliest() == best:
                    break

    def table(self, checked: bool = True) -> EvidenceTable:
        """All that is fitted, about where the search stands; checked: with what is predicted of left-out conditions."""
        fits = [f for f in self.fits.fits.values() if np.isfinite(f.chi2)]
        rows = tuple(row_of(self.fits.bench, f, checked) for f in fits)
        return EvidenceTable(candidates=self.count, inflation=self.inflation, damaged=False, rows=rows)

    def _likeliest(self) -> Ids:
        """The likeliest set about where the search stands."""
        return frozenset(explanations(self.table(checked=False), POLICY)[0].effects)

    def _move(self, best: Ids) -> None:
        """Take noise, settings and all subsets about a set."""
        ids = self.fits.fits[best].ids
        self.fits, self.about = self.fits.move_to(ids), best
        self.fits.fit_all([part for k in range(len(ids) + 1) for part in combinations(ids, k)])


# A joint fit as a row of the table of evidence.


def row_of(bench: Workbench, fit: Fit, checked: bool) -> Row:
    """What a decision needs to know of a fit; checked: with what it predicts of left-out conditions."""
    slots = [bench.forward.slots[k] for k in fit.free]
    columns = fit.columns.reshape(len(slots), len(fit.residual))
    left_out = held_out(bench, fit) if checked else {}
    _, sigma, away = prior_of_fit(bench, fit)
    scanned = {position: len(values) for name in fit.ids for position, values in bench.forward.grids(name).items()}
    turned = places_tried(bench) if any(s.effect.comes_round for s in slots) else ()
    kept = [k for k, position in enumerate(fit.free) if position not in scanned]
    sized = np.array([not (s.only_shapes or s.effect.is_additive()) for s in slots], dtype=bool)
    return Row(
        ids=frozenset(fit.ids),
        chi2=float(fit.chi2),
        gram=(columns @ columns.T)[np.ix_(kept, kept)],
        away=away[kept],
        sigma=sigma[kept],
        owner=tuple(slots[k].effect.id for k in kept),
        sized=sized[kept],
        scanned=(*scanned.values(), *turned),
        plausible=not slots or is_plausible(bench.forward, fit),
        held_out={n: c.surprise for n, c in left_out.items() if c.testable},
    )
