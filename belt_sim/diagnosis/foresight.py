"""Foresight: mistakes in the sheet, harm to the belt, and what a campaign can tell, before anything is searched for."""

import math
from collections import defaultdict
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations
from statistics import NormalDist
from typing import Any

import numpy as np

from belt_sim.campaign import Campaign, Suspicion, case_of, leave_out_bad_readings, suspicions
from belt_sim.campaign.kinematics import check_repeats
from belt_sim.campaign.quality import Severity, records_of
from belt_sim.campaign.sheet_doubts import BY_RUN, CONTINUOUS, SheetMistake, sheet_mistakes
from belt_sim.campaign.types import rig_of, shortlist
from belt_sim.diagnosis.decide import UnknownEvidence
from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.forward import SLOWEST, Forward
from belt_sim.diagnosis.next_run import Outlook
from belt_sim.diagnosis.noise import FREE_ZERO, metric_of
from belt_sim.diagnosis.plausibility import prior_sigma
from belt_sim.diagnosis.samples import samples_of
from belt_sim.diagnosis.workbench import Workbench, linear_response, start_shapes
from belt_sim.effects.base import library
from belt_sim.errors import Limit
from belt_sim.jax_setup import map_in_threads
from belt_sim.line.spans import Composition
from belt_sim.model import BASE_MODELS, MODELS
from belt_sim.results.diagnosis import RESOLVED
from belt_sim.results.errors import Doubt, Pair, Visible
from belt_sim.units import N_PER_MM2
from belt_sim.validity import STRENGTH, geometric, limits

# Runs of a plan that could harm the belt or mean nothing: an edge slack, steel near its strength, laws left behind.


def harm_warnings(campaign: Campaign) -> tuple[str, ...]:
    """Return a sentence a kind of harm, the runs concerned and the worst of them named."""
    found: dict[str, list[tuple[Limit, str]]] = {}
    for run in campaign.runs:
        case = case_of(campaign, replace(run, yaw_at=0.0))
        load, tension = {limit.id: float(limit.load) for limit in limits(case)}, float(case.settings.tension)
        stress = load["thick_belt"] * STRENGTH + tension * load["slack_edge"]
        reached = f"tension, bending and yaw reach {stress / N_PER_MM2:.0f} of the {STRENGTH / N_PER_MM2:.0f} N/mm2"
        rows = (
            ("slack_edge", load["slack_edge"], "the yaw takes the tension off one edge; take a smaller yaw"),
            ("second_order", load["second_order"], "the yaw is too large for the models' laws; take a smaller one"),
            ("stress", stress / STRENGTH, f"{reached} that belt steels bear; take a smaller yaw or a larger pulley"),
        )
        own = [Limit(*row) for row in rows]
        told = {limit.id for limit in own} | {"edge_stretch", "thick_belt"}
        for limit in (*own, *(limit for limit in geometric(case) if limit.id not in told)):
            if limit.load > 1.0:
                found.setdefault(limit.id, []).append((limit, run.name))
    sentences = []
    for runs in found.values():
        worst, name = max(runs, key=lambda run: run[0].load)
        some = f"{len(runs)} of {len(campaign.runs)} runs" if len(runs) > 1 else f"run {name}"
        sentences.append(f"{some}: {worst.words} ({worst.exceeded_by}{f', worst in {name}' if len(runs) > 1 else ''})")
    return tuple(sentences)


# Which mistake in the sheet explains what a model leaves unexplained: tried before any law or fault is searched for.
#
# The campaign as each mistake would have it is predicted by the model with a yaw offset of either pulley and a taper
# free, so that a usual fault of the machine hides no mistake. chi2 is that of the noise as repeats show it, else as
# stated. Every mistake is screened with the nuisances of the stated campaign; those that help are laid out anew.


