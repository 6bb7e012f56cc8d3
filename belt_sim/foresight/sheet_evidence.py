"""Which mistake in the sheet explains what a model leaves unexplained: tried before any law or fault is searched for.

The campaign as each mistake would have it is predicted by the model with a yaw offset of either pulley and a taper
free, so that a usual fault of the machine hides no mistake. chi2 is that of the noise as repeats show it, else as
stated. Every mistake is screened with the nuisances of the stated campaign; those that help are laid out anew.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from belt_sim.campaign import Campaign, Suspicion
from belt_sim.campaign.quality import Severity
from belt_sim.campaign.sheet_doubts import SheetMistake, sheet_mistakes
from belt_sim.diagnosis.fits.workbench import linear_response
from belt_sim.diagnosis.readings.forward import Forward
from belt_sim.diagnosis.readings.samples import samples_of
from belt_sim.effects.base import library
from belt_sim.line.spans import Composition
from belt_sim.model import MODELS

#: Faults that are free in every layout.
USUAL = ("yaw_offset_tail", "yaw_offset_head", "taper")
#: chi2 a reading below which too little is unexplained to ask; stated noise is seldom better known.
UNEXPLAINED = 1.2
#: Sigmas of the chi2 of noise that one run's chi2 must be off, to ask as well: a mistake in one run is lost in all.
ODD = 3.5
#: Share of the unexplained chi2 that a mistake must remove to be believed, and to be mentioned.
BELIEVED, MENTIONED = 0.9, 0.5
#: chi2 a reading that may be left then, unless nearly all is removed: a fault may stand beside the mistake.
LEFT, NEARLY_ALL = 2.0, 0.98
#: chi2 by which the best mistake must beat the stated sheet, by one noise too, and all other mistakes to be believed.
DECISIVE = 100.0
#: Mistakes that make a belt stiffer or softer alike; by less than this factor a machine can be off by itself.
STIFFNESS, OFF = ("width", "thickness", "modulus", "tension"), 3.0
#: Mistakes that change a belt's movement as another base model does, and those models: one that removes BELIEVED of
#: what the mistake removes may be meant.
LIKE_A_MODEL, HOUSE = (*STIFFNESS, "radius", "centre_distance", "travel_unit"), ("beam_th1", "beam_th2", "strip")
#: chi2 by which a run must gain to count among those in which a mistake was made.
OF_RUN = 50.0
#: Steps of the refinement of a mistake's size, and how far it reaches, as a logarithm.
REFINED, REACH = 12, 0.9
#: Kinds of mistakes that are laid out anew after the screening.
FINALISTS = 3


@dataclass(frozen=True, kw_only=True)
class SheetEvidence:
    """mistake; share: of the unexplained chi2 of the runs that it concerns, which it removes; certain: whether it
    removes so much, and more than mistakes in anything else, that nothing else should be searched for; gain: chi2 over
    that of the sheet without faults."""

    mistake: SheetMistake
    share: float
    certain: bool
    gain: float

    @property
    def suspicion(self) -> Suspicion:
        """The mistake as one of the data's."""
        run = self.mistake.runs[0] if len(self.mistake.runs) == 1 else None
        sentence = f"{self.mistake.sentence}; that explains {self.share:.0%} of what the model leaves"
        severity: Severity = "stop" if self.certain else "look"
        return Suspicion(run, tuple(self.mistake.places), "sheet", sentence, severity)


