"""Compare a model with a campaign, run by run."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.api.simulate import (
    ModelSpec,
    campaign_model,
    campaign_of,
    closed_form_model,
    effects_of,
    fitted_model,
    refuse_effects,
    validity_warnings,
)
from belt_sim.campaign import Campaign, case_of, leave_out_bad_readings
from belt_sim.curves import late_rates
from belt_sim.diagnosis.drawings import drawings, label
from belt_sim.diagnosis.errors import cells, locate_failure, overall_errors, run_errors
from belt_sim.diagnosis.workbench import Workbench, workbench
from belt_sim.effects.base import Effect
from belt_sim.io import provenance
from belt_sim.jax_setup import one_blas_thread
from belt_sim.model import Model, SteadyModel
from belt_sim.results import words
from belt_sim.results.errors import Comparison, Drawings, SteadyError

STEADY_TRAVEL = 300.0  # [m]; the strip's transient at 7 N/mm2 is longer than 100 m


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
    chosen = fitted_model(spec) if curves else closed_form_model(spec)
    acting = effects_of(effects)
    refuse_effects(chosen, acting)
    steady = steady_errors(campaign, chosen, acting)
    common: dict[str, Any] = {"base_model": chosen.name, "campaign": label(campaign), "effects": acting}
    common |= {"steady": steady, "provenance": provenance(config) | {"data_sha256": campaign.sha256}}
    if not curves and steady:
        return Comparison(**common, error=None, where=None, per_run=())
    bench = workbench(campaign, fitted_model(chosen), [type(e) for e in acting])
    base, final = bench.forward.null(), parameter_vector(bench, acting)
    before, after = bench.forward.values(np.stack([base, final]))
    shown = (bench, final, after) if acting else None
    limits = validity_warnings(campaign, fitted_model(chosen), acting)
    besides = f" with {words.join_words([e.id for e in acting])}" if acting else ""
    return Comparison(
        **common,
        error=overall_errors(bench, before, after),
        where=locate_failure(cells(bench, after), f"Model {chosen.name}{besides}"),
        per_run=run_errors(bench, before, after),
        drawings=drawings((bench, base, before), shown, mapped=after) if drawn else Drawings(),
        beyond=(*map(str, leave_out_bad_readings(campaign)[1]), *limits),
    )


def parameter_vector(bench: Workbench, effects: Sequence[Effect]) -> np.ndarray:
    """Return the parameter vector of the effects, in the scales of the fit."""
    numbers, q = {type(e): e for e in effects}, bench.forward.null()
    slots = bench.forward.slots
    q[: len(slots)] = [float(getattr(numbers[slot.effect], slot.name)) / slot.scale for slot in slots]
    return q


def steady_errors(
    campaign: Campaign, model: Model | SteadyModel, effects: Sequence[Effect] = ()
) -> tuple[SteadyError, ...]:
    """Measured and modelled late rates of every run and point in steady.csv, against the stated uncertainty.

    The model's are those of its closed form, or of a long run where effects act.
    """
    runs, rows = {r.name: r for r in campaign.runs}, []
    for stated in campaign.steady:
        run, u = runs[stated.run], stated.u
        case = case_of(campaign, run)
        if effects and isinstance(model, Model):
            modelled = late_rates(model.run(case, effects, travel=STEADY_TRAVEL))
        else:
            assert isinstance(model, SteadyModel)
            modelled = np.full(4, model.steady_rate(case))
        for point in np.flatnonzero(np.isfinite(stated.rates)).tolist():
            measured, rate = float(stated.rates[point]), float(modelled[point])
            own: dict[str, Any] = {"run": run.name, "tension": run.tension, "u": u, "point": point + 1}
            rows.append(SteadyError(**own, measured=measured, modelled=rate, ratio=abs(rate - measured) / u))
    return tuple(rows)
