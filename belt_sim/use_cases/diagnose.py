"""Diagnose: which physical effect a model lacks, judged on a campaign."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

from belt_sim.analytic.model import AnalyticModel
from belt_sim.campaign import Campaign
from belt_sim.diagnosis.admission import admit
from belt_sim.diagnosis.answer.nextrun import next_runs
from belt_sim.diagnosis.describe import describe
from belt_sim.diagnosis.drawings import drawings_of, overlays
from belt_sim.diagnosis.examine import BOOTSTRAPS, Findings, examine
from belt_sim.diagnosis.left_over.unknown import Unknown
from belt_sim.discovery.describe import describe as describe_discovery
from belt_sim.discovery.look import Looking, Seen
from belt_sim.effects.base import Effect
from belt_sim.errors import InputError
from belt_sim.results.diagnosis import Diagnosis
from belt_sim.results.discovery import Discovery
from belt_sim.results.drawings import Drawings
from belt_sim.results.found import NextRun
from belt_sim.use_cases.asked import candidates_of, fitted_model
from belt_sim.use_cases.beyond import beyond_in_runs
from belt_sim.whole_number import whole

MIN_BOOTSTRAPS, MAX_BOOTSTRAPS = 100, 100_000


def diagnose(
    campaign: Campaign,
    model: Any = "strip",
    effects: Any = None,
    *,
    bootstraps: int = BOOTSTRAPS,
    seed: int = 0,
    leave_out: Sequence[str] | None = None,
    advise: bool = True,
    progress: Callable[[int, str], None] = lambda replicates, stage: None,
    tell: Callable[[str], None] = lambda line: None,
    shown: Callable[[Diagnosis], None] = lambda found: None,
    config: Any = None,
) -> Diagnosis:
    """Which of the candidates ``effects`` (None: the library) the analytic ``model`` lacks.

    effects: ids, .py files of your own (tested before any long work; ``tell`` hears what the test says) or Effect
    classes; leave_out: ids of the library not to be tried; advise: look for the next run to make; progress(replicates,
    stage): told of every stage, and of bootstrap replicates as they are done; shown: is given the result as soon as it
    can be drawn, without the next runs and what was discovered beside effects; config: what asked for it, for the
    provenance. Raises InputError, CannotRepresent, RunFailed.
    """
    whole("seed", seed, 0)
    whole("bootstraps", bootstraps, MIN_BOOTSTRAPS, MAX_BOOTSTRAPS)
    if not any(s.kind == "lateral" for s in campaign.signals):
        raise InputError(
            "signals", "no point", "", "a diagnosis needs the lateral position of at least one of points 1-4"
        )
    measured = [run for run in campaign.runs if len(run.travel)]
    if measured and all(run.use == "hold_out" for run in measured):
        raise InputError("hold_out", "all runs", "", "leave at least one run to fit to")
    chosen = fitted_model(model)
    classes = candidates_of(effects, chosen, leave_out)
    admitted = admission(classes, chosen, campaign)
    for line in admitted:
        tell(line)
    findings = examine(
        campaign,
        chosen,
        classes,
        bootstraps=bootstraps,
        seed=seed,
        look=Looking(seed=seed, tell=lambda stage: progress(0, stage)),
        tell=lambda stage: progress(0, stage),
        tick=lambda replicates: progress(replicates, ""),
    )
    with ThreadPoolExecutor(3) as beside:
        discovery = beside.submit(_discovery, findings.judgement.unknown, config)
        advice = beside.submit(_advice, findings, lambda stage: progress(0, stage)) if advise else None
        drawings = beside.submit(drawings_of, findings)
        found = describe(findings, seed=seed, config=config)
        found = replace(found, admitted=admitted, drawings=drawings.result())
        if not found.effects:  # what is drawn is the law
            found = replace(found, discovery=discovery.result(), drawings=_with_law(found.drawings, findings))
        shown(found)
        beyond = beyond_in_runs(campaign, chosen, [e.id for e in found.effects])
    runs = tuple(advice.result()) if advice is not None else ()
    return replace(found, beyond=beyond, discovery=discovery.result(), next_runs=runs)


def _advice(findings: Findings, tell: Callable[[str], None]) -> list[NextRun]:
    """The next runs to make, where there is something to be told apart."""
    if not findings.rivals:
        return []
    tell("looking for the run that would tell them apart")
    return next_runs(findings.found.bench, findings.found.chosen, findings.rivals)


def _discovery(seen: Unknown | None, config: Any) -> Discovery | None:
    """What the search for laws has seen, where there was one."""
    return describe_discovery(seen.discovered, config=config) if isinstance(seen, Seen) else None


def _with_law(drawings: Drawings, findings: Findings) -> Drawings:
    """The same with curves of the law that was discovered, where one was."""
    seen = findings.judgement.unknown
    law = seen.discovered.refit if isinstance(seen, Seen) else None
    if law is None:
        return drawings
    return replace(drawings, overlays=overlays(findings.bench, findings.found.base.values, law.fit.values))


def admission(classes: Sequence[type[Effect]], model: AnalyticModel, campaign: Campaign) -> tuple[str, ...]:
    """What the admission test says of effects of one's own; raises InputError naming the first thing that is wrong."""
    own = [c for c in classes if getattr(c, "source_file", None)]
    return tuple(line for cls in own for line in admit(cls, model, campaign))
