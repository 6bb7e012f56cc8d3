"""What pictures and reports draw of a comparison, in the units people read."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from belt_sim.results.estimates import Estimate, Machine
from belt_sim.results.fields import Array


def _check_shapes(what: object, names: tuple[str, ...], shape: tuple[int, ...]) -> None:
    """Raise ValueError unless all these arrays, where there are any, have one shape."""
    for name in names:
        value = getattr(what, name)
        if value is not None and np.shape(value) != shape:
            raise ValueError(f"{name} has the shape {np.shape(value)}, not {shape}")


@dataclass(frozen=True, kw_only=True)
class Panel:
    """One ``run`` and signal: ``travel`` [m], ``measured``, ``base``, ``final`` (the last may be None), ``band``.

    All arrays have shape (n,); values are in ``unit`` ("mm" or "mrad"). ``band`` is the half width about the model,
    where model and measurement cannot be told apart (k u_val). ``title`` says which run, signal and condition.
    """

    run: str
    title: str
    travel: Array
    measured: Array
    base: Array
    band: Array
    final: Array | None = None
    unit: str = "mm"

    def __post_init__(self) -> None:
        _check_shapes(self, ("travel", "measured", "base", "band", "final"), (len(self.travel),))

    @property
    def misfit(self) -> float:
        """Mean of |base - measured| over the half width of the band; 0 where nothing was measured."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.abs(self.base - self.measured) / np.maximum(self.band, 1e-12)
        return float(np.mean(ratio[np.isfinite(ratio)])) if np.isfinite(ratio).any() else 0.0


@dataclass(frozen=True, kw_only=True)
class FailureMap:
    """E/u_val of one signal and yaw sign: ``ratio``, shape (tensions, windows), NaN where not measured.

    tension [N/mm2], shape (t,); edges [m] of the travel windows, shape (w + 1,); title: signal and yaw sign.
    """

    title: str
    tension: Array
    edges: Array
    ratio: Array

    def __post_init__(self) -> None:
        _check_shapes(self, ("ratio",), (len(self.tension), len(self.edges) - 1))


@dataclass(frozen=True, kw_only=True)
class Drift:
    """``value`` +- ``u`` (one sigma), shape (t,), of one parameter of one model at each ``tension`` [N/mm2].

    stated: what the rig's sheet says, with u_stated; None when it says nothing.
    """

    parameter: str
    unit: str
    tension: Array
    value: Array
    u: Array
    stated: float | None = None
    u_stated: float = 0.0

    def __post_init__(self) -> None:
        _check_shapes(self, ("tension", "value", "u"), (len(self.tension),))

    @property
    def at_limit(self) -> np.ndarray:
        """Whether each value ended at the limit of its range, and so has no uncertainty, shape (t,)."""
        ended: np.ndarray = np.asarray(self.u) == 0.0
        return ended


@dataclass(frozen=True, kw_only=True)
class Drawings:
    """overlays: a Panel a run and signal; maps: E/u_val by signal and yaw sign; drifts: (before, after) each; machine:
    in whose terms numbers are told; sizes: of each set of effects (their ids, sorted, joined by +) that may be the
    answer, the numbers by effect.

    Any of them may be empty.
    """

    overlays: tuple[Panel, ...] = ()
    maps: tuple[FailureMap, ...] = ()
    drifts: tuple[tuple[Drift, Drift | None], ...] = ()
    machine: Machine | None = None
    sizes: Mapping[str, Mapping[str, Mapping[str, Estimate]]] = field(default_factory=dict)
