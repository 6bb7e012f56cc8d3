"""A campaign and a model as a Rerun recording: measured and modelled points, residuals and tilt against travel."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from belt_sim.campaign import Campaign, case_of
from belt_sim.curves import Curves
from belt_sim.diagnosis.readings.samples import Samples, samples_of
from belt_sim.effects.base import Effect
from belt_sim.jax_setup import map_in_threads
from belt_sim.model import Model
from belt_sim.watch.record import Overlay, record_runs


def record_campaign(path: Path, campaign: Campaign, model: Model, effects: Sequence[Effect]) -> Path:
    """One tab a run; the base model and, where there are effects, the model with them."""
    samples = samples_of(campaign)
    variants = {model.name: ()} | ({"with " + ", ".join(e.id for e in effects): effects} if effects else {})

    def overlay(r: int) -> Overlay:
        case, end = case_of(campaign, samples.runs[r]), float(samples.travel[r].max())
        modelled = {name: model.run(case, acting, travel=end) for name, acting in variants.items()}
        return Overlay(modelled=modelled, measured=_measured(samples, r), case=case)

    runs = range(len(samples.runs))
    first = [overlay(r) for r in runs[:1]]  # compiles, before there are several threads
    overlays = [*first, *map_in_threads(overlay, runs[1:])]
    record_runs(path, dict(zip((run.name for run in samples.runs), overlays, strict=True)))
    return path


def _measured(samples: Samples, r: int) -> Curves:
    y, tilt = np.full((4, samples.y.shape[2]), np.nan), np.full((2, samples.y.shape[2]), np.nan)
    for s, signal in enumerate(samples.signals):
        if signal.at.startswith("point_"):
            y[int(signal.at[-1]) - 1] = samples.y[r, s]
        elif signal.kind == "tilt":
            tilt[0 if signal.at.startswith("upper") else 1] = samples.y[r, s]
    has_tilt = bool(np.isfinite(tilt).any())
    return Curves(travel=samples.travel[r], y=y, tilt=tilt if has_tilt else None)
