"""How far a model is from a campaign: by run, by condition, and where it fails; a comparison of both, what pictures
draw of it in the units people read, and a check of what a campaign can tell."""

import operator
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, PlainSerializer, computed_field, model_serializer, model_validator

from belt_sim.campaign.types import Campaign, Kind
from belt_sim.results import words
from belt_sim.results.estimates import Array, Free, MachineSizes, StoredEffect, display_unit, file_field
from belt_sim.results.simulation import SETTING_DIGITS
from belt_sim.results.words import Display, Table, dataset
from belt_sim.units import DEGREE, MM, MM_PER_M, N_PER_MM2


@dataclass(frozen=True, kw_only=True)
class Panel:
    """One run and signal over ``travel`` [m], all (n,), in ``unit``; band: half width about the model, where model and
    measurement cannot be told apart (k u_val); title: which run, signal and condition."""

    run: str
    title: str
    travel: Array
    measured: Array
    base: Array
    band: Array
    final: Array | None = None
    unit: str = "mm"

    @property
    def misfit(self) -> float:
        """Mean of |base - measured| over the half width of the band; 0 where nothing was measured."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.abs(self.base - self.measured) / np.maximum(self.band, 1e-12)
        return float(np.mean(ratio[np.isfinite(ratio)])) if np.isfinite(ratio).any() else 0.0


@dataclass(frozen=True, kw_only=True)
class FailureMap:
    """E/u_val of one signal and yaw sign: ``ratio`` (t, w), NaN where not measured; tension [N/mm2] (t,); edges [m] of
    the travel windows (w + 1,)."""

    title: str
    tension: Array
    edges: Array
    ratio: Array


@dataclass(frozen=True, kw_only=True)
class Drift:
    """``value`` +- ``u`` (one sigma), shape (t,), of one parameter of one model at each ``tension`` [N/mm2]; u = 0:
    ended at the limit of its range; stated: what the rig's sheet says, if anything, with u_stated."""

    parameter: str
    unit: str
    tension: Array
    value: Array
    u: Array
    stated: float | None = None
    u_stated: float = 0.0


#: of one parameter before and after effects were added; in files a list of such pairs
StoredDrifts = Annotated[
    tuple[Drift, ...],
    BeforeValidator(lambda pairs: [drift for pair in pairs for drift in pair if drift]),
    PlainSerializer(lambda two: [(*two, None)[:2]] if two else [], return_type=list[tuple[Drift, Drift | None]]),
]


@dataclass(frozen=True, kw_only=True)
class Drawings:
    """overlays: a Panel a run and signal; maps: E/u_val by signal and yaw sign; drifts: of the modulus, before and
    after effects were added; machine: in whose terms numbers are told."""

    overlays: tuple[Panel, ...] = ()
    maps: tuple[FailureMap, ...] = ()
    drifts: StoredDrifts = ()
    machine: MachineSizes | None = None


RISEN = 1.05  # of an error, above which it has risen: a refit without a condition is one step, good to some per cent
UNIT_OF_KIND: dict[Kind, str] = {"lateral": "mm", "tilt": "mrad"}


@dataclass(frozen=True, kw_only=True)
class Change:
    """rms of the lateral signals before and after effects were added [m]."""

    before: Annotated[float, file_field("before_mm", MM)]
    after: Annotated[float, file_field("after_mm", MM)]


@dataclass(frozen=True, kw_only=True)
class OwnChange(Change):
    """The same beside what each run's zero, gain and settings most likely are; floor: what noise alone makes [m]."""

    floor: Annotated[float, file_field("noise_floor_mm", MM)]