def sheet_evidence(
    campaign: Campaign, model: Composition, tell: Callable[[str], None] = lambda text: None
) -> tuple[SheetEvidence, ...]:
    """Return the mistakes that explain what ``model`` leaves, the best first; () if it leaves little."""
    curved = replace(campaign, runs=tuple(r for r in campaign.runs if len(r.travel)), steady=())
    if not curved.runs or not any(s.kind == "lateral" for s in campaign.signals):
        return ()
    stated = _Layout(curved, model)
    total = stated.total()
    excess = total - stated.count
    odd = stated.chi2 - stated.counts > ODD * np.sqrt(2.0 * stated.counts)
    if not np.isfinite(excess) or not (excess >= (UNEXPLAINED - 1.0) * stated.count or odd.any()):
        return ()
    tell("checking the machine data")
    of_kind: dict[str, tuple[float, SheetMistake]] = {}
    for mistake in sheet_mistakes(curved):
        chi2, found = _screen(mistake, curved, stated)
        if chi2 < of_kind.get(found.kind, (np.inf, found))[0]:
            of_kind[found.kind] = chi2, found
    screened = sorted((_refine(chi2, m, stated) for chi2, m in of_kind.values()), key=lambda f: f[0])
    exact = []
    for _, m in screened[:FINALISTS]:
        undone = _Layout(m.campaign, model)
        # by one noise: what only reads another noise off the repeats gains nothing
        gain = float(np.sum(undone.chi2_by_run(curved))) - undone.total(m)
        # two repeats that differ by a mistake are noise until it is undone
        deviance = undone.total(m) + undone.log_det() - stated.log_det()
        exact += [(deviance, m)] if gain > DECISIVE and np.isfinite(deviance) else []
    ranked = sorted([*exact, *screened[FINALISTS:]], key=lambda f: f[0])
    if not ranked:
        return ()
    best, rival = ranked[0][0], np.inf
    if total - best > MENTIONED * excess and not ranked[0][1].runs:
        rival = _other_models(stated)
    if rival < best:  # the model is to blame, and not the sheet
        return ()
    like_a_model = ranked[0][1].kind in LIKE_A_MODEL and rival - best < (1.0 - BELIEVED) * excess
    clear = _is_clear(ranked, total) and not like_a_model
    alone, evidence = float(np.sum(stated.alone)), []
    one = ranked[0][1].runs if len(ranked[0][1].runs) == 1 else None  # the run that the best mistake concerns
    for chi2, m in ranked:
        own = np.array([not m.runs or r.name in m.runs for r in curved.runs])
        numbers, unexplained = int(stated.counts[own].sum()), float(np.sum((stated.chi2 - stated.counts)[own]))
        removed, unexplained = total - chi2, max(unexplained, 1.0)
        share, left = min(removed / unexplained, 1.0), max((unexplained - removed) / numbers + 1.0, 0.0)
        first = m is ranked[0][1] or (m.runs == one and chi2 - best < DECISIVE)
        asked = max(unexplained, removed) >= (UNEXPLAINED - 1.0) * numbers
        certain = clear and first and asked and (share > NEARLY_ALL or (share > BELIEVED and left < LEFT))
        if share > MENTIONED:
            evidence.append(SheetEvidence(mistake=m, share=share, certain=certain, gain=alone - chi2))
    return tuple(evidence)


def _is_clear(ranked: Sequence[tuple[float, SheetMistake]], total: float) -> bool:
    """Whether the best mistake beats the stated sheet and all others, but those that do the same or concern the same
    run, and is more than a fault of the machine."""
    (chi2, best), *rest = ranked
    stiffness, one = best.kind in STIFFNESS, best.runs if len(best.runs) == 1 else None
    factor = best.size**2 if best.kind == "width" else best.size
    alike = [m for _, m in rest if m.runs == one or (stiffness and m.kind in STIFFNESS)]
    others = [total, *(c for c, m in rest if m not in alike)]
    return min(others) - chi2 > DECISIVE and not (stiffness and 1.0 / OFF < factor < OFF)


def _other_models(stated: "_Layout") -> float:
    """The least chi2 that another base model leaves without any mistake."""
    others = [MODELS[name] for name in HOUSE if name != stated.model.name]
    return min(float(np.sum(stated.chi2_by_run(stated.bench.campaign, other))) for other in others)


