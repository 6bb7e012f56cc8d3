"""Compare a model with a campaign, run by run."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from belt_sim.api.simulate import (
    ModelSpec,
    campaign_model,
    campaign_of,
    effects_of,
    fitted_model,
    refuse_effects,
    validity_limits,
    with_run,
)
from belt_sim.campaign import Campaign, case_of, leave_out_bad_readings
from belt_sim.campaign.types import first_place_inside_span
from belt_sim.curves import late_rates
from belt_sim.diagnosis.errors import (
    drawings,
    error_map,
    locate_failure,
    overall_errors,
    run_errors,
    stiffness_drift,
)
from belt_sim.diagnosis.workbench import Workbench, workbench
from belt_sim.effects.base import Effect
from belt_sim.errors import SimulationError
from belt_sim.io import provenance
from belt_sim.jax_setup import one_blas_thread
from belt_sim.line.march import march_case
from belt_sim.model import AnalyticModel
from belt_sim.results import words
from belt_sim.results.errors import CampaignLabel, Comparison, Drawings, SteadyError

if TYPE_CHECKING:
    from belt_sim.results.diagnosis import FoundEffect

STEADY_TRAVELS = 300.0, 600.0, 1200.0  # [m]; the strip's transient at 4 N/mm2 is longer than 600 m
STEADY_WITHIN = 0.1  # of u: a late rate that changes by less on twice the travel is the steady one


@one_blas_thread
def compare(
    campaign: Campaign | str | Path,
    model: ModelSpec | None = None,
    effects: Any = None,
    *,
    drawn: bool = True,
    config: Any = None,
) -> Comparison:
    """Errors of ``model`` run by run, without and with ``effects``, and where it fails.

    model: an analytic one, by name or object; effects: ids, mappings, .py files, objects, an effects.yaml, or the
    effects of a diagnosis; drawn: whether to prepare drawings; config: what asked for it, for the provenance.
    """
    campaign = campaign_of(campaign)
    curves = any(len(r.travel) for r in campaign.runs)
    spec = campaign_model(model, campaign)
    chosen = fitted_model(spec, curves)
    acting = effects_of(effects)
    refuse_effects(chosen, acting)

    # late rates in steady.csv: modelled by the closed form, or where effects act by runs until they settle
    steady, moving, runs = [], [], {r.name: r for r in campaign.runs}
    for stated in campaign.steady:
        run, u = runs[stated.run], stated.u
        case = case_of(campaign, run)
        if acting and isinstance(chosen, AnalyticModel):
            modelled = np.full(4, np.inf)
            for travel in STEADY_TRAVELS:
                before, modelled = modelled, late_rates(chosen.run(case, acting, travel=travel))
                if np.abs(modelled - before).max() < STEADY_WITHIN * u:
                    break
            else:
                moving.append(run.name)
        else:
            modelled = np.full(4, chosen.steady_rate(case))
        for point in np.flatnonzero(np.isfinite(stated.rates)).tolist():
            measured, rate = float(stated.rates[point]), float(modelled[point])
            own: dict[str, Any] = {"run": run.name, "tension": run.tension, "u": u, "point": point + 1}
            steady.append(SteadyError(**own, measured=measured, modelled=rate, ratio=abs(rate - measured) / u))

    common: dict[str, Any] = {"base_model": chosen.name, "campaign": CampaignLabel.of(campaign), "effects": acting}
    common |= {"steady": tuple(steady), "provenance": provenance(config) | {"data_sha256": campaign.sha256}}
    said = f"with these effects the rate of {words.join_words([*dict.fromkeys(moving)])} has not settled after "
    beyond = (f"{said}{STEADY_TRAVELS[-1]:g} m, where it is taken",) if moving else ()
    if not curves and steady:
        return Comparison(**common, error=None, where=None, per_run=(), beyond=beyond)

    bench = workbench(campaign, fitted_model(chosen), [type(e) for e in acting])
    base, final = bench.forward.null(), parameter_vector(bench, acting)
    before, after = bench.forward.values(np.stack([base, final]))
    drifts = [stiffness_drift(bench, vector) for vector in ([base, final] if acting else [base])] if drawn else []
    limits = validity_warnings(campaign, fitted_model(chosen), acting)
    besides = f" with {words.join_words([e.id for e in acting])}" if acting else ""
    return Comparison(
        **common,
        error=overall_errors(bench, before, after),
        where=locate_failure(error_map(bench, after), f"Model {chosen.name}{besides}"),
        per_run=run_errors(bench, before, after),
        drawings=drawings(bench, before, after if acting else None, after, *drifts) if drawn else Drawings(),
        beyond=(*map(str, leave_out_bad_readings(campaign)[1]), *limits, *beyond),
    )


def parameter_vector(bench: Workbench, effects: Sequence[Effect]) -> np.ndarray:
    """Return the parameter vector of the effects, in the scales of the fit."""
    numbers, q = {type(e): e for e in effects}, bench.forward.null()
    slots = bench.forward.slots
    q[: len(slots)] = [float(getattr(numbers[slot.effect], slot.name)) / slot.scale for slot in slots]
    return q


def validity_warnings(
    campaign: Campaign, model: AnalyticModel, effects: "Sequence[Effect | FoundEffect]"
) -> tuple[str, ...]:
    """A sentence a limit that some runs of a campaign are beyond; runs are marched with effects of the library, or if
    they may slip without any.

    Belts of the virtual rig leave their pulleys like a thread: of synthetic runs nothing is said about lifting off.
    """
    acting = [e for e in effects if isinstance(e, Effect)]
    inside = first_place_inside_span(campaign.signals)
    words = "the belt is too slack for this model, its own stiffness lifts it off the pulleys, and a sensor inside a "
    words += "span excludes strip_lift_off"
    known = ("lift_off",) if campaign.source.kind == "synthetic" else ()
    found = []
    for run in campaign.runs:
        case = case_of(campaign, run)
        beyond = validity_limits(case, model, [*known, *(e.id for e in effects)])
        if inside:
            beyond = tuple(replace(x, words=words) if x.id == "bending_layer" else x for x in beyond)
        if (acting or (not effects and any(x.id == "slip" for x in beyond))) and len(run.travel):
            with suppress(SimulationError):  # what diverges is told by its errors
                curves = march_case(case, model, acting, travel=float(run.travel[-1]))
                beyond = with_run(beyond, case, model, curves, acting)
        found += [(run.name, limit) for limit in beyond]
    sentences = []
    for name in dict.fromkeys(limit.id for _, limit in found):
        runs = [run for run, limit in found if limit.id == name]
        worst = max((limit for _, limit in found if limit.id == name), key=lambda x: x.load)
        many = f"{len(runs)} of {len(campaign.runs)} runs" if len(runs) > 1 else f"run {runs[0]}"
        given = f"{worst.given}, " if worst.given else ""
        sentences.append(f"{given}in {many} {worst.words} ({name}, up to {worst.exceeded_by})")
    return tuple(sentences)
