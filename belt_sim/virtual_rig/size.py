"""How large an effect is in a campaign: d, its size in units of noise once the nuisances had their say."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_solve, cholesky, solve_triangular

from belt_sim.virtual_rig.fault import Fault
from belt_sim.virtual_rig.line import Line, stack
from belt_sim.virtual_rig.observe import Errors, observe, stated, true_line, varied
from belt_sim.virtual_rig.plan import Noise, Plan

#: Trial sizes of an effect: downwards from its limit by this factor, this often.
_FACTOR, _TRIALS = 2.0, 12
_AWAY = 10.0  # [m] a belt that has run away
_REFINED = 7  # trial sizes in the second, narrower round


@dataclass(frozen=True, eq=False)
class Ruler:
    """Measures changes of readings, shape (signals, n, runs), in units of noise and nuisances."""

    plan: Plan
    base: Line
    clean: np.ndarray
    whitening: list[np.ndarray]
    nuisances: np.ndarray
    factor: np.ndarray

    def whitened(self, change: np.ndarray) -> np.ndarray:
        """A change as one vector of unit noise."""
        parts = [solve_triangular(c, x, lower=True) for c, x in zip(self.whitening, change, strict=True)]
        return np.concatenate([p.ravel() for p in parts])

    def projected(self, vector: np.ndarray) -> float:
        """d of a whitened vector: sqrt(v' (1 + N N')^-1 v), N the whitened nuisances times their sigmas."""
        inner = self.nuisances.T @ vector
        return float(np.sqrt(max(vector @ vector - inner @ cho_solve((self.factor, True), inner), 0.0)))

    def reduced(self, change: np.ndarray) -> np.ndarray:
        """A change as a vector whose length is its d: whitened, and relieved of what the nuisances explain.

        With N N' = U diag(l^2) U', the metric (1 + N N')^-1 has the root 1 - U (1 - (1 + l^2)^-1/2) U'.
        """
        vector = self.whitened(change)
        u, length, _ = np.linalg.svd(self.nuisances, full_matrices=False)
        return vector - u @ ((1 - 1 / np.sqrt(1 + length**2)) * (u.T @ vector))

    def sizes(self, faults: Sequence[Fault]) -> np.ndarray:
        """d of each of several faults, all observed in one batch, shape (faults,)."""
        return np.array([self.projected(self.whitened(c)) for c in self.changes(faults)])

    def changes(self, faults: Sequence[Fault]) -> list[np.ndarray]:
        """Change of the readings by each fault alone."""
        runs, classes = len(self.plan.runs), {type(f) for f in faults}
        lanes = [_lanes(cls, faults, runs) for cls in sorted(classes, key=lambda c: c.id)]
        with np.errstate(over="ignore", invalid="ignore"):  # a trial size may let the belt run away
            seen = observe(self.plan, varied(self.base, len(faults)), lanes)
        seen = np.nan_to_num(seen, nan=_AWAY, posinf=_AWAY, neginf=-_AWAY).clip(-_AWAY, _AWAY)
        return [seen[:, :, k * runs : (k + 1) * runs] - self.clean for k in range(len(faults))]


def _lanes(cls: type[Fault], faults: Sequence[Fault], runs: int) -> Fault:
    """Faults of one class as one fault with a parameter a lane, null in the lanes of other classes."""
    names = cls().parameters()
    rows = [f.parameters() if type(f) is cls else cls().parameters() for f in faults]
    alike = next(f for f in faults if type(f) is cls)
    values = {n: np.repeat([row[n] for row in rows], runs) for n in names if n in cls.sizes}
    return cls(**{n: values.get(n, getattr(alike, n)) for n in names})


def ruler(plan: Plan, noise: Noise, base: str) -> Ruler:
    """A ruler from the stated errors. Nuisances: zero, gain, tension and yaw of each run; machine data."""
    runs = len(plan.runs)
    steps = {name: Errors(machine={name: q.u}) for name, q in stated(plan).items() if q.u > 0}
    steps |= {"tension": Errors(tension_rel=noise.tension_rel), "yaw": Errors(yaw=noise.yaw_u)}
    lines = [true_line(plan, base, e) for e in (Errors(), *steps.values())]
    lines = [replace(line, run=np.arange(runs)) for line in lines]
    seen = observe(plan, stack(lines), [])
    clean, *moved = (seen[:, :, k * runs : (k + 1) * runs] for k in range(len(lines)))
    sheets = [noise.sheet(name, place) for name, place in plan.signals.items()]
    whitening = [_whitening(plan.travel, sheet) for sheet in sheets]
    changes = _nuisances(dict(zip(steps, moved, strict=True)), clean, sheets)
    blank = Ruler(plan, lines[0], clean, whitening, np.empty(0), np.empty(0))
    columns = np.stack([blank.whitened(c) for c in changes], axis=1)
    factor = cholesky(np.eye(columns.shape[1]) + columns.T @ columns, lower=True)
    return Ruler(plan, lines[0], clean, whitening, columns, factor)


def _whitening(travel: np.ndarray, sheet) -> np.ndarray:
    apart = np.abs(travel[:, None] - travel)
    wander = sheet.wander_sd**2 * np.exp(-apart / sheet.wander_length)
    return cholesky(sheet.white**2 * np.eye(len(travel)) + wander, lower=True)


def _nuisances(moved: dict[str, np.ndarray], clean: np.ndarray, sheets) -> list[np.ndarray]:
    """One-sigma changes: machine data move all runs together, settings, zeros and gains one run each."""
    shared = [seen - clean for name, seen in moved.items() if name not in ("tension", "yaw")]
    own = [moved["tension"] - clean, moved["yaw"] - clean]
    for k, sheet in enumerate(sheets):
        for change in (np.full_like(clean, sheet.zero), sheet.gain * clean):
            alone = np.zeros_like(clean)
            alone[k] = change[k]
            own.append(alone)
    lanes = np.eye(clean.shape[2])
    return shared + [change * lane for change in own if change.any() for lane in lanes]


def fault_of_size(rule: Ruler, fault: Fault, wanted: float) -> tuple[Fault, float]:
    """The fault, its sizes scaled together until its d is ``wanted`` or a limit is met; and the d it has."""
    limit = min(
        size.limit / abs(value) for name, size in fault.sizes.items() if (value := fault.parameters()[name]) != 0.0
    )
    scales = limit / _FACTOR ** np.arange(_TRIALS)[::-1]
    found = np.maximum.accumulate(rule.sizes([scaled(fault, s) for s in scales]))
    k = int(np.searchsorted(found, wanted))
    if k == len(scales):
        return scaled(fault, scales[-1]), float(found[-1])
    scales = np.linspace(scales[k - 1] if k else 0.0, scales[k], _REFINED)
    found = np.maximum.accumulate(rule.sizes([scaled(fault, s) for s in scales]))
    return scaled(fault, float(np.interp(wanted, found, scales))), wanted


def scaled(fault: Fault, factor: float) -> Fault:
    """The fault with all its sizes multiplied."""
    return replace(fault, **{n: v * factor for n, v in fault.parameters().items() if n in fault.sizes})