class _Layout:
    """A campaign laid out for a model.

    chi2: what is left of every run (R,) when the usual faults are fitted; alone: without any fault.
    """

    def __init__(self, campaign: Campaign, model: Composition) -> None:
        self.model = model
        classes = [cls for name, cls in library().items() if name in USUAL and model.refusal(cls) is None]
        self.bench, fit = linear_response(campaign, model, classes, planned=False)
        self.counts = np.isfinite(self.bench.samples.y).sum(axis=(1, 2))
        self.count = int(self.counts.sum())
        sound = np.isfinite(fit.columns).all(axis=1)
        self._basis = np.linalg.qr(fit.columns[sound].T)[0]
        self.chi2 = self._chi2_of_residual(self.bench.samples.y - fit.values)
        self.alone = self._chi2_of_residual(self.bench.samples.y - fit.values, faults=False)

    def total(self, mistake: SheetMistake | None = None) -> float:
        """chi2 of all runs; of a mistake in the unit of readings with their scale allowed for."""
        return float(np.sum(self.chi2)) - (2.0 * mistake.log_jacobian * self.count if mistake else 0.0)

    def total_without(self, mistake: SheetMistake) -> float:
        """The same of the campaign with a mistake undone, by the nuisances of this layout."""
        return float(np.sum(self.chi2_by_run(mistake.campaign))) - 2.0 * mistake.log_jacobian * self.count

    def log_det(self) -> float:
        """ln of the determinant of the noise's covariance."""
        diagonal = np.diagonal(self.bench.metric.roots, axis1=-2, axis2=-1)
        return -2.0 * float(np.sum(np.log(diagonal[diagonal > 0.0])))

    def _chi2_of_residual(self, rest: np.ndarray, *, faults: bool = True) -> np.ndarray:
        if not np.isfinite(rest[np.isfinite(self.bench.samples.y)]).all():
            return np.full(len(rest), np.inf)
        white = self.bench.metric.whiten(rest)
        white = white - self._basis @ (self._basis.T @ white) if faults else white
        return np.sum(white.reshape(len(rest), -1) ** 2, axis=1)

    def chi2_by_run(self, campaign: Campaign, model: Composition | None = None, *, faults: bool = True) -> np.ndarray:
        """chi2 of every run where readings, settings or the model are others, by the nuisances of this layout."""
        if any(r.yaw_at >= r.travel[-1] for r in campaign.runs):
            return np.full(len(campaign.runs), np.inf)
        samples = samples_of(campaign)
        if samples.y.shape != self.bench.samples.y.shape:
            return np.full(len(campaign.runs), np.inf)
        forward = Forward(samples, model or self.model, ())
        rest = samples.y - forward.values(forward.null()[None])[0]
        rest = np.where(np.isnan(samples.y), 0.0, rest)  # a tilt is blank about the yaw
        return self._chi2_of_residual(rest, faults=faults)


def _screen(mistake: SheetMistake, campaign: Campaign, stated: _Layout) -> tuple[float, SheetMistake]:
    """chi2 with the mistake in all runs, or in those alone in which it helps."""
    chi2 = stated.total_without(mistake)
    if not mistake.by_run:
        return chi2, mistake
    # which runs it helps is asked without faults: one that is free would take the mistake of some runs to all
    alone = stated.chi2_by_run(mistake.campaign, faults=False)
    helped = [r.name for r, a, b in zip(campaign.runs, stated.alone, alone, strict=True) if a - b > OF_RUN]
    oddest = campaign.runs[int(np.argmax(np.nan_to_num(stated.alone - alone, nan=-np.inf)))].name
    parts = [names for names in {tuple(helped), (oddest,)} if 0 < len(names) < len(campaign.runs)]
    tried = [(stated.total_without(m), m) for m in (replace(mistake, runs=names) for names in parts)]
    return min([(chi2, mistake), *tried], key=lambda f: f[0])


def _refine(chi2: float, mistake: SheetMistake, stated: _Layout) -> tuple[float, SheetMistake]:
    """The mistake of the size that fits best, where its size is free."""
    if not mistake.continuous or chi2 > stated.total():
        return chi2, mistake

    def misfit(logarithm: float) -> float:
        return min(stated.total_without(replace(mistake, size=float(np.exp(logarithm)))), 1e300)

    at = float(np.log(mistake.size))
    best = minimize_scalar(misfit, bounds=(at - REACH, at + REACH), method="bounded", options={"maxiter": REFINED})
    return (float(best.fun), replace(mistake, size=float(np.exp(best.x)))) if best.fun < chi2 else (chi2, mistake)