#: Faults that are free in every layout.
USUAL = ("yaw_offset_tail", "yaw_offset_head", "taper")
#: chi2 a reading below which too little is unexplained to ask; stated noise is seldom better known.
UNEXPLAINED = 1.2
#: Sigmas of the chi2 of noise that one run's chi2 must be off, to ask as well: a mistake in one run is lost in all.
ODD = 3.5
#: Share of the unexplained chi2 that a mistake must remove to be believed, and to be mentioned.
BELIEVED, MENTIONED = 0.9, 0.5
#: chi2 a reading that may be left then, unless nearly all is removed: a fault may stand beside the mistake.
CHI2_LEFT, NEARLY_ALL = 2.0, 0.98
#: chi2 by which the best mistake must beat the stated sheet, by one noise too, and all other mistakes to be believed.
DECISIVE = 100.0
#: chi2 by which the other direction of travel must be better to be asked about beside whatever else acts: where it is
#: right, faults of a machine reach a half of it, and delays more.
TURNED_ROUND = 200.0
#: Mistakes that make a belt stiffer or softer alike; by less than this factor a machine can be off by itself.
STIFFNESS_KINDS, OFF = ("width", "thickness", "modulus", "tension"), 3.0
#: Mistakes that change a belt's movement as another base model does: one that removes BELIEVED of what the mistake
#: removes may be meant.
LIKE_A_MODEL = (*STIFFNESS_KINDS, "radius", "centre_distance", "travel_unit")
#: chi2 by which a run must gain to count among those in which a mistake was made.
GAIN_OF_A_RUN = 50.0
#: Share of what free starts remove, that another base model may remove at most.
OF_MODEL = 0.5
#: Steps of the refinement of a mistake's size, and how far it reaches, as a logarithm.
REFINED, SIZE_REACH = 12, 0.9
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
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
    curved = _curves_of(campaign)
    if not curved.runs or not any(s.kind == "lateral" for s in campaign.signals):
        return ()
    stated = _layout(curved, model)
    total = stated.total()
    excess = total - stated.count
    odd = stated.chi2 - stated.counts > ODD * np.sqrt(2.0 * stated.counts)
    if not np.isfinite(excess) or not (excess >= (UNEXPLAINED - 1.0) * stated.count or odd.any()):
        return ()
    tell("checking the machine data")
    of_kind: dict[str, tuple[float, SheetMistake]] = {}
    # side by side: marches of a few rows leave a core idle
    for chi2, found in map_in_threads(lambda m: _screen(m, curved, stated), sheet_mistakes(curved)):
        if chi2 < of_kind.get(found.kind, (np.inf, found))[0]:
            of_kind[found.kind] = chi2, found
    screened = sorted(map_in_threads(lambda one: _refine(one[0], one[1], stated), of_kind.values()), key=lambda f: f[0])
    finalists = [m for _, m in screened[:FINALISTS]]
    exact = []
    for m, undone in zip(finalists, map_in_threads(lambda m: _Layout(m.campaign, model), finalists), strict=True):
        # by one noise: what only reads another noise off the repeats gains nothing
        gain = float(np.sum(undone.chi2_of(undone.rest_of(curved)))) - undone.total(m)
        # two repeats that differ by a mistake are noise until it is undone
        deviance = undone.total(m) + undone.log_det - stated.log_det
        exact += [(deviance, m)] if gain > DECISIVE and np.isfinite(deviance) else []
    ranked = sorted([*exact, *screened[FINALISTS:]], key=lambda f: f[0])
    if not ranked:
        return ()
    best, rival = ranked[0][0], np.inf
    if total - best > MENTIONED * excess and not ranked[0][1].runs:
        rival = stated.total_of_other_models()
    if rival < best:  # the model is to blame, and not the sheet
        return ()
    first = ranked[0][1]
    like_a_model = first.kind in LIKE_A_MODEL and rival - best < (1.0 - BELIEVED) * excess
    stiffness = first.kind in STIFFNESS_KINDS
    one = first.runs if len(first.runs) == 1 else None  # the run that it concerns
    # whether it beats the stated sheet and all others, but those that do the same or concern the same run, and is more
    # than a fault of the machine
    alike = [m for _, m in ranked[1:] if m.runs == one or (stiffness and m.kind in STIFFNESS_KINDS)]
    others = [total, *(c for c, m in ranked[1:] if m not in alike)]
    factor = first.size**2 if first.kind == "width" else first.size
    clear = min(others) - best > DECISIVE and not (stiffness and 1.0 / OFF < factor < OFF) and not like_a_model
    alone, evidence = float(np.sum(stated.alone)), []
    for chi2, m in ranked:
        own = np.array([not m.runs or r.name in m.runs for r in curved.runs])
        numbers, unexplained = int(stated.counts[own].sum()), float(np.sum((stated.chi2 - stated.counts)[own]))
        removed, unexplained = total - chi2, max(unexplained, 1.0)
        share, left = min(removed / unexplained, 1.0), max((unexplained - removed) / numbers + 1.0, 0.0)
        leads = m is ranked[0][1] or (m.runs == one and chi2 - best < DECISIVE)
        asked = max(unexplained, removed) >= (UNEXPLAINED - 1.0) * numbers
        nearly_all = share > NEARLY_ALL and m.kind != "reading_unit"  # smaller readings leave less of anything
        certain = clear and leads and asked and (nearly_all or (share > BELIEVED and left < CHI2_LEFT))
        turned = m.kind == "direction" and removed > TURNED_ROUND
        if share > MENTIONED or turned:
            evidence.append(SheetEvidence(mistake=m, share=share, certain=certain, gain=alone - chi2))
    return tuple(evidence)


