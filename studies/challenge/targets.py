"""The target table: every figure with its count, its interval and what is wanted."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest

from belt_sim.results.diagnosis import APART, RESOLVED
from studies.challenge.score import NAMING, SURE, ScoredCase

SIZES = (3, 6, 12, 24)
_BETWEEN = {3: (2.0, 4.5), 6: (4.5, 9.0), 12: (9.0, 18.0), 24: (18.0, 1e9)}  # geometric means lie between sizes
SEEN = 6 * 0.8  # d from which an effect is to be named
GOOD_REMOVAL = 0.9


@dataclass(frozen=True)
class Share:
    """``count`` of ``trials``."""

    count: int
    trials: int

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the share (Wilson); (0, 1) without trials."""
        if self.trials == 0:
            return 0.0, 1.0
        found = binomtest(self.count, self.trials).proportion_ci(method="wilson")
        return float(found.low), float(found.high)

    @property
    def value(self) -> float:
        """The share; NaN without trials."""
        return self.count / self.trials if self.trials else np.nan


def share_of(flags: Sequence[bool]) -> Share:
    """How many of the flags are set."""
    return Share(sum(flags), len(flags))


@dataclass(frozen=True, kw_only=True)
class Target:
    """One row: what is counted, what is wanted (at_least, or at_most if that is given), and what was found."""

    name: str
    found: Share
    at_least: float | None = None
    at_most: float | None = None
    note: str = ""

    @property
    def goal(self) -> str:
        """The target in words."""
        if self.at_most is not None:
            return f"<= {self.at_most:.0%}"
        return f">= {self.at_least:.0%}" if self.at_least is not None else ""

    @property
    def is_met(self) -> bool | None:
        """Whether the share itself meets the target; None without trials or target."""
        if not self.found.trials or not self.goal:
            return None
        if self.at_most is not None:
            return self.found.value <= self.at_most
        return self.found.value >= (self.at_least or 0.0)


def size_class(d: float | None) -> int | None:
    """The size among SIZES that d belongs to."""
    if d is None:
        return None
    return next((s for s, (low, high) in _BETWEEN.items() if low <= d < high), None)


def of_kind(rows: Iterable[ScoredCase], *kinds: str, least: float = 0.0) -> list[ScoredCase]:
    """Campaigns of some kinds, in which the smallest hidden effect has at least a size."""
    return [f for f in rows if f.kind in kinds and (least == 0.0 or (f.size is not None and f.size >= least))]


def targets(rows: Sequence[ScoredCase]) -> list[Target]:
    """All rows of the table, in the order of the document that sets them."""
    return [*_naming(rows), *_unknown_laws(rows), *_numbers(rows), *_discovery(rows)]


def _naming(rows: Sequence[ScoredCase]) -> list[Target]:
    nothing, library, two = (of_kind(rows, k) for k in ("nothing", "library", "two"))
    visible = of_kind(rows, "library", "two", least=SEEN)
    named = [f for f in visible if f.verdict in NAMING]
    sizes = [len(f.answer_set) / max(1, len(f.hidden)) for f in named]
    found = [
        Target(name="false alarm when nothing is hidden", found=_share(nothing, lambda f: not f.right), at_most=0.05)
    ]
    for size, wanted in ((6, 0.90), (12, 0.98), (24, 0.99)):
        mine = [f for f in library if size_class(f.size) == size]
        found.append(Target(name=f"right effect first, d = {size}", found=_share(mine, _right), at_least=wanted))
    small = [f for f in library if size_class(f.size) == 3]
    return [
        *found,
        Target(name="right effect first, d = 3", found=_share(small, _right)),
        Target(
            name="truth named or in the confusable set, d >= 6",
            found=_share(visible, lambda f: set(f.hidden) <= f.answer_set),
            at_least=0.97,
            note=f"mean size for one effect {np.mean(sizes):.2f}, wanted <= 2" if sizes else "",
        ),
        Target(name="confidently wrong, d >= 6", found=_share(visible, confidently_wrong), at_most=0.01),
        Target(name="two effects, exact set", found=_share(two, _right), at_least=0.92),
    ]


