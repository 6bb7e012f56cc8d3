"""A joint fit as a row of the table of evidence."""

import numpy as np

from belt_sim.diagnosis.decision.table import Row
from belt_sim.diagnosis.fits.belt_starts import places_tried
from belt_sim.diagnosis.fits.candidate import is_plausible, prior_sigma
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.heldout import held_out, prior_before
from belt_sim.diagnosis.fits.workbench import Workbench


def row_of(bench: Workbench, fit: Fit, checked: bool) -> Row:
    """What a decision needs to know of a fit; checked: with what it predicts of left-out conditions."""
    slots = [bench.forward.slots[k] for k in fit.free]
    columns = fit.columns.reshape(len(slots), len(fit.residual))
    left_out = held_out(bench, fit).conditions if checked else {}
    away, sigma = fit.vector[fit.free] - bench.forward.null()[fit.free], prior_sigma(bench.forward, fit.free)
    harmonics = np.array([s.effect.is_additive() for s in slots], dtype=np.bool_)
    if harmonics.any():
        sigma = np.where(harmonics, prior_before(bench, fit)[1], sigma)
    scanned = {position: len(values) for name in fit.ids for position, values in bench.forward.grids(name).items()}
    turned = places_tried(bench) if any(s.effect.comes_round for s in slots) else ()
    kept = [k for k, position in enumerate(fit.free) if position not in scanned]
    sized = np.array([not s.effect.parameters[s.name].modifier for s in slots], dtype=bool) & ~harmonics
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
