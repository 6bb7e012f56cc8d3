"""What a law that knows everything hidden would predict: the same line, set as stated, without noise."""

from dataclasses import replace

import numpy as np

from belt_sim.campaign import Campaign
from belt_sim.virtual_rig.library import fault_of
from belt_sim.virtual_rig.observe import Errors, observe, true_line
from belt_sim.virtual_rig.plan import Plan, setting_of
from belt_sim.virtual_rig.seal import Truth


def expected(campaign: Campaign, truth: Truth) -> Campaign:
    """The campaign with such readings in place of its own; ``truth``: what stands behind it."""
    faults = [fault_of({"id": e["id"], **e["parameters"]}) for e in truth.effects]
    alike: dict[tuple, list[int]] = {}
    for k, run in enumerate(campaign.runs):
        alike.setdefault((len(run.travel), float(run.travel[-1]), tuple(run.signals)), []).append(k)
    runs = list(campaign.runs)
    for which in alike.values():
        for k, signals in zip(which, _readings(campaign, which, truth.base, faults), strict=True):
            runs[k] = replace(runs[k], signals=signals)
    return replace(campaign, runs=tuple(runs), sha256="")


def _readings(campaign: Campaign, which: list[int], base: str, faults) -> list[dict[str, np.ndarray]]:
    """Readings of the runs of these numbers, recorded alike: all in one march."""
    runs = [campaign.runs[k] for k in which]
    reach, steps = float(runs[0].travel[-1]), len(runs[0].travel) - 1
    plan = Plan(
        runs=tuple(setting_of(run) for run in runs),
        length=reach,
        spacing=reach / steps,
        signals={s.name: s.at for s in campaign.signals if s.name in runs[0].signals},
        machine=campaign.machine,
        belt=campaign.belt,
    )
    line = replace(true_line(plan, base, Errors()), run=np.array(which))  # some faults are another in every run
    readings = observe(plan, line, faults)
    return [{name: values[:, k] for name, values in zip(plan.signals, readings, strict=True)} for k in range(len(runs))]
