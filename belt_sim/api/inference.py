"""Diagnose which effect a model lacks, discover a law that no library holds, fit numbers of effects."""

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.api.check import admit
from belt_sim.api.compare import parameter_vector, validity_warnings
from belt_sim.api.simulate import (
    ModelSpec,
    campaign_model,
    campaign_of,
    candidates_of,
    effects_of,
    fitted_model,
    refuse_effects,
)
from belt_sim.campaign import Campaign, suspicions
from belt_sim.campaign.kinematics import check_repeats
from belt_sim.diagnosis.decide import POLICY, probability_of_unknown
from belt_sim.diagnosis.describe import describe, drawings_of, rivals
from belt_sim.diagnosis.examine import BOOTSTRAPS, compile_ahead, examine, free_zeros
from belt_sim.diagnosis.fit import Fit, covariance_root, step_bounds
from belt_sim.diagnosis.foresight import forget_layout, free_starts, sheet_evidence
from belt_sim.diagnosis.next_run import next_runs
from belt_sim.diagnosis.plausibility import CORRELATED, inseparable_numbers, prior_sigma
from belt_sim.diagnosis.workbench import Workbench, workbench
from belt_sim.discovery.responses import curve_row
from belt_sim.discovery.search_data import search_data_of
from belt_sim.discovery.selection import LawSearch, SearchOutcome, search_law, unknown_evidence
from belt_sim.discovery.words import describe_discovery
from belt_sim.effects.base import Effect, library
from belt_sim.errors import InputError, flag, whole
from belt_sim.jax_setup import begin_in_thread, one_blas_thread
from belt_sim.results import words
from belt_sim.results.diagnosis import SURE_APART, Diagnosis, Discovery, NextRun
from belt_sim.results.estimates import MachineSizes, display_unit
from belt_sim.results.words import Display, Table
from belt_sim.show.terminal import stages_shown

MIN_BOOTSTRAPS, MAX_BOOTSTRAPS = 100, 100_000


@one_blas_thread
def diagnose(
    campaign: Campaign | str | Path,
    model: ModelSpec | None = None,
    effects: Any = None,
    *,
    bootstraps: int = BOOTSTRAPS,
    seed: int = 0,
    leave_out: Sequence[str] | None = None,
    checked: bool = False,
    advise: bool = True,
    progress: Callable[[int, str], None] | None = None,
    tell: Callable[[str], None] = lambda line: None,
    shown: Callable[[Diagnosis], None] = lambda found: None,
    config: Any = None,
) -> Diagnosis:
    """Which of the candidates ``effects`` (None: the library) the analytic ``model`` lacks.

    model: None: chosen by tension (``belt_sim.api.simulate.campaign_model``); effects: ids, .py files of your own
    (tested before any long work; ``tell`` hears what the test says) or Effect classes; leave_out: ids of the
    library not to be tried; checked: data and sheet are right, whatever looks wrong in them; advise: look for the next
    run to make; bootstraps: campaigns simulated with nothing missing, which tell how much chance gains;
    progress(replicates, stage): told of every stage, and of these campaigns (None: a bar in a terminal or notebook);
    shown: is given the result without the next runs; config: what asked for it, for the provenance. Raises InputError,
    CannotRepresent, SimulationError.
    """
    campaign = campaign_of(campaign)
    flag("checked", checked), flag("advise", advise)
    whole("seed", seed, 0)
    whole("bootstraps", bootstraps, MIN_BOOTSTRAPS, MAX_BOOTSTRAPS)
    beside = beside_points(campaign)
    measured = [run for run in campaign.runs if len(run.travel)]
    if measured and all(run.use == "hold_out" for run in measured):
        raise InputError("hold_out", "all runs", "", "leave at least one run to fit to")
    chosen = fitted_model(campaign_model(model, campaign))
    classes = candidates_of(effects, chosen, leave_out)
    admitted = [line for c in classes if getattr(c, "source_file", None) for line in admit(c, chosen, campaign)]
    if beside:
        admitted.append(f"{', '.join(beside)}: not at points 1-4, so no unknown law is sought")
    for line in admitted:
        tell(line)
    begin_in_thread(partial(compile_ahead, campaign, chosen, classes))  # beside what comes before the examination
    bar = stages_shown(f"diagnosing {campaign.title}") if progress is None else nullcontext(progress)
    with bar as stages:
        tell_stage = partial(stages, 0)
        own, running = free_starts(campaign, chosen, None if beside else LawSearch().evidence_of_unknown)
        of_data = (*suspicions(own), *check_repeats(own))
        settled = checked or any(s.severity == "stop" for s in (*running, *of_data))
        of_sheet = () if settled else sheet_evidence(free_zeros(own, of_data), chosen, tell_stage)
        forget_layout()
        doubtful = [*running, *(e.suspicion for e in of_sheet if e.certain)]
        laws = LawSearch(tell_stage)
        findings = examine(
            own, chosen, classes, bootstraps=bootstraps, seed=seed, doubts=doubtful, checked=checked,
            laws=None if beside else laws, tell=tell_stage,
        )  # fmt: skip
        if not any(s.severity == "stop" for s in findings.suspicions):  # mistakes that explain more are told beside
            better = [e for e in of_sheet if e.gain > findings.decision.explanations[0].gain]
            told = [e.suspicion for e in better if e.gain > better[0].gain - SURE_APART**2]
            turned = [e for e in of_sheet if e.mistake.kind == "direction" and e not in better]
            told += [replace(e.suspicion, kind="travel") for e in turned]  # it explains less than the effects
            findings = replace(findings, suspicions=(*findings.suspicions, *told))
        stages(bootstraps, "")
        found = replace(describe(findings, seed=seed, config=config), drawings=drawings_of(findings))
        if {cls.id for cls in candidates_of(None, chosen)} - {cls.id for cls in classes}:
            found = replace(found, asked_for=len(classes))
        if findings.law is not None:
            sure = findings.decision.probability_of_unknown
            found = replace(found, discovery=describe_discovery(findings.law.outcome, sure, config=config))
        shown(found)
        named = all(e.id in library() for e in found.effects)
        limits = validity_warnings(campaign, chosen, effects_of(list(found.effects)) if named else found.effects)
        runs: Sequence[NextRun] = ()
        if advise and (alike := rivals(findings)):
            tell_stage("choosing the best further run")
            runs = next_runs(findings.fitted_bench, findings.named, alike)
        return replace(found, admitted=tuple(admitted), beyond=limits, next_runs=tuple(runs))