@dataclass(frozen=True, kw_only=True)
class Errors:
    """Over the fitted runs, over what was held out, by held-out condition; noise_floor [m]: of noise and settings;
    untestable: conditions that alone show one of the numbers; own: over what was held out, beside each run's own zero
    and settings."""

    noise_floor: Annotated[float, file_field("noise_floor_mm", MM)]
    fit: Annotated[Change | None, file_field("fit", omit_empty=True)] = None
    held_out: Annotated[Change | None, file_field("held_out", omit_empty=True)] = None
    by_condition: Annotated[Mapping[str, Change], file_field("held_out_by_condition", omit_empty=True)] = field(
        default_factory=dict
    )
    untestable: Annotated[tuple[str, ...], file_field("held_out_untestable", omit_empty=True)] = ()
    own: Annotated[OwnChange | None, file_field("beside_settings", omit_empty=True)] = None

    def worse(self) -> dict[str, Change]:
        """The changes of held-out conditions that test something and in which the error rises."""
        floor = self.own.floor if self.own else 0.0
        rows = {n: c for n, c in self.by_condition.items() if n not in self.untestable}
        return {n: c for n, c in rows.items() if c.after > max(RISEN * c.before, floor)}

    def rows(self) -> dict[str, Change]:
        """The changes in words: of unseen and of fitted runs, then of each condition when it was left out."""
        note = dict.fromkeys(self.untestable, " (not testable by hold-out)")
        rows = {"unseen runs": self.held_out, "fitted runs": self.fit}
        rows |= {f"{n}{note.get(n, '')}, unseen": row for n, row in self.by_condition.items()}
        return {name: row for name, row in rows.items() if row is not None}


StoredKind = Annotated[
    Kind,
    Field(alias="unit"),
    BeforeValidator(lambda unit: {known: kind for kind, known in UNIT_OF_KIND.items()}[unit]),
    PlainSerializer(lambda kind: UNIT_OF_KIND[kind], return_type=str),
]


@dataclass(frozen=True, kw_only=True)
class RunError:
    """rms error of one run and signal before and after, and what the uncertainties alone would make it (floor) [m], of
    a tilt [rad]; worse: after is worse than before, and beyond the floor; measured_rate, modelled_rate: late rates of
    the record and of the final model's [m/m or rad/m]."""

    run: str
    signal: str
    tension: Annotated[float, file_field("tension_n_per_mm2", N_PER_MM2, digits=SETTING_DIGITS)]
    yaw: Annotated[float, file_field("yaw_deg", DEGREE, digits=SETTING_DIGITS)]
    use: str
    kind: StoredKind
    before: Annotated[float, file_field("before", MM)]
    after: Annotated[float, file_field("after", MM)]
    floor: Annotated[float, file_field("floor", MM)]
    worse: bool
    measured_rate: Annotated[float | None, file_field("measured", MM)]
    modelled_rate: Annotated[float | None, file_field("modelled", MM)]

    @property
    def unit(self) -> str:
        """mm, or mrad of a tilt."""
        return UNIT_OF_KIND[self.kind]

    @model_serializer(mode="wrap")
    def _to_file(self, handler: Any) -> dict[str, Any]:
        """Return a row of per_run; the unit stands in the name of the late rate, too."""
        row: dict[str, Any] = handler(self)
        return row | {name: {f"late_rate_{self.unit}_per_m": row[name]} for name in ("measured", "modelled")}

    @model_validator(mode="before")
    @classmethod
    def _from_file(cls, row: Any) -> Any:
        return row | {name: row[name][f"late_rate_{row['unit']}_per_m"] for name in ("measured", "modelled")}


@dataclass(frozen=True, kw_only=True)
class Worst:
    """The cell in which a model is furthest off: travel window [m], ratio = E over its uncertainty."""

    run: str
    signal: str
    travel: Annotated[tuple[float, float], file_field("travel_m")]
    ratio: float


@dataclass(frozen=True, kw_only=True)
class Where:
    """Where a model fails; boundary: the tension [Pa] at which it stops being adequate, where there is one."""

    worst: Worst
    sentence: str
    boundary: Annotated[float | None, file_field("boundary_n_per_mm2", N_PER_MM2)]
    boundary_sentence: str