def free_starts(
    campaign: Campaign,
    model: Composition,
    evidence_of_laws: Callable[[Workbench, Fit], UnknownEvidence] | None = None,
) -> tuple[Campaign, tuple[Suspicion, ...]]:
    """The campaign with the state free in which every run begins, and a remark, if its records show no rest and only a
    belt that ran before explains them; the remark alone where that explains most of it; else the campaign, and ().

    A belt at rest leans after a yaw, which every pulley shows in turn; one that ran with the yaw leans already. So does
    one that ran without any, by the faults of its machine: where one is free, the other is.

    evidence_of_laws: of a fit in the linear range (None: none is sought). Where a law says as much with fewer numbers,
    records cannot tell the two: the starts stay as stated, and the remark asks for them and stops a diagnosis.
    """
    curved = _curves_of(campaign)
    begun = [r for r in curved.runs if r.run_in == 0.0 and (not (r.yaw or r.yaw_head) or r.travel[0] >= r.yaw_at)]
    open_runs = [r.name for r in begun]
    if not any(r.yaw or r.yaw_head for r in begun) or not any(s.kind == "lateral" for s in campaign.signals):
        return campaign, ()
    stated = _layout(curved, model)
    excess = stated.total() - stated.count
    if not np.isfinite(excess) or excess < (UNEXPLAINED - 1.0) * stated.count:
        return campaign, ()
    left, cost = stated.total_with_free_starts(open_runs)
    removed = stated.total() - left
    if removed < MENTIONED * excess or stated.total() - stated.total_of_other_models() > OF_MODEL * removed:
        return campaign, ()
    sure, share = removed >= BELIEVED * excess, f"{min(removed / excess, 1.0):.0%} of what the model leaves"
    of_sheet = (_refine(*_screen(m, curved, stated), stated)[0] for m in sheet_mistakes(curved))
    if any(stated.total() - chi2 > BELIEVED * (removed if sure else excess) for chi2 in of_sheet):
        return campaign, ()  # a yaw that came later than stated is told as that
    law_instead = False
    if sure and evidence_of_laws is not None:
        bench = stated.bench
        (fit,) = bench.fit([bench.start([c.id for c in bench.forward.classes], bench.forward.null())])
        least = min((fit.chi2 - law.gain + law.cost for law in evidence_of_laws(bench, fit).laws), default=np.inf)
        law_instead = least < left + cost
    if law_instead:
        said = (
            f"leans already where the record begins, or an unknown law acts ({share}): these records cannot tell; did "
            "the machine run before? If so,"
        )
    elif sure:
        said = f"leans already where the record begins: the machine ran before; its state there is left free ({share});"
        runs = tuple(replace(r, run_in=np.nan) if r.name in open_runs else r for r in campaign.runs)
        campaign = replace(campaign, runs=runs)
    else:
        said = f"may lean already where the record begins ({share}): did the machine run before? If so,"
    sentence = (
        f"the belt of {shortlist(open_runs)} {said} state run_in_m in runs.csv (run_in in an import's mapping): how "
        "far it had run from a straight start, or unknown; where the yaw was on already, yaw_at_m below 0"
    )
    return campaign, (Suspicion(None, (), "running_start", sentence, "stop" if law_instead else "look"),)


