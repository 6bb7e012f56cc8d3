"""Check: the linter, and what a campaign can and cannot tell, before it is measured as well as after."""

from pathlib import Path
from typing import Any

from belt_sim.campaign import Campaign, Run
from belt_sim.campaign.read import is_plan, read_begun, read_plan
from belt_sim.diagnosis.describe import label
from belt_sim.errors import InputError
from belt_sim.foresight.doubts import doubts
from belt_sim.foresight.layout import laid_out
from belt_sim.foresight.pairs import pairs
from belt_sim.foresight.sizes import visible
from belt_sim.provenance import provenance
from belt_sim.results.check import Check, Doubt
from belt_sim.use_cases.asked import candidates_of, fitted_model

TRAVEL, STEP = 60.0, 0.5  # [m] that a planned run is recorded over, and between its readings


def check(
    campaign: Campaign | str | Path,
    model: Any = "strip",
    effects: Any = None,
    *,
    travel: float = TRAVEL,
    step: float = STEP,
    advise: bool = True,
    config: Any = None,
) -> Check:
    """What ``campaign`` (an object, or a folder, some or all of whose runs may still be to be measured) can tell.

    model: an analytic one; effects: as in diagnose; travel, step [m]: of the records of planned runs; advise: look for
    the further run that would tell a pair apart. Raises CampaignError with every fault of a folder.
    """
    planned = not isinstance(campaign, Campaign) and is_plan(campaign)
    if planned and not (0.0 < step < travel / 10.0):
        raise InputError("step", step, "m", f"between readings of planned runs; above 0 and below {travel / 10.0:g}")
    missing: tuple[Run, ...] = ()
    if isinstance(campaign, Campaign):
        read = campaign
    elif planned:
        read = read_plan(campaign, travel=travel, step=step)
    else:
        read, missing = read_begun(campaign)
    chosen = fitted_model(model)
    found = doubts(read, planned=planned)
    common: dict[str, Any] = {"campaign": label(read), "base_model": chosen.name, "planned": planned}
    common |= {"runs": tuple(r.name for r in read.runs), "missing": tuple(r.name for r in missing)}
    common |= {"provenance": provenance(config) | {"data_sha256": read.sha256}}
    if not any(len(r.travel) for r in read.runs) or not any(s.kind == "lateral" for s in read.signals):
        only = Doubt(kind="plan", sentence="there are no curves of a point: a model can be compared, nothing diagnosed")
        return Check(**common, noise="Steady rates only.", doubts=(*found, only), visible=(), pairs=())
    bench, fit = laid_out(read, chosen, candidates_of(effects, chosen), planned=planned)
    seen = visible(bench, fit)
    return Check(
        **common,
        noise=bench.levels.sentence,
        doubts=found,
        visible=tuple(seen),
        pairs=tuple(pairs(bench, fit, seen, advise=advise)),
    )
