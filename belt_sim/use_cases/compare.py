"""Compare: a model, with or without effects, against a campaign."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from belt_sim.campaign import Campaign, case_of
from belt_sim.case import Case
from belt_sim.curves import late_rates
from belt_sim.diagnosis.describe import label
from belt_sim.diagnosis.drawings import drawings
from belt_sim.diagnosis.errors.run_errors import overall_errors, run_errors
from belt_sim.diagnosis.errors.where import where
from belt_sim.diagnosis.fits.workbench import Workbench, workbench
from belt_sim.effects.base import Effect
from belt_sim.model import Model, SteadyModel
from belt_sim.provenance import provenance
from belt_sim.results.comparison import Comparison
from belt_sim.results.drawings import Drawings
from belt_sim.results.errors import SteadyError
from belt_sim.use_cases.asked import analytic, effects_of, fitted_model, refuse
from belt_sim.use_cases.beyond import beyond_in_runs

STEADY_TRAVEL = 300.0  # [m]; the strip's transient at 7 N/mm2 is longer than 100 m


def compare(
    campaign: Campaign, model: Any = "strip", effects: Any = None, *, drawn: bool = True, config: Any = None
) -> Comparison:
    """Errors of ``model`` run by run, without and with ``effects``, and where it fails.

    model: an analytic one, by name or object; effects: ids, mappings, .py files, objects, an effects.yaml, or the
    effects of a diagnosis; drawn: whether to prepare drawings; config: what asked for it, for the provenance.
    """
    curves = any(len(r.travel) for r in campaign.runs)
    chosen = fitted_model(model) if curves else analytic(model)
    acting = effects_of(effects)
    refuse(chosen, acting)
    steady = steady_errors(campaign, chosen, acting)
    common: dict[str, Any] = {"base_model": chosen.name, "campaign": label(campaign), "effects": acting}
    common |= {"steady": steady, "provenance": provenance(config) | {"data_sha256": campaign.sha256}}
    if not curves and steady:
        return Comparison(**common, error=None, where=None, per_run=())
    bench = workbench(campaign, fitted_model(chosen), [type(e) for e in acting])
    base, final = bench.forward.null(), _point(bench, acting)
    before, after = bench.forward.values(np.stack([base, final]))
    shown = (final, after) if acting else None
    return Comparison(
        **common,
        error=overall_errors(bench, before, after),
        where=where(bench, after),
        per_run=run_errors(bench, before, after),
        drawings=drawings(bench, (base, before), shown, mapped=after) if drawn else Drawings(),
        beyond=beyond_in_runs(campaign, fitted_model(chosen), [e.id for e in acting]),
    )


def _point(bench: Workbench, effects: Sequence[Effect]) -> np.ndarray:
    """The point q at which the effects have their numbers."""
    numbers = {type(e): e for e in effects}
    q = bench.forward.null()
    for k, slot in enumerate(bench.forward.slots):
        q[k] = float(getattr(numbers[slot.effect], slot.name)) / slot.scale
    return q


def steady_errors(
    campaign: Campaign, model: Model | SteadyModel, effects: Sequence[Effect] = ()
) -> tuple[SteadyError, ...]:
    """Measured and modelled late rates of every run and point in steady.csv, against the stated uncertainty."""
    runs = {r.name: r for r in campaign.runs}
    rows = []
    for stated in campaign.steady:
        run = runs[stated.run]
        modelled = _late_rates(case_of(campaign, run), model, effects)
        for point, (measured, rate) in enumerate(zip(stated.rates, modelled, strict=True), start=1):
            if np.isfinite(measured):
                rows.append(
                    SteadyError(
                        run=run.name,
                        point=point,
                        tension=run.tension,
                        measured=float(measured),
                        modelled=float(rate),
                        u=stated.u,
                        ratio=float(abs(rate - measured) / stated.u),
                    )
                )
    return tuple(rows)


def _late_rates(case: Case, model: Model | SteadyModel, effects: Sequence[Effect]) -> np.ndarray:
    """Late rates of points 1-4 [m/m]: in closed form, or by a long run where effects act."""
    if effects and isinstance(model, Model):
        return late_rates(model.run(case, effects, travel=STEADY_TRAVEL))
    assert isinstance(model, SteadyModel)
    return np.full(4, model.steady_rate(case))