class _Layout:
    """A campaign laid out for a model.

    chi2: what is left of every run (R,) when the usual faults are fitted; alone: without any fault; log_det: ln of the
    determinant of the noise's covariance.
    """

    def __init__(self, campaign: Campaign, model: Composition) -> None:
        self.model = model
        classes = [cls for name, cls in library().items() if name in USUAL and model.refusal(cls) is None]
        self.bench, fit = linear_response(campaign, model, classes, planned=False)
        self.counts = np.isfinite(self.bench.samples.y).sum(axis=(1, 2))
        self.count = int(self.counts.sum())
        sound = np.isfinite(fit.columns).all(axis=1)
        self._basis = np.linalg.qr(fit.columns[sound].T)[0]
        self.columns, self.rest = fit.slopes[sound], self.bench.samples.y - fit.values
        self.chi2 = self.chi2_of(self.rest)
        self.alone = self.chi2_of(self.rest, faults=False)
        metric = self.bench.metric
        diagonal = np.diagonal(metric.roots, axis1=-2, axis2=-1)[metric.which]
        self.log_det = -2.0 * float(np.sum(np.log(diagonal[diagonal > 0.0])))

    def total(self, mistake: SheetMistake | None = None) -> float:
        """chi2 of all runs; of a mistake in the unit of readings with their scale allowed for."""
        return float(np.sum(self.chi2)) - (2.0 * mistake.log_jacobian * self.count if mistake else 0.0)

    def total_without(self, mistake: SheetMistake, rest: np.ndarray | None = None) -> float:
        """The same of the campaign with a mistake undone, by the nuisances of this layout; rest: as in ``rest_of``, of
        the same mistake in all runs, where that is known."""
        own = np.array([not mistake.runs or r.name in mistake.runs for r in self.bench.samples.runs])
        rest = self.rest_of(mistake.campaign, own) if rest is None else np.where(own[:, None, None], rest, self.rest)
        return float(np.sum(self.chi2_of(rest))) - 2.0 * mistake.log_jacobian * self.count

    def total_with_free_starts(self, runs: Collection[str]) -> tuple[float, float]:
        """chi2 of all runs with the state free in which the belt of some ``runs`` begins, and what these numbers must
        earn [chi2]: ln of the determinant of the covariance with them, over that without."""
        bench, forward = self.bench, self.bench.forward
        free = start_shapes(forward, forward.null(), runs)
        own = np.array([r.name in runs for r in bench.samples.runs])[:, None, None]
        for s in range(len(bench.samples.signals)):
            zero = own * FREE_ZERO * (np.arange(len(bench.samples.signals)) == s)[:, None]
            free.append(np.broadcast_to(zero, bench.samples.y.shape))
        shapes = np.concatenate([bench.shapes, free])
        metric = metric_of(bench.samples, bench.levels, shapes, bench.shared)
        basis = np.linalg.qr(metric.whiten(self.columns).T)[0]
        white = metric.whiten(self.rest)
        left = white - basis @ (basis.T @ white)
        by_run = [bench.metric.noise_white(each).swapaxes(0, 1) for each in (bench.shapes, shapes)]  # (R, K, m)
        before, after = (np.linalg.slogdet(w @ w.swapaxes(1, 2) + np.eye(w.shape[1]))[1].sum() for w in by_run)
        return float(left @ left), float(after - before)

    def total_of_other_models(self) -> float:
        """The least chi2 that another base model without an effect of its own leaves without any mistake."""
        others = [m for m in map(MODELS.__getitem__, BASE_MODELS) if not m.built_in and m.name != self.model.name]
        return min(float(np.sum(self.chi2_of(self.rest_of(self.bench.campaign, model=other)))) for other in others)

    def chi2_of(self, rest: np.ndarray | None, *, faults: bool = True) -> np.ndarray:
        """chi2 of every run (R,) of what is left of its readings (R, S, n); infinite where nothing is predicted."""
        if rest is None or not np.isfinite(rest[np.isfinite(self.bench.samples.y)]).all():
            return np.full(len(self.bench.samples.runs), np.inf)
        white = self.bench.metric.whiten(rest)
        white = white - self._basis @ (self._basis.T @ white) if faults else white
        return np.sum(white.reshape(len(rest), -1) ** 2, axis=1)

    def rest_of(
        self, campaign: Campaign, own: np.ndarray | None = None, model: Composition | None = None
    ) -> np.ndarray | None:
        """What is left of readings (R, S, n) where they, settings or the model are others; None where that says
        nothing. own: the runs (R,) in which they are others; None: all."""
        if any(r.yaw_at >= r.travel[-1] for r in campaign.runs):
            return None
        samples = samples_of(campaign, leave_out_bad=False)  # they are left out of the stated campaign
        if samples.y.shape != self.bench.samples.y.shape:
            return None
        which = np.arange(len(samples.runs)) if own is None else np.flatnonzero(own)
        compiled = self.bench.forward.classes if model is None else ()  # a program that is compiled already
        forward = Forward(samples, model or self.model, compiled).of_runs(which)
        rest, y = self.rest.copy(), samples.y[which]
        rest[which] = np.where(np.isnan(y), 0.0, y - forward.values(forward.null()[None])[0])  # blank about the yaw
        return rest


