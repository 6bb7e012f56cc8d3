"""What a law that knows everything hidden would predict: the same line, set as stated, without noise."""

from dataclasses import replace

import numpy as np

from belt_sim.campaign import Campaign, Run
from belt_sim.virtual_rig.library import fault_of
from belt_sim.virtual_rig.observe import Errors, observe, true_line
from belt_sim.virtual_rig.plan import Plan, setting_of
from belt_sim.virtual_rig.seal import Truth


def expected(campaign: Campaign, truth: Truth) -> Campaign:
    """The campaign with such readings in place of its own; ``truth``: what stands behind it."""
    faults = [fault_of({"id": e["id"], **e["parameters"]}) for e in truth.effects]
    runs = tuple(replace(run, signals=_readings(campaign, run, truth.base, faults)) for run in campaign.runs)
    return replace(campaign, runs=runs, sha256="")


def _readings(campaign: Campaign, run: Run, base: str, faults) -> dict[str, np.ndarray]:
    plan = Plan(
        runs=(setting_of(run),),
        length=float(run.travel[-1]),
        spacing=float(run.travel[-1]) / (len(run.travel) - 1),
        signals={s.name: s.at for s in campaign.signals if s.name in run.signals},
        machine=campaign.machine,
        belt=campaign.belt,
    )
    readings = observe(plan, true_line(plan, base, Errors()), faults)
    return {name: values[:, 0] for name, values in zip(plan.signals, readings, strict=True)}