@dataclass(frozen=True, kw_only=True)
class SteadyError:
    """Measured and modelled late rate of one point [m/m], u one sigma, ratio |E| / u; tension [Pa]."""

    run: str
    point: int
    tension: Annotated[float, file_field("tension_n_per_mm2", N_PER_MM2, digits=SETTING_DIGITS)]
    measured: Annotated[float, file_field("measured_mm_per_m", MM_PER_M)]
    modelled: Annotated[float, file_field("modelled_mm_per_m", MM_PER_M)]
    u: Annotated[float, file_field("u_mm_per_m", MM_PER_M)]
    ratio: float


def error_grid(result: Any) -> Any:
    """rms before and after of every run and signal, and the floor, as an xarray Dataset in SI."""
    import pandas as pd

    table = pd.DataFrame([vars(r) for r in result.per_run])
    grid = {n: table.pivot(index="run", columns="signal", values=n) for n in ("before", "after", "floor")}
    runs, signals = table["run"].unique(), table["signal"].unique()
    settings = table.drop_duplicates("run")
    coords = {"run": runs, "signal": signals} | {n: ("run", settings[n].to_numpy()) for n in ("tension", "yaw")}
    values = {n: (("run", "signal"), g.loc[runs, signals].to_numpy()) for n, g in grid.items()}
    return dataset(values, coords, units={"tension": "Pa", "yaw": "rad"})


@dataclass(frozen=True, kw_only=True)
class CampaignLabel:
    """Which campaign: title, SHA-256 of its files (empty when not read from disk), measured, digitised or synthetic."""

    title: str
    sha256: str
    source: str

    @staticmethod
    def of(campaign: Campaign) -> "CampaignLabel":
        return CampaignLabel(title=campaign.title, sha256=campaign.sha256, source=campaign.source.kind)

    @property
    def readings(self) -> str:
        """What the readings are, as a legend says it."""
        return {"synthetic": "simulated measurement", "digitised": "read off a figure"}.get(self.source, "measured")


#: a label of which files hold no more than title and hash
ShortLabel = Annotated[
    CampaignLabel,
    PlainSerializer(lambda label: {"title": label.title, "sha256": label.sha256}, return_type=dict[str, str]),
]


STEADY_K = 2.0  # a steady rate is off when it lies further than so many u from the stated one