def _unknown_laws(rows: Sequence[ScoredCase]) -> list[Target]:
    strange, dirty = of_kind(rows, "outside"), of_kind(rows, "dirty")
    near = [f for f in strange if f.distance is not None and 8 <= f.distance <= 12]
    far = [f for f in strange if f.distance is not None and f.distance > 12]
    clean = [f for f in rows if f.kind not in ("dirty", "not_drawn")]
    return [
        Target(name="unknown effect flagged, distance 8-12", found=_share(near, _right), at_least=0.80),
        Target(name="unknown effect flagged, distance > 12", found=_share(far, _right), at_least=0.95),
        Target(
            name="false names where the effect is not in the library",
            found=_share(near + far, lambda f: bool(f.false_names)),
            at_most=0.05,
            note="distance 8 and more",
        ),
        Target(name="dirty data caught before fitting", found=_share(dirty, lambda f: f.caught), at_least=0.95),
        Target(
            name="clean data taken for damaged", found=_share(clean, lambda f: f.verdict == "cannot_say"), at_most=0.02
        ),
    ]


def _numbers(rows: Sequence[ScoredCase]) -> list[Target]:
    inside = [flag for f in rows for flag in f.covered]
    large = [f for f in of_kind(rows, "library", "two", least=12 * 0.8) if f.removed is not None]
    advised = [f for f in rows if f.advice is not None]
    sure, unsure = ([f for f in advised if ((f.promised or 0.0) >= APART) is whether] for whether in (True, False))
    mean = f"mean {np.mean([f.removed for f in large]):.0%}" if large else ""
    return [
        Target(name="95 % interval holds the true value", found=share_of(inside), at_least=0.93, note="wanted 93-97 %"),
        Target(
            name="reducible held-out error removed by 90 % and more, d >= 12",
            found=_share(large, lambda f: (f.removed or 0.0) >= GOOD_REMOVAL),
            at_least=0.90,
            note=mean,
        ),
        Target(
            name=f"next-run advice resolves the pair, where {APART:g} sigma are promised",
            found=_share(sure, _advice),
            at_least=0.90,
        ),
        Target(
            name=f"next-run advice resolves the pair, where {RESOLVED:g} to {APART:g} are promised",
            found=_share(unsure, _advice),
        ),
        Target(name="answered without a crash", found=_share(rows, lambda f: f.outcome != "crash"), at_least=1.0),
    ]


def _discovery(rows: Sequence[ScoredCase]) -> list[Target]:
    strange = [f for f in of_kind(rows, "outside") if f.distance is not None and f.distance >= 8]
    told = [f for f in strange if f.place is not None or f.discovered is None]
    nothing = of_kind(rows, "nothing")
    far = [f for f in strange if (f.distance or 0) >= 12 and f.removed is not None]
    if not any(f.discovered for f in rows):
        return []
    return [
        Target(name="discovered law: place right", found=_share(told, lambda f: bool(f.place)), at_least=0.85),
        Target(name="discovered law: variable and form right", found=_share(told, lambda f: bool(f.law)), at_least=0.7),
        Target(
            name="discovered law: held-out error removed by 80 % and more, distance >= 12",
            found=_share(far, lambda f: (f.removed or 0.0) >= 0.8),
            at_least=0.8,
        ),
        Target(
            name="discovery when nothing is hidden", found=_share(nothing, lambda f: bool(f.discovered)), at_most=0.02
        ),
    ]


def confidently_wrong(f: ScoredCase) -> bool:
    """A false name is said with confidence."""
    return f.verdict in NAMING and any(p >= SURE for p in f.false_names.values())


def _advice(f: ScoredCase) -> bool:
    return bool(f.advice)


def _right(f: ScoredCase) -> bool:
    return f.right


def _share(rows: Sequence[ScoredCase], flag: Callable[[ScoredCase], bool]) -> Share:
    return share_of([flag(f) for f in rows])
