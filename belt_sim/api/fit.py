"""Numbers of named effects, fitted to a campaign."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.api.inference import parameter_vector
from belt_sim.api.resolve import ModelSpec, campaign_model, campaign_of, effects_of, fitted_model, refuse
from belt_sim.campaign import Campaign
from belt_sim.diagnosis.fits.workbench import workbench
from belt_sim.effects.base import Effect
from belt_sim.errors import InputError
from belt_sim.jax_setup import one_blas_thread
from belt_sim.results import words
from belt_sim.results.display import Display, Table


@dataclass(frozen=True, kw_only=True, repr=False)
class FitResult(Display):
    """Numbers that fit a campaign best: values and standard uncertainties u by name ("taper.kappa_t") in SI.

    covariance (k, k): in the order of ``values``; effects: with these numbers, for ``simulate`` and ``compare``;
    chi2: before and after; rms [m]: of the lateral signals, before and after.
    """

    values: dict[str, float]
    u: dict[str, float]
    covariance: np.ndarray
    effects: tuple[Effect, ...]
    chi2: tuple[float, float]
    rms: tuple[float, float]

    def lines(self) -> Sequence[str]:
        """One line a number, and what became of the error."""
        numbers = [f"{name} = {text}" for name, text in self._texts().items()]
        before, after = (1e3 * r for r in self.rms)
        return [*numbers, f"rms {before:.4f} -> {after:.4f} mm"]

    def tables(self) -> Sequence[Table]:
        return [Table("numbers, ± 1 sigma", ("name", "value"), list(self._texts().items()), left=("name", "value"))]

    def _texts(self) -> dict[str, str]:
        """Values with their uncertainties in units of the shop, by name."""
        units = {f"{e.id}.{n}": p.display_unit for e in self.effects for n, p in type(e).parameters.items()}
        return {n: words.with_u(units[n][0] * v, units[n][0] * self.u[n], units[n][1]) for n, v in self.values.items()}


@one_blas_thread
def fit(campaign: Campaign | str | Path, effects: Any, model: ModelSpec | None = None) -> FitResult:
    """The numbers of ``effects`` that fit a campaign best, with their covariance: nonlinear least squares on the march.

    Readings are weighted by their noise; what the campaign states with an uncertainty (tension, yaw, stiffness, zero,
    gain of every run) may be off by as much and counts in the covariance. Runs held out are not used.

    effects: as in ``simulate``; the search starts at their numbers ("taper": from zero). Every effect must have a hand
    in the readings there: give a start to those whose shape is a number (a weld's place, a time).

    Raises:
        InputError: no effect is given, or a number moves no reading where the search starts.
    """
    campaign, start = campaign_of(campaign), effects_of(effects)
    chosen = fitted_model(campaign_model(model, campaign))
    if not start:
        raise InputError("effects", effects, "", "name at least one, like effects=['taper']")
    refuse(chosen, start)
    bench = workbench(campaign, chosen, [type(e) for e in start])
    ids = [e.id for e in start]
    found = bench.fit([bench.start(ids, parameter_vector(bench, start))])[0]
    bench = bench.moved_to(found.vector)
    found = bench.fit([bench.start(ids, found.vector)])[0]
    slots = [bench.forward.slots[k] for k in found.free]
    names = [f"{s.effect.id}.{s.name}" for s in slots]
    still = [name for name, column in zip(names, found.columns, strict=True) if not column.any()]
    if still:
        raise InputError(still[0], 0, "", "moves no reading where the search starts; start elsewhere")
    scales = np.array([s.scale for s in slots])
    covariance = found.covariance * np.outer(scales, scales)
    lateral = [k for k, s in enumerate(bench.samples.signals) if s.kind == "lateral"]
    nothing, after = bench.forward.values(np.stack([bench.forward.null(), found.vector]))
    before, now = (bench.fitted.y - values for values in (nothing, after))
    return FitResult(
        values=dict(zip(names, (found.vector[found.free] * scales).tolist(), strict=True)),
        u=dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True)),
        covariance=covariance,
        effects=bench.forward.effects_at(found.vector, ids),
        chi2=(float(bench.metric.chi2(before)), found.chi2),
        rms=(_rms(before[:, lateral]), _rms(now[:, lateral])),
    )


def _rms(apart: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(apart**2)))
