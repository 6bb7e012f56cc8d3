"""How far a hidden change lies from the library: what the best one, and the best three of its effects leave over."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from belt_sim.virtual_rig.effect_size import Detectability, changes, sensitivities
from belt_sim.virtual_rig.fault import Fault, overrides
from belt_sim.virtual_rig.library import RANDOM_LIBRARY
from belt_sim.virtual_rig.plan import Plan

_ALIKE = 3.0  # noise units that a lookalike may leave over, but no more than
_ALIKE_SHARE = 0.5  # of the effect's own size
_BEAM = 6  # best sets of one size that are tried with one more effect


@dataclass(frozen=True)
class LibraryDistance:
    """Single effects that come close, and what the best single one and the best three leave over [noise units].

    largest: the largest change of any reading [m or rad].
    """

    lookalikes: list[str]
    single: float
    triple: float
    largest: float


class LibrarySignatures:
    """What every effect of the library can do to one campaign's readings, linear about zero, in units of noise."""

    def __init__(self, detectability: Detectability) -> None:
        blocks = {}
        for name, columns in library_signatures(detectability.plan, detectability.law).items():
            reduced = np.stack([detectability.reduce(c) for c in columns], axis=1)
            blocks[name] = reduced / np.maximum(np.linalg.norm(reduced, axis=0), 1e-30)
        self.axes = np.linalg.qr(np.concatenate(list(blocks.values()), axis=1))[0]
        self.blocks = {name: self.axes.T @ block for name, block in blocks.items()}
        self.detectability = detectability

    def distance_of(self, faults: Sequence[Fault]) -> LibraryDistance:
        """The distance of the faults' joint change."""
        change = np.sum(self.detectability.changes(list(faults)), axis=0)
        target = self.detectability.reduce(change)
        inside = self.axes.T @ target
        beyond = max(float(target @ target - inside @ inside), 0.0)
        kept: list[tuple[float, tuple[str, ...]]] = [(float("inf"), ())]
        best = []
        singles: dict[str, float] = {}
        for _ in range(3):
            sets = {tuple(sorted({*names, n})) for _, names in kept[:_BEAM] for n in self.blocks if n not in names}
            kept = sorted((self._left(names, inside, beyond), names) for names in sets)
            best.append(kept[0][0])
            singles = singles or {names[0]: left for left, names in kept}
        allowed = min(_ALIKE, _ALIKE_SHARE * float(np.linalg.norm(target)))
        alike = sorted(n for n, left in singles.items() if left < allowed)
        return LibraryDistance(lookalikes=alike, single=best[0], triple=best[2], largest=float(np.abs(change).max()))

    def _left(self, names: tuple[str, ...], inside: np.ndarray, beyond: float) -> float:
        basis = np.concatenate([self.blocks[n] for n in names], axis=1)
        fit = np.linalg.lstsq(basis, inside, rcond=1e-7)[0]
        return float(np.sqrt(np.sum((inside - basis @ fit) ** 2) + beyond))


@lru_cache(maxsize=4)
def library_signatures(plan: Plan, base: str) -> dict[str, list[np.ndarray]]:
    """Effect of the library -> changes of the readings, (signals, n, runs), by each of its parameters in each shape."""
    line, clean, _ = sensitivities(plan, base)
    directions = _directions(plan, base)
    columns: dict[str, list[np.ndarray]] = {}
    for fault in (f for f in directions if overrides(f, "edge")):
        columns.setdefault(fault.id, []).append(_edge(plan, line, clean, fault))
    marched = [f for f in directions if not overrides(f, "edge")]
    for hook in ("loads", "turn", ""):  # each lane pays for the hooks of all faults that march with it
        together = [f for f in marched if _first_hook(f) == hook]
        for fault, change in zip(together, changes(plan, line, clean, together), strict=True):
            columns.setdefault(fault.id, []).append(change)
    return {name: columns[name] for name in sorted(columns) if any(np.any(c) for c in columns[name])}


def _first_hook(fault: Fault) -> str:
    return next((hook for hook in ("loads", "turn") if overrides(fault, hook)), "")


def _edge(plan: Plan, line, clean: np.ndarray, fault: Fault) -> np.ndarray:
    """What the belt's edge changes: nothing of the march."""
    change, s = np.zeros_like(clean), np.broadcast_to(plan.travel[:, None], clean.shape[1:])
    for k, place in enumerate(plan.signals.values()):
        if place.startswith("point_"):
            change[k] = fault.edge(place, s, line) - fault.edge(place, line.yaw_at + 0 * s[:1], line)
    return change


def _directions(plan: Plan, base: str) -> list[Fault]:
    """Every library effect along each of its parameters, small, in every shape."""
    able = [cls for cls in RANDOM_LIBRARY if not cls.fixed and base not in (*cls.part_of, *cls.idle_on)]
    return [
        cls(**{name: _SMALL * size.typical}, **shape)
        for cls in able
        for name, size in visible_sizes(cls, plan).items()
        for shape in cls.shapes(plan)
    ]


_SMALL = 0.3  # of the typical size


def visible_sizes(cls: type[Fault], plan: Plan) -> dict:
    """Sizes of the parameters that the plan's sensors can show."""
    return {n: s for n, s in cls.sizes.items() if not s.place or s.place in plan.signals.values()}