def beside_points(campaign: Campaign) -> list[str]:
    """Names of the signals that stand at none of points 1-4 and mid-span, which the search for laws does not know.

    Raises InputError without the lateral position of any point.
    """
    if not any(s.kind == "lateral" for s in campaign.signals):
        remedy = "this needs the lateral position of at least one of points 1-4; belt-sim compare does without"
        raise InputError("signals", "no point", "", remedy)
    return [s.name for s in campaign.signals if curve_row(s.at, 1.0) is None]


@one_blas_thread
def discover(
    campaign: Campaign | str | Path,
    model: ModelSpec | None = None,
    effects: Any = None,
    *,
    tell: Callable[[str], None] = lambda stage: None,
    config: Any = None,
) -> Discovery:
    """What the analytic ``model`` lacks beside ``effects``, whose numbers are fitted anew together.

    effects: as for ``compare``; tell: hears every stage; config: what asked for it, for the provenance.

    Raises InputError, CannotRepresent.
    """
    campaign = campaign_of(campaign)
    if others := beside_points(campaign):
        remedy = "laws are sought at points 1-4 only; leave these signals out"
        raise InputError("signals", ", ".join(others), "", remedy)
    chosen, acting = fitted_model(campaign_model(model, campaign)), effects_of(effects)
    refuse_effects(chosen, acting)
    bench = workbench(free_starts(campaign, chosen)[0], chosen, [type(e) for e in acting])
    vector = parameter_vector(bench, acting)
    bench = bench.moved_to(vector)
    fit: Fit = bench.fit([bench.start([e.id for e in acting], vector)])[0]
    tell("fitted what is known")
    data = search_data_of(bench, fit)
    evidence, latent_inputs = unknown_evidence(data)
    probability = probability_of_unknown(evidence, POLICY)
    nothing = 1.0 - probability > POLICY.alarm
    outcome = SearchOutcome(data=data, latent_inputs=())
    outcome = outcome if nothing else search_law(data, tell, latent_inputs=latent_inputs)
    said = describe_discovery(outcome, probability, config=config)
    if not said.found:
        return said
    beside = f"beside {words.join_words([e.id for e in acting])}" if acting else "and no effect of the catalogue"
    only = f"Only a law was sought, {beside}: one or two known effects may explain as much. bs.diagnose tries them."
    return replace(said, limits=(*said.limits, only))


REJECTED = 1e-3  # probability of so large a chi2, below which the model does not describe the readings


