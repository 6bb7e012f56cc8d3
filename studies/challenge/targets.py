"""The target table: every figure with its count, its interval and what is wanted."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np
from scipy.stats import binomtest

from belt_sim.results.diagnosis import RESOLVED, SURE_APART
from studies.challenge.score import NAMING, SURE, ScoredCase

SIZES = (3, 6, 12, 24)
_BETWEEN = {3: (2.0, 4.5), 6: (4.5, 9.0), 12: (9.0, 18.0), 24: (18.0, 1e9)}  # geometric means lie between sizes
SEEN = 6 * 0.8  # d from which an effect is to be named
GOOD_REMOVAL = 0.9
Flag = Callable[[ScoredCase], bool]
_right: Flag = attrgetter("right")


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
    nothing, library, two, strange, dirty = (
        of_kind(rows, k) for k in ("nothing", "library", "two", "outside", "dirty")
    )
    visible = of_kind(rows, "library", "two", least=SEEN)
    clean = [f for f in rows if f.kind not in ("dirty", "not_drawn")]
    near, far = (
        [f for f in strange if low <= (f.distance or 0.0) <= high] for low, high in ((8, 12), (12.0001, np.inf))
    )
    sizes = [len(f.answer_set) / max(1, len(f.hidden)) for f in visible if f.verdict in NAMING]
    large = [f for f in of_kind(rows, "library", "two", least=12 * 0.8) if f.removed is not None]
    advised = [f for f in rows if f.advice is not None]
    sure, unsure = ([f for f in advised if ((f.promised or 0.0) >= SURE_APART) is whether] for whether in (True, False))
    of_size = {size: [f for f in library if size_class(f.size) == size] for size in SIZES}
    promise = "next-run advice resolves the pair, where {} promised"
    named = f"mean size for one effect {np.mean(sizes):.2f}, wanted <= 2" if sizes else ""
    mean = f"mean {np.mean([f.removed for f in large]):.0%}" if large else ""

    def row(name: str, cases: Sequence[ScoredCase], flag: Flag, least=None, most=None, note: str = "") -> Target:
        return Target(name=name, found=share_of([flag(f) for f in cases]), at_least=least, at_most=most, note=note)

    found = [
        row("false alarm when nothing is hidden", nothing, lambda f: not f.right, most=0.05),
        row("right effect first, d = 6", of_size[6], _right, 0.90),
        row("right effect first, d = 12", of_size[12], _right, 0.98),
        row("right effect first, d = 24", of_size[24], _right, 0.99),
        row("right effect first, d = 3", of_size[3], _right),
        row("truth named or in the confusable set, d >= 6", visible, lambda f: {*f.hidden} <= f.answer_set, 0.97,
            note=named),
        row("confidently wrong, d >= 6", visible, confidently_wrong, most=0.01),
        row("two effects, exact set", two, _right, 0.92),
        row("unknown effect flagged, distance 8-12", near, _right, 0.80),
        row("unknown effect flagged, distance > 12", far, _right, 0.95),
        row("false names where the effect is not in the library", near + far, lambda f: bool(f.false_names), most=0.05,
            note="distance 8 and more"),
        row("dirty data caught before fitting", dirty, lambda f: f.caught, 0.95),
        row("clean data taken for damaged", clean, lambda f: f.verdict == "cannot_say", most=0.02),
        Target(name="95 % interval holds the true value", found=share_of([x for f in rows for x in f.covered]),
               at_least=0.93, note="wanted 93-97 %"),
        row("reducible held-out error removed by 90 % and more, d >= 12", large,
            lambda f: (f.removed or 0.0) >= GOOD_REMOVAL, 0.90, note=mean),
        row(promise.format(f"{SURE_APART:g} sigma are"), sure, lambda f: bool(f.advice), 0.90),
        row(promise.format(f"{RESOLVED:g} to {SURE_APART:g} are"), unsure, lambda f: bool(f.advice)),
        row("answered without a crash", rows, lambda f: f.outcome != "crash", 1.0),
    ]  # fmt: skip
    if not any(f.discovered for f in rows):
        return found
    told = [f for f in near + far if f.place is not None or f.discovered is None]
    lost = [f for f in strange if (f.distance or 0.0) >= 12 and f.removed is not None]
    return [
        *found,
        row("discovered law: place right", told, lambda f: bool(f.place), 0.85),
        row("discovered law: variable and form right", told, lambda f: bool(f.law), 0.7),
        row("discovered law: held-out error removed by 80 % and more, distance >= 12", lost,
            lambda f: (f.removed or 0.0) >= 0.8, 0.8),
        row("discovery when nothing is hidden", nothing, lambda f: bool(f.discovered), most=0.02),
    ]  # fmt: skip


def confidently_wrong(f: ScoredCase) -> bool:
    """A false name is said with confidence."""
    return f.verdict in NAMING and any(p >= SURE for p in f.false_names.values())
