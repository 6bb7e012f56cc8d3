"""A diagnosis as a Rerun recording: measured and modelled points, residuals and tilt against travel."""

from pathlib import Path

import jax
import numpy as np

from belt_sim.analytic.march import march
from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.diagnose.diagnosis import Diagnosis
from belt_sim.watch.record import Overlay, record_runs


def record_diagnosis(path: Path, d: Diagnosis) -> Path:
    """One tab a run; the base model and, where effects were found, the model with them."""
    forward, samples = d.bench.forward, d.bench.samples
    effects = forward.effects_at(d.found.chosen.q, d.found.chosen.ids)
    shown = {}
    for r, run in enumerate(samples.runs):
        case = Case(
            rig=samples.cases.rig,
            belt=samples.cases.belt,
            settings=jax.tree.map(lambda x, r=r: x[r], samples.cases.settings),
        )
        end = float(samples.travel[r].max())
        modelled = {forward.model.name: march(case, forward.model, travel=end)}
        if effects:
            words = "with " + ", ".join(d.found.chosen.ids)
            modelled[words] = march(case, forward.model, effects, travel=end)
        shown[run.name] = Overlay(modelled=modelled, measured=_measured(d, r), case=case)
    record_runs(path, shown)
    return path


def _measured(d: Diagnosis, r: int) -> Curves:
    samples = d.bench.samples
    y, tilt = np.full((4, samples.y.shape[2]), np.nan), np.full((2, samples.y.shape[2]), np.nan)
    for s, signal in enumerate(samples.signals):
        if signal.at.startswith("point_"):
            y[int(signal.at[-1]) - 1] = samples.y[r, s]
        else:
            tilt[0 if signal.at.startswith("upper") else 1] = samples.y[r, s]
    has_tilt = bool(np.isfinite(tilt).any())
    return Curves(travel=samples.travel[r], y=y, tilt=tilt if has_tilt else None)
