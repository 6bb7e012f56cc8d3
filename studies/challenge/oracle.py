"""The least held-out error that anybody could have had on a campaign: that of a law which knows what is hidden.

The noise floor that an answer tells is what noise and settings make on average. Of the few long waves of wander in one
campaign chance may have drawn a tenth more or less, as much as the whole reducible part of a small effect's error; so
what was reducible is known only once the truth is open, on the very readings.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from belt_sim import si
from belt_sim.api.resolve import fitted_model
from belt_sim.campaign import Campaign
from belt_sim.diagnosis.errors.model_errors import ErrorsWithoutNuisances
from belt_sim.diagnosis.fits.heldout import conditions
from belt_sim.diagnosis.fits.workbench import workbench
from belt_sim.diagnosis.readings.samples import samples_of
from belt_sim.virtual_rig import Truth
from belt_sim.virtual_rig.library import fault_from_spec
from belt_sim.virtual_rig.observe import TrueErrors, observe, true_line
from belt_sim.virtual_rig.plan import Plan, setting_from
from studies.challenge.score import error_of

LINE = "engine=line"  # campaigns of a 3D scene have no line that would predict them


def least_error(campaign: Campaign, truth: Truth, answer: Mapping[str, Any]) -> dict[str, float] | None:
    """rms [mm] of the lateral errors of that law, over the conditions that the answer's error is told over: as they
    are, and beside each run's own zero, gain and settings. None where nothing hidden or nothing told is to be had.
    """
    error = error_of(answer)
    if not error or not error.get("held_out") or not truth.effects or truth.dirty:
        return None
    if LINE not in campaign.source.reference:
        return None
    bench = workbench(campaign, fitted_model(truth.base), ())
    left = bench.samples.y - samples_of(noise_free(campaign, truth), leave_out_bad=False).y
    levels = bench.finder(left)
    own = ErrorsWithoutNuisances(replace(bench, levels=levels, metric=bench.metric_at(levels)))
    found, untold = conditions(bench), error.get("held_out_untestable", error.get("untestable", ()))
    told = [out for name, out in found.items() if name not in untold] or list(found.values())
    return {
        "plain_mm": _rms([left[out][own.there[out]] for out in told]),
        "beside_settings_mm": _rms([own.remove_nuisances(left[out], out)[own.there[out]] for out in told]),
    }


def _rms(parts: list[np.ndarray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) / si.MM


def noise_free(campaign: Campaign, truth: Truth) -> Campaign:
    """The campaign with such readings in place of its own; ``truth``: what stands behind it."""
    faults = [fault_from_spec({"id": e["id"], **e["parameters"]}) for e in truth.effects]
    alike: dict[tuple, list[int]] = {}
    for k, run in enumerate(campaign.runs):
        alike.setdefault((len(run.travel), float(run.travel[-1]), tuple(run.signals)), []).append(k)
    runs = list(campaign.runs)
    for which in alike.values():
        readings = _noise_free_readings(campaign, which, truth, faults)
        for k, signals in zip(which, readings, strict=True):
            runs[k] = replace(runs[k], signals=signals)
    return replace(campaign, runs=tuple(runs), sha256="")


def _noise_free_readings(campaign: Campaign, which: list[int], truth: Truth, faults) -> list[dict[str, np.ndarray]]:
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
    line = replace(
        true_line(plan, truth.base, TrueErrors()), run=np.array(which)
    )  # some faults are another in every run
    readings = observe(plan, line, faults)
    return [{name: values[:, k] for name, values in zip(plan.signals, readings, strict=True)} for k in range(len(runs))]