@lru_cache(1)
def _curves_of(campaign: Campaign) -> Campaign:
    """The runs of a campaign that have curves, without bad readings."""
    return leave_out_bad_readings(replace(campaign, runs=tuple(r for r in campaign.runs if len(r.travel)), steady=()))[
        0
    ]


#: the layout of a campaign, which several questions share
_layout = lru_cache(1)(_Layout)
#: lets go of the layout that is kept, once all has been asked of it
forget_layout = _layout.cache_clear


def _screen(mistake: SheetMistake, campaign: Campaign, stated: _Layout) -> tuple[float, SheetMistake]:
    """chi2 with the mistake in all runs, or in those alone in which it helps."""
    rest = stated.rest_of(mistake.campaign)
    chi2 = np.inf if rest is None else stated.total_without(mistake, rest)
    if mistake.kind not in BY_RUN:
        return chi2, mistake
    # which runs it helps is asked without faults: one that is free would take the mistake of some runs to all
    alone = stated.chi2_of(rest, faults=False)
    helped = [r.name for r, a, b in zip(campaign.runs, stated.alone, alone, strict=True) if a - b > GAIN_OF_A_RUN]
    oddest = campaign.runs[int(np.argmax(np.nan_to_num(stated.alone - alone, nan=-np.inf)))].name
    parts = [names for names in {tuple(helped), (oddest,)} if 0 < len(names) < len(campaign.runs)]
    tried = [(stated.total_without(m, rest), m) for m in (replace(mistake, runs=names) for names in parts)]
    return min([(chi2, mistake), *tried], key=lambda f: f[0])


def _refine(chi2: float, mistake: SheetMistake, stated: _Layout) -> tuple[float, SheetMistake]:
    """The mistake of the size that fits best, where its size is free."""
    if mistake.kind not in CONTINUOUS or chi2 > stated.total():
        return chi2, mistake

    def misfit(logarithm: float) -> float:
        return min(stated.total_without(replace(mistake, size=float(np.exp(logarithm)))), 1e300)

    # golden section (scipy.optimize takes a quarter of a second to import), then the vertex of a parabola
    at = float(np.log(mistake.size))
    low, high = at - SIZE_REACH, at + SIZE_REACH
    left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    tried = {left: misfit(left), right: misfit(right)}
    while len(tried) < REFINED - 1:
        if tried[left] < tried[right]:
            high, right = right, left
            new = left = high - GOLDEN * (high - low)
        else:
            low, left = left, right
            new = right = low + GOLDEN * (high - low)
        tried[new] = misfit(new)
    places = sorted(tried)
    middle = min(max(places.index(min(tried, key=tried.__getitem__)), 1), len(places) - 2)
    near = np.array(places[middle - 1 : middle + 2])
    bend, slope, _ = np.polyfit(near - near[1], [tried[x] for x in near], 2)
    if bend > 0.0 and low <= (vertex := float(near[1] - slope / (2.0 * bend))) <= high:
        tried[vertex] = misfit(vertex)
    best = min(tried, key=tried.__getitem__)
    return (tried[best], replace(mistake, size=float(np.exp(best)))) if tried[best] < chi2 else (chi2, mistake)


# What a campaign's runs leave open whatever they measure: no second tension, no opposite yaw, no repeat ...


NOISY = 2.0  # times the usual scatter
SPANS_OF_START = 3.0  # a record shorter than so many spans shows the start of the movement only