@dataclass(frozen=True, kw_only=True, repr=False)
class Comparison(Display):
    """Error of every run and signal of ``base_model``, before and after ``effects``, and where the model fails.

    where: None of a campaign of steady rates; steady: those rates, point by point; error: None without a lateral
    signal; beyond: limits of its validity that the model is used beyond, a sentence each.
    """

    base_model: str
    campaign: ShortLabel
    effects: tuple[StoredEffect, ...]
    error: Annotated[Errors | None, file_field("error", omit_empty=True)]
    where: Annotated[Where | None, file_field("where", omit_empty=True)]
    per_run: Annotated[tuple[RunError, ...], file_field("per_run", omit_empty=True)]
    steady: tuple[SteadyError, ...]
    provenance: Free
    drawings: Annotated[Drawings, Field(exclude=True)] = field(default_factory=Drawings)
    beyond: Annotated[tuple[str, ...], file_field("beyond_validity", omit_empty=True)] = ()

    @computed_field(exclude_if=operator.not_)  # type: ignore[prop-decorator]
    @property
    def drift(self) -> list[Drift]:
        """Return the drift of the fitted modulus, before and after effects were added."""
        return list(self.drawings.drifts)

    @property
    def final_model(self) -> str:
        return " + ".join([self.base_model, *(e.id for e in self.effects)])

    def lines(self) -> Sequence[str]:
        """Where the model fails; with effects, how the error changed and what got worse."""
        said, names = [f"{self.final_model} against {self.campaign.title}"], ", ".join(e.id for e in self.effects)
        if self.where is not None:
            said += [self.where.sentence, self.where.boundary_sentence]
        if self.where is not None and self.effects:
            if self.error is not None:
                for name, row in replace(self.error, by_condition={}).rows().items():
                    said.append(f"{name}: rms {words.column(row.before)} -> {words.column(row.after)} mm with {names}")
                said.append(f"noise and settings alone {words.column(self.error.noise_floor)} mm")
            worse = [f"{r.run} {r.signal}" for r in self.per_run if r.worse]
            said.append(f"got worse: {', '.join(worse)}" if worse else "no run got worse")
        return [*said, *self.beyond]

    def tables(self) -> Sequence[Table]:
        """Steady rates, where there are some; error of every run and signal, and the late rates that people compare,
        where what is alike in all rows is no column."""
        tables = []
        if self.steady:  # marked where the model is off
            columns = ("run", "point", "N/mm2", "measured", "u", "modelled", "|E|/u")
            rows = []
            for s in self.steady:
                rates = [words.column(v) for v in (s.measured, s.u, s.modelled)]
                rows.append((s.run, str(s.point), f"{s.tension / N_PER_MM2:g}", *rates, words.decimal(s.ratio, 1)))
            marked = [k for k, s in enumerate(self.steady) if s.ratio > STEADY_K]
            title = f"steady rates in mm per m, {self.final_model}"
            tables.append(Table(title, columns, rows, left=("run",), marked=marked))
        if self.per_run:
            uses, units = ({getattr(r, name) for r in self.per_run} for name in ("use", "unit"))
            data, errors = "measured" if self.campaign.readings == "measured" else "in the data", []
            for r in self.per_run:
                row = {"run": r.run, "signal": r.signal}
                row |= {"N/mm2": f"{r.tension / N_PER_MM2:g}", "yaw deg": f"{r.yaw / DEGREE:+.3g}"}
                row |= {"use": r.use.replace("_", " ")} if len(uses) > 1 else {}
                row |= {"unit": r.unit} if len(units) > 1 else {}
                row["rms"] = words.column(r.before)
                row |= {"after": words.column(r.after)} if self.effects else {}
                row |= {"floor": words.column(r.floor), "late rate": words.column(r.modelled_rate, sign=True)}
                errors.append(row | {data: words.column(r.measured_rate, sign=True)})
            unit = units.pop() if len(units) == 1 else ""
            title = f"Errors [{unit}] and late rates [{unit}/m]" if unit else "Errors, and late rates per m"
            marked = [k for k, r in enumerate(self.per_run) if r.worse]
            left, cells = ("run", "signal", "use", "unit"), [list(row.values()) for row in errors]
            tables.append(Table(title, list(errors[0]), cells, left=left, marked=marked))
        return tables

    def to_pandas(self) -> Any:
        """A row a run and signal in SI; of a campaign of steady rates, a row a run and point."""
        import pandas as pd

        return pd.json_normalize([asdict(r) for r in self.per_run or self.steady], sep="_")

    to_xarray = error_grid


# A check: what is wrong with a campaign, what it can tell, and what not.

SHOWN_PAIRS = 15
WELL = 0.1  # of the largest plausible size


