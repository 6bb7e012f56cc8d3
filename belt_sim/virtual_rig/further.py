"""One more run on the same line: the machine, the belt and what is hidden in them stay, the setting is new."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from belt_sim.campaign import Campaign, Run, SignalSheet
from belt_sim.virtual_rig.library import fault_of
from belt_sim.virtual_rig.make import RESOLUTION
from belt_sim.virtual_rig.noise import add_noise
from belt_sim.virtual_rig.observe import Errors, observe, true_line
from belt_sim.virtual_rig.plan import Noise, Plan, setting_of
from belt_sim.virtual_rig.seal import Truth


def measured_further(campaign: Campaign, truth: Truth, run: Run, signals: Sequence[SignalSheet], seed: int) -> Campaign:
    """The campaign with one more run, whose setting errors and noise are drawn.

    run: its setting and travel [m], shape (n,), readings ignored; signals: its sensors, which may be more than the
    campaign has so far; truth: what stands behind the campaign.
    """
    rng = np.random.default_rng([seed, len(campaign.runs)])
    noise = Noise(**truth.noise)
    plan = Plan(
        runs=(setting_of(run),),
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
    faults = [fault_of({"id": e["id"], **e["parameters"]}) for e in truth.effects]
    readings = observe(plan, true_line(plan, truth.base, errors), faults)
    shown = {}
    for sheet, values in zip(signals, readings, strict=True):
        noisy = add_noise(values, plan.travel, sheet, noise, rng)[:, 0]
        shown[sheet.name] = np.round(noisy / RESOLUTION[sheet.kind]) * RESOLUTION[sheet.kind]
    fresh = replace(run, name=f"r{len(campaign.runs) + 1:02d}", travel=plan.travel, signals=shown)
    return replace(campaign, signals=tuple(signals), runs=(*campaign.runs, fresh), sha256="")