def find_doubts(
    campaign: Campaign, model: Composition, *, planned: bool, known: Sequence[Suspicion] = ()
) -> tuple[Doubt, ...]:
    """Slips in the data and in the sheet first, those that are ``known`` before them, then what the plan lacks."""
    found = []
    if not planned:
        slips = (*check_repeats(campaign), *known, *suspicions(campaign))
        settled = any(s.severity == "stop" for s in slips)
        of_sheet = () if settled else sheet_evidence(campaign, model)
        for s in (*slips, *(e.suspicion for e in of_sheet)):
            found.append(Doubt(kind=s.kind, sentence=str(s), stops=s.severity == "stop"))
    found += [Doubt(kind="harm", sentence=s) for s in harm_warnings(campaign)]
    levels: dict[str, dict[str, float]] = defaultdict(dict)
    for record in records_of(campaign):
        levels[record.sheet.name][record.run.name] = record.measured_noise
    for signal, of_run in levels.items():
        usual = float(np.median([*of_run.values()]))
        noisy = [f"{run} ({level / usual:.2g} times)" for run, level in of_run.items() if level > NOISY * usual > 0.0]
        if noisy:
            where = f"in {', '.join(noisy)} than in the other runs; look at its sensor there"
            found.append(Doubt(kind="noise", sentence=f"{signal} scatters more {where}"))
    runs, curved = campaign.runs, [r for r in campaign.runs if len(r.travel)]
    span, signs = float(rig_of(campaign).span_length), {np.sign(r.yaw) for r in runs}
    lacking = []
    if len({round(r.tension / 1e3) for r in runs}) < 2:
        lacking.append("there is one tension; a second one tells what belongs to the belt's stiffness or its sag")
    if not signs >= {-1.0, 1.0}:
        told = "there is one sign of yaw; the other one tells what the machine does by itself from what yaw does"
        lacking.append(told)
    if not any(r.yaw == 0.0 and r.yaw_head == 0.0 for r in runs):
        lacking.append("there is no run at zero yaw; one shows what the machine does by itself, and the noise")
    if not any(r.repeat_of for r in runs):
        lacking.append("no run is repeated; noise is read off repeats, and is taken as stated without")
    if len({r.direction for r in runs}) < 2:
        told = "there is one direction of travel; one reversed run tells offsets of a pulley from skewed rollers"
        lacking.append(told)
    if curved and all(r.travel[-1] - r.yaw_at < SPANS_OF_START * span for r in curved):
        told = f"no record reaches {SPANS_OF_START:g} spans ({SPANS_OF_START * span:.0f} m)"
        lacking.append(f"{told}: late drift is hardly in it")
    if curved and len(campaign.signals) < 2:
        told = "there is one signal; a second point, at the other pulley, tells drift from a belt that stands askew"
        lacking.append(told)
    found += [Doubt(kind="plan", sentence=s) for s in lacking]
    if campaign.source.kind != "synthetic":  # what the sheet states as perfect that no instrument is
        if perfect := [s.name for s in campaign.signals if s.zero == 0.0]:
            said = f"zero of {', '.join(perfect)} is not stated and counts as perfect; state how well y = 0 is known"
            found.append(Doubt(kind="sheet", sentence=said))
        if campaign.settings.yaw_u == 0.0:
            found.append(Doubt(kind="sheet", sentence="settings.yaw is not stated: every yaw counts as exact"))
    return tuple(found)


# The smallest size of an effect that the readings would show: seen nine times in ten, named by chance in one of twenty
# campaigns.


FALSE_ALARM, MISSED = 0.05, 0.1
NO_COLUMN = 1e-9  # whitened size of a column that is not there


def visible(bench: Workbench, fit: Fit) -> list[Visible]:
    """Every effect by the parameter that shows best, those that show best first."""
    chance = 0.5 * FALSE_ALARM / max(len(bench.forward.classes), 1)  # on either side, of all candidates together
    least = -NormalDist().inv_cdf(chance) - NormalDist().inv_cdf(MISSED)  # whitened size that shows
    found = []
    for cls in bench.forward.classes:
        best, strength = _best_column(bench, fit, cls.id)
        slot = bench.forward.slots[best]
        most, share = prior_sigma(bench.forward, [best])[0] * slot.scale, least / strength if strength else math.inf
        found.append(
            Visible(
                effect=cls.id,
                parameter=slot.name,
                unit=slot.parameter.unit,
                meaning=slot.parameter.meaning,
                smallest=share * most if strength else None,
                largest_plausible=most,
                share=share,
            )
        )
    return sorted(found, key=lambda v: v.share)