@dataclass(frozen=True, kw_only=True, repr=False)
class FitResult(Display):
    """Numbers that fit a campaign best: values and standard uncertainties u by name ("taper.kappa_t") in SI.

    covariance (k, k): in the order of ``values``; effects: with these numbers, for ``simulate`` and ``compare``;
    chi2: before and after; degrees: of freedom; rms [m]: of the lateral signals, before and after; unbound: names of
    numbers that the readings do not bound within what a machine could have; notes: what else the fit leaves open;
    machine: its sizes, in which people read the numbers.
    """

    values: dict[str, float]
    u: dict[str, float]
    covariance: np.ndarray
    effects: tuple[Effect, ...]
    chi2: tuple[float, float]
    degrees: int
    rms: tuple[float, float]
    unbound: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    machine: MachineSizes | None = None

    @property
    def correlation(self) -> np.ndarray:
        """Correlations (k, k) of the numbers, in the order of ``values``."""
        u = np.array(list(self.u.values()))
        return self.covariance / np.outer(u, u)

    def lines(self) -> Sequence[str]:
        """Statistics, a line a number, and what the fit leaves open, in the form of lmfit's fit_report."""
        (none, rms), texts = (1e3 * r for r in self.rms), {row[0]: row[1] for row in self.tables()[0].rows}
        rows = {
            "# data points": f"{self.degrees + len(texts)}",
            "# variables": f"{len(texts)}",
            "chi-square": f"{self.chi2[1]:.1f} (without effects {self.chi2[0]:.1f})",
            "reduced chi-square": f"{self.chi2[1] / max(self.degrees, 1):.3f}",
            "rms": f"{rms:.4f} mm (without effects {none:.4f})",
        }
        said = ["[[Fit Statistics]]", *(f"    {name:18s} = {text}" for name, text in rows.items())]
        said += ["[[Variables]]", *(f"    {name}: {text}" for name, text in texts.items())]
        return [*said, *(["[[Left open]]"] if self.notes else []), *(f"    {note}" for note in self.notes)]

    def tables(self) -> Sequence[Table]:
        """Values with their uncertainties in units of the shop, a row a number."""
        rows, units = [], _units(self.effects, self.machine)
        for name, value in self.values.items():
            factor, unit = units[name]
            bound = words.with_u(factor * value, factor * self.u[name], unit) if name not in self.unbound else ""
            rows.append((name, bound or "not bound by these readings"))
        return [Table("numbers, ± 1 sigma", ("name", "value"), rows, left=("name", "value"))]


def _units(effects: Sequence[Effect], machine: MachineSizes | None) -> dict[str, tuple[float, str]]:
    """Units of the shop in one of SI, and their names, of all numbers of effects."""
    return {
        f"{e.id}.{n}": display_unit(e.id, n, p.unit, machine) for e in effects for n, p in type(e).parameters.items()
    }


def _fit_notes(bench: Workbench, found: Fit, names: Sequence[str], scales: np.ndarray, degrees: int) -> list[str]:
    """What a fit leaves open, a sentence each: a rejected model, ends at bounds, numbers that cannot be told apart with
    the sums that are known, correlations beyond CORRELATED."""
    from scipy.special import chdtrc

    notes = []
    if degrees > 0 and chdtrc(degrees, found.chi2) < REJECTED:
        notes.append("the model is rejected by these readings: the numbers are effective values, their u too small")
    down, up = step_bounds(found, bench.forward.sides)
    notes += [f"{n} is at its bound" for n, a, b in zip(names, down, up, strict=True) if a >= 0.0 or b <= 0.0]
    root, acting = covariance_root(found.columns), bench.forward.effects_at(found.vector, found.ids)
    units = _units(acting, bench.machine)
    shop = np.array([units[n][0] for n in names]) * scales
    apart: set[int] = set()
    for group in inseparable_numbers(bench.forward, found):
        apart |= {*group.members}
        sums = []
        for weights in group.sums:
            first = int(np.flatnonzero(weights == 1.0)[0])
            parts = [(k, weights[k] * shop[first] / shop[k]) for k in np.flatnonzero(weights).tolist() if k != first]
            terms = "".join(f" {'+' if w > 0.0 else '−'} {words.number(abs(w))}·{names[k]}" for k, w in parts)
            value, u = weights @ found.vector[found.free], np.linalg.norm(weights @ root)
            shown = words.with_u(value * shop[first], u * shop[first], units[names[first]][1])
            sums.append(f"{names[first]}{terms} = {shown}")
        members = ", ".join(names[k] for k in group.members)
        notes.append(f"these readings cannot separate {members}; they fix {'; '.join(sums)}")
    u = np.maximum(np.linalg.norm(root, axis=1), 1e-300)
    correlation = root @ root.T / np.outer(u, u)
    pairs = [(j, k) for k in range(len(names)) for j in range(k) if not {j, k} <= apart]
    notes += [f"{names[j]} and {names[k]}: correlation {correlation[j, k]:+.2f}"
              for j, k in pairs if abs(correlation[j, k]) > CORRELATED]  # fmt: skip
    return notes


