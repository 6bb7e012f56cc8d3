"""The least held-out error that anybody could have had on a campaign: that of a law which knows what is hidden.

The noise floor that an answer tells is what noise and settings make on average. Of the few long waves of wander in one
campaign chance may have drawn a tenth more or less, as much as the whole reducible part of a small effect's error; so
what was reducible is known only once the truth is open, on the very readings.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from belt_sim import si
from belt_sim.api.resolve import fitted_model
from belt_sim.campaign import Campaign
from belt_sim.diagnosis.errors.own_errors import OwnErrors
from belt_sim.diagnosis.fits.heldout import conditions
from belt_sim.diagnosis.fits.workbench import workbench
from belt_sim.diagnosis.readings.samples import samples_of
from belt_sim.virtual_rig import Truth
from belt_sim.virtual_rig.make import noise_free
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
    left = bench.samples.y - samples_of(noise_free(campaign, truth)).y
    own = OwnErrors(bench.at_levels(bench.finder(left)))
    found, untold = conditions(bench), error.get("held_out_untestable", error.get("untestable", ()))
    told = [out for name, out in found.items() if name not in untold] or list(found.values())
    return {
        "plain_mm": _rms([left[out][own.there[out]] for out in told]),
        "beside_settings_mm": _rms([own.less(left[out], out)[own.there[out]] for out in told]),
    }


def _rms(parts: list[np.ndarray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) / si.MM