@dataclass(frozen=True, kw_only=True)
class Visible:
    """The smallest size of an effect that would show, in SI, None where none does; parameter: the one of its numbers
    that shows best; share: that size over the largest that a machine could have."""

    effect: str
    parameter: str
    unit: str
    meaning: Annotated[str, Field(exclude=True)]
    smallest: float | None
    largest_plausible: float
    share: Annotated[float, Field(exclude=True)]

    @computed_field(alias="seen")  # type: ignore[prop-decorator]
    @property
    def word(self) -> str:
        if self.smallest is None:
            return "not at all"
        return "well" if self.share < WELL else "when large" if self.share < 1.0 else "not at a plausible size"


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Two effects that could not be told apart: sigma apart at a size that is plain to see; what further run tells
    them apart, and sigma with it (None where none does, or none was looked for)."""

    effects: tuple[str, str]
    sigma: float
    action: Annotated[str | None, file_field("best_further_run")] = None
    sigma_after: Annotated[float | None, file_field("sigma_with_it")] = None


@dataclass(frozen=True, kw_only=True)
class Doubt:
    """Something in the data that looks like a slip, or in the plan that a diagnosis will miss."""

    kind: str
    sentence: str
    stops: bool = False


@dataclass(frozen=True, kw_only=True, repr=False)
class Check(Display):
    """What a campaign can tell of what ``base_model`` may lack; planned: whether its runs are still to be measured.

    runs: names of those that it is judged by; missing: of those that are still to be measured where others are.
    """

    campaign: ShortLabel
    base_model: str
    planned: bool
    runs: Annotated[tuple[str, ...], PlainSerializer(len, return_type=int)]
    missing: tuple[str, ...] = ()
    noise: str
    doubts: tuple[Doubt, ...]
    visible: tuple[Visible, ...]
    pairs: Annotated[tuple[Pair, ...], file_field("not_told_apart")]
    provenance: Free
    machine: Annotated[MachineSizes | None, Field(exclude=True)] = None

    def lines(self) -> Sequence[str]:
        """What is wrong, and what can be seen, in sentences."""
        many = f"{len(self.runs)} run{'' if len(self.runs) == 1 else 's'}"
        state = f"is planned, {many}, without readings yet" if self.planned else f"is a valid campaign, {many}"
        if self.missing:
            of = len(self.runs) + len(self.missing)
            there, still = ", ".join(self.runs), ", ".join(self.missing)
            state = f"{len(self.runs)} of {of} runs are there ({there}), which what follows is about; "
            state += f"still missing: {still}"
        said = [f"{self.campaign.title}: {state}.", self.noise, *(f"{d.kind}: {d.sentence}" for d in self.doubts)]
        if self.visible:
            seen = sum(v.share < 1.0 for v in self.visible)
            said.append(f"{seen} of {len(self.visible)} effects would show at a size that is plausible on a machine.")
        if self.visible and not self.pairs:
            said.append("Any two of them can be told apart where both are plain to see.")
        elif self.visible:
            helped = sum(p.action is not None for p in self.pairs)
            more = f"; one more run would separate {helped} of them" if helped else ""
            many = "1 pair of effects looks" if len(self.pairs) == 1 else f"{len(self.pairs)} pairs of effects look"
            said.append(f"{many} alike in these runs, even at a plain size (12 sigma){more}.")
        return said

    def tables(self) -> Sequence[Table]:
        """The smallest size of every effect that would show, as people at a machine measure it; pairs look alike."""
        tables, rows = [], []
        for v in self.visible:
            factor, unit = display_unit(v.effect, v.parameter, v.unit, self.machine)
            sizes = [words.number(s and factor * s, 2) for s in (v.smallest, v.largest_plausible)]
            rows.append((f"{v.effect}.{v.parameter}", *sizes, unit, v.word.removeprefix("when ").split(" ")[0]))
        if self.visible:
            columns: tuple[str, ...] = ("number of an effect", "shows from", "up to", "unit", "seen")
            left = ("number of an effect", "unit", "seen")
            hidden = [k for k, v in enumerate(self.visible) if v.share >= 1.0]
            title = "Smallest size that shows in 9 of 10 cases, and the largest plausible size"
            tables.append(Table(title, columns, rows, left=left, marked=hidden))
        if self.pairs:  # the most alike first, and the best further run for each
            rows = []
            for p in self.pairs[:SHOWN_PAIRS]:
                further = p.action or words.NO_NUMBER, words.number(p.sigma_after, 2)
                rows.append((" - ".join(p.effects), words.number(p.sigma, 2), *further))
            more = f" ({SHOWN_PAIRS} of {len(self.pairs)} shown)" if len(self.pairs) > SHOWN_PAIRS else ""
            columns = ("pair", "sigma apart", "best further run", "sigma with it")
            tables.append(Table(f"Pairs these runs cannot separate{more}", columns, rows, left=columns[::2]))
        return tables

    def to_pandas(self) -> Any:
        """A row an effect, in SI."""
        import pandas as pd

        return pd.DataFrame([vars(v) for v in self.visible])