@one_blas_thread
def fit(campaign: Campaign | str | Path, effects: Any, model: ModelSpec | None = None) -> FitResult:
    """The numbers of ``effects`` that fit a campaign best, with their covariance: nonlinear least squares on the march.

    Readings are weighted by their noise; what the campaign states with an uncertainty (tension, yaw, stiffness, zero,
    gain of every run) may be off by as much and counts in the covariance. Runs held out are not used.

    effects: as in ``simulate``; the search starts at their numbers, those of a bare name ("taper") at the effect's
    default or zero. Every effect must have a hand in the readings there: give a start to those whose shape is a number
    (a weld's place, a time).

    Raises:
        InputError: no effect is given, or a number moves no reading where the search starts.
    """
    campaign, asked = campaign_of(campaign), effects if isinstance(effects, list | tuple) else [effects]
    start = effects_of([library()[e]() if isinstance(e, str) and e in library() else e for e in asked])
    chosen = fitted_model(campaign_model(model, campaign))
    if not start:
        raise InputError("effects", effects, "", "name at least one, like effects=['taper']")
    refuse_effects(chosen, start)
    campaign, running = free_starts(campaign, chosen)
    bench = workbench(campaign, chosen, [type(e) for e in start])
    ids = [e.id for e in start]
    vector, slots = parameter_vector(bench, start), bench.forward.slots
    free = bench.start(ids, vector).free  # but for what moves no reading whatever its effect's size: a missing sensor
    anywhere = np.array([0.0 if s.parameter.modifier else 1.0 for s in slots] + [0.0] * (len(vector) - len(slots)))
    slopes = bench.forward.expand(vector + anywhere, free)[1]
    seen = np.isfinite(bench.fitted.y)
    idle = [k for k, slope in zip(free, slopes, strict=True) if not np.nan_to_num(slope[seen]).any()]
    unseen = [f"{slots[k].effect.id}.{slots[k].name}" for k in idle]
    free = [k for k in free if k not in idle]
    if len({slots[k].effect.id for k in free}) < len(ids):
        raise InputError(unseen[0], 0, "", "moves no reading of this campaign; has it the sensor that would show it?")
    found = bench.fit([bench.start(ids, vector, free)])[0]
    bench = bench.moved_to(found.vector)
    found = bench.fit([bench.start(ids, found.vector, free)])[0]
    fitted = [bench.forward.slots[k] for k in found.free]
    names = [f"{s.effect.id}.{s.name}" for s in fitted]
    still = [name for name, column in zip(names, found.columns, strict=True) if not column.any()]
    if still:
        raise InputError(still[0], 0, "", "moves no reading where the search starts; start elsewhere")
    left_out = [f"{', '.join(unseen)}: no reading of this campaign shows it; not fitted"] if unseen else []
    scales = np.array([s.scale for s in fitted])
    covariance = found.covariance * np.outer(scales, scales)
    degrees = int(seen.sum()) - len(names)
    lateral = [k for k, s in enumerate(bench.samples.signals) if s.kind == "lateral"]
    nothing, after = bench.forward.values(np.stack([bench.forward.null(), found.vector]))
    before, now = (bench.fitted.y - values for values in (nothing, after))
    rms = [float(np.sqrt(np.nanmean(apart[:, lateral] ** 2))) for apart in (before, now)]
    # numbers that the readings do not bound: one sigma is more than a machine could have
    spread, known = np.sqrt(np.diag(found.covariance)), prior_sigma(bench.forward, found.free)
    return FitResult(
        values=dict(zip(names, (found.vector[found.free] * scales).tolist(), strict=True)),
        u=dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True)),
        covariance=covariance,
        effects=bench.forward.effects_at(found.vector, ids),
        chi2=(float(bench.metric.chi2(before)), found.chi2),
        degrees=degrees,
        unbound=tuple(n for n, u, most in zip(names, spread, known, strict=True) if u > most),
        notes=(*map(str, running), *left_out, *_fit_notes(bench, found, names, scales, degrees)),
        rms=(rms[0], rms[1]),
        machine=bench.machine,
    )
