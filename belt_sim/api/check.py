"""Check what a campaign, or the plan of one, can tell of a model."""

from pathlib import Path
from typing import Any

from belt_sim.api.simulate import ModelSpec, campaign_model, candidates_of, fitted_model
from belt_sim.campaign import Campaign, Run
from belt_sim.campaign.folder import is_plan, read_begun, read_plan
from belt_sim.diagnosis.drawings import label, machine_of
from belt_sim.diagnosis.foresight import find_doubts, free_starts, pairs, visible
from belt_sim.diagnosis.workbench import linear_response
from belt_sim.errors import InputError, finite, flag
from belt_sim.io import provenance
from belt_sim.jax_setup import one_blas_thread
from belt_sim.results.errors import Check, Doubt
from belt_sim.settings import BOUNDS

PLANNED_TRAVEL, PLANNED_STEP = 60.0, 0.5  # [m] that a planned run is recorded over, and between its readings
MOST_PLANNED = 10_000  # readings of a planned run


@one_blas_thread
def check(
    campaign: Campaign | str | Path,
    model: ModelSpec | None = None,
    effects: Any = None,
    *,
    travel: float = PLANNED_TRAVEL,
    step: float = PLANNED_STEP,
    advise: bool = True,
    config: Any = None,
) -> Check:
    """What ``campaign`` (an object, or a folder, some or all of whose runs may still be to be measured) can tell.

    model: an analytic one; effects: as in diagnose; travel, step [m]: of the records of planned runs; advise: look for
    the further run that would tell a pair apart. Raises CampaignError with every fault of a folder.
    """
    flag("advise", advise)
    for name, value in (("travel", travel), ("step", step)):
        finite(name, value, "m", "give a length in metres", lambda x: x > 0)
    planned = not isinstance(campaign, Campaign) and is_plan(campaign)
    BOUNDS["travel"].check(travel, name="travel")
    least = travel / MOST_PLANNED
    if not least <= step or (planned and step >= travel / 10.0):
        remedy = f"between readings of planned runs; {least:g} ({MOST_PLANNED} readings a run) to {travel / 10.0:g}"
        raise InputError("step", f"{step:g}", "m", remedy)
    for name, value, usual in (("travel", travel, PLANNED_TRAVEL), ("step", step, PLANNED_STEP)):
        if not planned and value != usual:
            remedy = "is of planned runs; these are measured, with travels of their own: leave it"
            raise InputError(name, value, "m", remedy)
    missing: tuple[Run, ...] = ()
    if isinstance(campaign, Campaign):
        read = campaign
    elif planned:
        read = read_plan(campaign, travel=travel, step=step)
    else:
        read, missing = read_begun(campaign)
    chosen = fitted_model(campaign_model(model, read))
    read, running = (read, ()) if planned else free_starts(read, chosen)
    found = find_doubts(read, chosen, planned=planned, known=running)
    common: dict[str, Any] = {"campaign": label(read), "base_model": chosen.name, "planned": planned}
    common |= {"runs": tuple(r.name for r in read.runs), "missing": tuple(r.name for r in missing)}
    common |= {"provenance": provenance(config) | {"data_sha256": read.sha256}}
    if not any(len(r.travel) for r in read.runs) or not any(s.kind == "lateral" for s in read.signals):
        only = Doubt(kind="plan", sentence="there are no curves of a point: belt-sim compare works, diagnose does not")
        return Check(**common, noise="Steady rates only.", doubts=(*found, only), visible=(), pairs=())
    bench, fit = linear_response(read, chosen, candidates_of(effects, chosen), planned=planned)
    seen = visible(bench, fit)
    alike = tuple(pairs(bench, fit, seen, advise=advise))
    return Check(
        **common, noise=bench.levels.sentence, doubts=found, visible=tuple(seen), pairs=alike, machine=machine_of(bench)
    )