def _best_column(bench: Workbench, fit: Fit, name: str) -> tuple[int, float]:
    """Position of the parameter of an effect that shows best, and its whitened size at the largest that a machine could
    have; 0 where nothing shows.
    """
    own = bench.forward.index(name)
    length = np.linalg.norm(fit.columns[own], axis=1)
    sized = np.array([not bench.forward.slots[k].parameter.modifier for k in own])
    strength = np.where(sized & (length > NO_COLUMN), length * prior_sigma(bench.forward, own), 0.0)
    return own[int(np.argmax(strength))], float(np.max(strength))


#: Size at which a pair is judged, in whitened units: an effect that is plain to see.
PLAIN_SIGMAS = 12.0
INDEPENDENT = 1e-9  # of the largest direction of an effect's columns: what is smaller is a sum of the others


def pairs(bench: Workbench, fit: Fit, seen: list[Visible], *, advise: bool) -> list[Pair]:
    """Pairs of visible effects: one, at PLAIN_SIGMAS, leaves less than RESOLVED when the other is fitted in its place;
    advise: with the action of the menu that tells each pair apart best, where the sigma after it is RESOLVED.

    No advice on pairs with SLOWEST effects: a second compilation for each of them would take longer than all else.
    """
    names = [v.effect for v in seen if v.share < 1.0]
    sigma, both = _separations(bench, fit, names), list(combinations(range(len(names)), 2))
    alike = sorted((float(sigma[j, k]), names[j], names[k]) for j, k in both if sigma[j, k] < RESOLVED)
    advice: dict[tuple[str, str], dict[str, Any]] = {}
    if advise and alike:
        asked = [(a, b) for _, a, b in alike if not SLOWEST & {a, b}]
        names = list(dict.fromkeys(name for pair in asked for name in pair))
        light = [k for k, s in enumerate(bench.forward.slots) if s.effect.id not in SLOWEST]
        outlook = Outlook(bench, replace(fit, free=light, columns=fit.columns[light], slopes=fit.slopes[light]))
        own = [k for name in names for k in bench.forward.index(name)]
        further = np.zeros((len(outlook.actions), len(fit.free), outlook.forward.samples.y[0].size))
        further[:, own] = outlook.white(outlook.predict(fit, own)[1]).swapaxes(0, 1)
        after = np.array([_separations(bench, fit, names, f) for f in further])
        for a, b in asked:
            of_pair = after[:, names.index(a), names.index(b)]
            if of_pair.max() >= RESOLVED:  # less is no advice
                best = outlook.actions[int(np.argmax(of_pair))]
                advice[a, b] = {"action": best.words, "sigma_after": float(of_pair.max())}
    return [Pair(effects=(a, b), sigma=sigma, **advice.get((a, b), {})) for sigma, a, b in alike]


def _separations(bench: Workbench, fit: Fit, names: Sequence[str], further: np.ndarray | None = None) -> np.ndarray:
    """Sigmas (n, n) by which one at PLAIN_SIGMAS differs from the other fitted in its place, whichever is less; further
    (k, m): columns of a further run."""
    columns = fit.columns if further is None else np.concatenate([fit.columns, further], axis=1)
    best = [_best_column(bench, fit, name)[0] for name in names]
    targets = PLAIN_SIGMAS / np.linalg.norm(fit.columns[best], axis=1)[:, None] * columns[best]
    left = np.zeros((len(names), len(names)))
    for k, name in enumerate(names):
        span = columns[bench.forward.index(name)]
        span = span[np.linalg.norm(span, axis=1) > NO_COLUMN * np.linalg.norm(span)]
        _, size, rows = np.linalg.svd(span, full_matrices=False)
        rows = rows[size > INDEPENDENT * size.max(initial=0.0)]
        left[:, k] = np.linalg.norm(targets - targets @ rows.T @ rows, axis=1)
    return np.minimum(left, left.T)
