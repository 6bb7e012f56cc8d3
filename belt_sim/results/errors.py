"""How far a model is from a campaign: by run, by condition, and where it fails."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from belt_sim.campaign.types import Kind
from belt_sim.results.display import dataset

UNITS: dict[Kind, str] = {"lateral": "mm", "tilt": "mrad"}


@dataclass(frozen=True, kw_only=True)
class Change:
    """rms of the lateral signals before and after effects were added [m]."""

    before: float
    after: float


@dataclass(frozen=True, kw_only=True)
class OwnChange(Change):
    """The same beside what each run's zero, gain and settings most likely are; floor: a perfect model's [m]."""

    floor: float


@dataclass(frozen=True, kw_only=True)
class Errors:
    """Over the fitted runs, over what was held out, by held-out condition, and what the uncertainties alone make [m].

    untestable: conditions that alone show one of the numbers, so that leaving them out tests nothing; own: over what
    was held out, beside each run's own zero and settings.
    """

    noise_floor: float
    fit: Change | None = None
    held_out: Change | None = None
    by_condition: Mapping[str, Change] = field(default_factory=dict)
    untestable: tuple[str, ...] = ()
    own: OwnChange | None = None

    def left_out(self) -> dict[str, Change]:
        """The changes by held-out condition, in words that say which of them test nothing."""
        note = " (not testable by hold-out)"
        return {f"without {n}{note if n in self.untestable else ''}": row for n, row in self.by_condition.items()}

    def rows(self) -> dict[str, Change]:
        """The changes that there are, by name."""
        return {name: row for name, row in (("fit", self.fit), ("held_out", self.held_out)) if row is not None}


@dataclass(frozen=True, kw_only=True)
class Features:
    """What people read off a record: late_rate [m/m or rad/m], first_move: travel to the first 0.1 mm (0.1 mrad) [m],
    overshoot beyond the late line [m or rad]; None where the record does not show it.
    """

    late_rate: float | None = None
    first_move: float | None = None
    overshoot: float | None = None


@dataclass(frozen=True, kw_only=True)
class RunError:
    """rms error of one run and signal before and after, and what the uncertainties alone would make it (floor).

    tension [Pa], yaw [rad]; before, after, floor [m] of a lateral signal, [rad] of a tilt; worse: after is worse than
    before, and beyond the floor; measured, modelled: features of the record and of the final model's.
    """

    run: str
    signal: str
    kind: Kind
    tension: float
    yaw: float
    use: str
    before: float
    after: float
    floor: float
    worse: bool
    measured: Features
    modelled: Features

    @property
    def unit(self) -> str:
        """The unit in which people read it: mm, or mrad of a tilt."""
        return UNITS[self.kind]


@dataclass(frozen=True, kw_only=True)
class Worst:
    """The cell in which a model is furthest off: travel window [m], ratio = E over its uncertainty."""

    run: str
    signal: str
    travel: tuple[float, float]
    ratio: float


@dataclass(frozen=True, kw_only=True)
class Where:
    """Where a model fails; boundary: the tension [Pa] at which it stops being adequate, where there is one."""

    worst: Worst
    sentence: str
    boundary: float | None
    boundary_sentence: str


@dataclass(frozen=True, kw_only=True)
class SteadyError:
    """Measured and modelled late rate of one point [m/m], u one sigma, ratio |E| / u; tension [Pa]."""

    run: str
    point: int
    tension: float
    measured: float
    modelled: float
    u: float
    ratio: float


def error_grid(rows: Sequence[RunError]) -> Any:
    """rms before, after and floor as an xarray Dataset over run and signal, in SI."""
    runs, signals = list(dict.fromkeys(r.run for r in rows)), list(dict.fromkeys(r.signal for r in rows))
    found = {(r.run, r.signal): r for r in rows}
    names = ("before", "after", "floor")
    grid = {
        n: [[getattr(found[r, s], n) if (r, s) in found else float("nan") for s in signals] for r in runs]
        for n in names
    }
    first = {r.run: r for r in reversed(rows)}
    settings = {n: [getattr(first[r], n) for r in runs] for n in ("tension", "yaw")}
    coords = {"run": runs, "signal": signals} | {n: ("run", v) for n, v in settings.items()}
    return dataset({n: (("run", "signal"), v) for n, v in grid.items()}, coords, units={"tension": "Pa", "yaw": "rad"})


@dataclass(frozen=True, kw_only=True)
class CampaignLabel:
    """Which campaign: title, SHA-256 of its files (empty when not read from disk), measured, digitised or synthetic."""

    title: str
    sha256: str
    source: str
