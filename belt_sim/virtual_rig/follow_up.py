"""The line of a campaign measured again: with one more run, or without noise as a law that knows all would predict."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from belt_sim.campaign import Campaign, Run, SignalSheet
from belt_sim.virtual_rig.blinding import Truth
from belt_sim.virtual_rig.library import fault_from_spec
from belt_sim.virtual_rig.make import RESOLUTION
from belt_sim.virtual_rig.noise import add_noise
from belt_sim.virtual_rig.observe import Errors, observe, true_line
from belt_sim.virtual_rig.plan import Noise, Plan, setting_from


def add_follow_up_run(
    campaign: Campaign, truth: Truth, run: Run, signals: Sequence[SignalSheet], seed: int
) -> Campaign:
    """The campaign with one more run, whose setting errors and noise are drawn.

    run: its setting and travel [m], shape (n,), readings ignored; signals: its sensors, which may be more than the
    campaign has so far; truth: what stands behind the campaign.
    """
    rng = np.random.default_rng([seed, len(campaign.runs)])
    noise = Noise(**truth.noise)
    plan = Plan(
        runs=(setting_from(run),),
        length=float(run.travel[-1]),
        spacing=float(run.travel[1] - run.travel[0]),
        signals={s.name: s.at for s in signals},
        machine=campaign.machine,
        belt=campaign.belt,
    )
    errors = Errors(
        machine=truth.machine,
        tension_rel=campaign.settings.tension_rel * rng.standard_normal(1),
        yaw=campaign.settings.yaw_u * rng.standard_normal(1),
    )
    faults = [fault_from_spec({"id": e["id"], **e["parameters"]}) for e in truth.effects]
    readings = observe(plan, true_line(plan, truth.base, errors), faults)
    shown = {}
    for sheet, values in zip(signals, readings, strict=True):
        noisy = add_noise(values, plan.travel, sheet, noise, rng)[:, 0]
        shown[sheet.name] = np.round(noisy / RESOLUTION[sheet.kind]) * RESOLUTION[sheet.kind]
    fresh = replace(run, name=f"r{len(campaign.runs) + 1:02d}", travel=plan.travel, signals=shown)
    return replace(campaign, signals=tuple(signals), runs=(*campaign.runs, fresh), sha256="")


def noise_free(campaign: Campaign, truth: Truth) -> Campaign:
    """The campaign with such readings in place of its own; ``truth``: what stands behind it."""
    faults = [fault_from_spec({"id": e["id"], **e["parameters"]}) for e in truth.effects]
    alike: dict[tuple, list[int]] = {}
    for k, run in enumerate(campaign.runs):
        alike.setdefault((len(run.travel), float(run.travel[-1]), tuple(run.signals)), []).append(k)
    runs = list(campaign.runs)
    for which in alike.values():
        for k, signals in zip(which, _readings(campaign, which, truth, faults), strict=True):
            runs[k] = replace(runs[k], signals=signals)
    return replace(campaign, runs=tuple(runs), sha256="")


def _readings(campaign: Campaign, which: list[int], truth: Truth, faults) -> list[dict[str, np.ndarray]]:
    """Readings of the runs of these numbers, recorded alike: all in one march."""
    runs = [campaign.runs[k] for k in which]
    reach, steps = float(runs[0].travel[-1]), len(runs[0].travel) - 1
    starts = truth.settings.get("start", [0.0] * len(campaign.runs))
    plan = Plan(
        runs=tuple(replace(setting_from(run), start=starts[k]) for k, run in zip(which, runs, strict=True)),
        length=reach,
        spacing=reach / steps,
        signals={s.name: s.at for s in campaign.signals if s.name in runs[0].signals},
        machine=campaign.machine,
        belt=campaign.belt,
        zero_at_start="zero_at_start" in truth.settings,
    )
    line = replace(true_line(plan, truth.base, Errors()), run=np.array(which))  # some faults are another in every run
    readings = observe(plan, line, faults)
    return [{name: values[:, k] for name, values in zip(plan.signals, readings, strict=True)} for k in range(len(runs))]
