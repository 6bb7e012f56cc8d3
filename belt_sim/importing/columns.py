"""Tables of a logger and their columns: what was logged, and its role, unit and place.

These are proposed by a column's name and unit; what the mapping states comes before, and what neither says is asked.
"""

import re
import unicodedata
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from belt_sim.campaign.sheet import RESERVED, check_name
from belt_sim.campaign.types import (
    ELSEWHERE_EXAMPLE,
    PLACES,
    CampaignError,
    did_you_mean,
    kind_at,
    quote,
    refusal,
    shortlist,
)
from belt_sim.errors import InputError
from belt_sim.importing.mapping import DAY, ROLES, ColumnEntry, MappingEntry, Question, ask, texts_of
from belt_sim.settings import SIGNAL_DIMENSION
from belt_sim.units import NAMES, OTHER, UNITS, quantity, scaled_unit, split_units, unit_of

#: dimension -> unit that a question proposes, and in which a signal is written
USUAL_UNITS = {"length": "mm", "angle": "mrad", "time": "s", "speed": "m/s", "stress": "N/mm2", "number": "1"}
SYNONYMS_FILE = "synonyms.yaml"  # what people call roles, places and directions, and what they remark
#: place -> usual name of the signal there
SIGNAL_NAMES = {place: place.replace("point_", "y") for place in PLACES}
SIGNAL_NAMES |= {"upper_mid_span": "tilt", "lower_mid_span": "tilt_lower"}

#: Rows of a record are closer in time than this [s]; runs of a table are not.
SPARSE = 60.0
#: dimension of a unit -> role of a column whose name says nothing, or nothing that has this unit
BY_DIMENSION = {"time": "time", "speed": "speed", "stress": "tension", "force": "tension", "line load": "tension"}
#: Columns that a table has once, and those of which several may be added or averaged.
ONCE = ("run", "time", "travel", "speed", "tension", "yaw", "yaw_head", "direction", "yaw_at", "start", "y0", "u_rate")
OF_SEVERAL = {"tension": ("sum", "mean"), "yaw": ("mean",), "speed": ("mean",), "travel": ("mean",)}
_NUMBERED = re.compile(
    r"^(?:y|kante|edge|bandkante|lateral|pos|position|point|punkt|ablage|sensor|laser|p)[ _]*([1-4])\b"
)
UNKNOWN = "nothing is known of it"
#: What tells a second column of one name from the first.
_COUNT = re.compile(r" \((?:[a-z]|no \d+)\)$")
#: What a header remarks on the sign of its numbers.
_SIGN = re.compile(r"\b(?:positi|negati)v\w*\b[^()\[\]]*|[+-] ?= ?[^()\[\]]*", re.IGNORECASE)
#: Where a header states its unit.
_STATED = re.compile(r"\[\s*([^\]]+?)\s*\]|\(\s*(\S{2,8}|[A-Z])\s*\)|(?:\s+in\s+|\s*/\s*)(\S{1,8})$")
_RATE = re.compile(r"^(?:rate|drift|driftrate|laufrate)[ _]*([1-4])?$")


#: a clock goes on at midnight, and is set by an hour in spring and autumn, where the step left is below so many steps
NEXT, SHORT = 20.0, 60.0


@dataclass(frozen=True)
class Note:
    """A remark; about: the file, run or column that it is about ("" for all)."""

    about: str
    text: str

    def __str__(self) -> str:
        return f"{self.about}: {self.text}" if self.about else self.text


@dataclass(frozen=True, kw_only=True)
class Column:
    """One column as logged and what it is.

    name, values: its header; numbers (n,), nan where blank, or texts (object dtype). stamp: whether they were dates or
    times of day, zone: theirs; asked: key of ``format`` that settles which of the readings (answer -> values) holds, ""
    where there is one; first_cell: as it stands in the file; open_use: columns of one role of which nobody knows which
    is meant; stated_units: what the file states as its unit, known or not; is_lost: whether it has texts where its name
    and unit tell of numbers; proposed_by: where the proposal comes from. role, unit, at: as proposed ("": not known),
    after ``resolve_columns`` as used; factor: to SI, sign included; signal: its name in the campaign.
    """

    name: str
    values: np.ndarray
    stamp: bool = False
    zone: str = ""
    asked: str = ""
    readings: Mapping[str, np.ndarray] = field(default_factory=dict)
    first_cell: str = ""
    open_use: tuple[str, ...] = ()
    stated_units: tuple[str, ...] = ()
    is_lost: bool = False
    proposed_by: str = ""
    role: str = ""
    unit: str = ""
    at: str = ""
    table: str = ""
    factor: float = 1.0
    signal: str = ""
    entry: ColumnEntry = field(default_factory=ColumnEntry)

    @property
    def is_text(self) -> bool:
        return self.values.dtype == object

    @property
    def numbers(self) -> np.ndarray:
        """The numbers as logged, without blanks; none of texts."""
        return np.empty(0) if self.is_text else self.values[np.isfinite(self.values)]

    @property
    def half_digit(self) -> float:
        """Half of the last digit [SI] that its numbers need; of 10.00 as of 10."""
        numbers = self.numbers
        digits = (k for k in range(13) if np.allclose(np.round(numbers, k), numbers, rtol=1e-12, atol=0.0))
        return 0.5 * abs(self.factor) * 10.0 ** -next(digits, 13)

    @property
    def why(self) -> str:
        """Where role and unit come from, in words."""
        return "the mapping" if self.entry.role or self.entry.unit or self.entry.at else self.proposed_by

    def si(self) -> np.ndarray:
        """Numbers [SI]; of a force [N]; of an axis of a digitised picture, the value at each pixel."""
        values = self.values.astype(float)
        if (axis := self.entry.axis) is not None:
            values = axis.value[0] + (values - axis.pixel[0]) * axis.scale
        return self.factor * values

    @property
    def middle(self) -> float | None:
        """The reading [SI] with the belt in the middle of the pulleys; None where the mapping does not state it."""
        if self.entry.middle is None or self.role != "signal":
            return None
        value, _, unit = quantity(self.entry.middle, (self.dimension,), self.unit, f"columns.{self.name}.middle")
        return value * (self.factor if unit == self.unit else UNITS[unit][1] * self.entry.factor * self.entry.sign)

    @property
    def dimension(self) -> str:
        return UNITS[self.unit][0] if self.unit else ""

    @property
    def dimensions(self) -> tuple[str, ...]:
        """Dimensions that its unit may have, by its place or its role."""
        kind = kind_at(self.at)
        return (SIGNAL_DIMENSION[kind],) if kind else ROLES.get(self.role, ())

    def stated_units_of(self, *dimensions: str) -> list[str]:
        """Units of these dimensions that the file states, no two alike."""
        known = {UNITS[u]: u for u in self.stated_units if u in UNITS}
        return [unit for (dimension, _), unit in known.items() if dimension in dimensions]

    @property
    def stated_unit(self) -> str:
        """The unit that the file states: the only one that goes with its place or role, else all that it states."""
        fitting = self.stated_units_of(*self.dimensions)
        return fitting[0] if len(fitting) == 1 else " and ".join(dict.fromkeys(self.stated_units))

    @property
    def stroke_unit(self) -> str:
        """The unit of length of a yaw that was read as the stroke of a cylinder; "" where it was not."""
        if self.role not in ("yaw", "yaw_head") or self.entry.unit or self.stated_units_of("angle"):
            return ""
        lengths = self.stated_units_of("length")
        return lengths[0] if len(lengths) == 1 else ""

    @property
    def labels(self) -> list[str]:
        """The cells as texts, "" where blank."""
        if self.is_text:
            return [str(c).strip() for c in self.values]
        return ["" if np.isnan(c) else f"{c:.15g}" for c in self.values]

    @property
    def by_hand(self) -> float | None:
        """One sigma [SI] of reading a digitised picture; None for a column that was logged."""
        axis = self.entry.axis
        return None if axis is None else abs(axis.scale * self.factor) * axis.u


@dataclass(frozen=True, kw_only=True)
class LoggedTable:
    """One file, one sheet of it, or the rows of one run.

    lines: line in the file of every row that was kept, from 1, shape (n,); starts: rows at which the file begins anew
    (its header stands there again); label: of a run, the text that may state its settings.
    """

    name: str
    file: Path
    columns: tuple[Column, ...]
    lines: np.ndarray
    starts: tuple[int, ...] = ()
    kind: Literal["record", "settings", "rates"] = "record"
    notes: tuple[Note, ...] = ()
    label: str = ""

    def column(self, role: str) -> Column | None:
        """The first column with this role; None where there is none."""
        return next((c for c in self.columns if c.role == role), None)

    def values(self, role: str) -> np.ndarray | None:
        """Numbers [SI] of the column with this role, None where there is none or it holds no number."""
        found = self.column(role)
        return None if found is None or not len(found.numbers) else found.si()

    def select_rows(self, rows: np.ndarray) -> "LoggedTable":
        """The table with these rows only."""
        columns = tuple(
            replace(c, values=c.values[rows], readings={n: v[rows] for n, v in c.readings.items()})
            for c in self.columns
        )
        return replace(self, columns=columns, lines=self.lines[rows])

    def refuse(self, row: int, name: str, value: object, unit: str, remedy: str) -> CampaignError:
        """The error of a row."""
        return refusal(self.file, remedy, line=int(self.lines[row]), name=name, value=value, unit=unit)


#: everything that was read
LoggedTables = tuple[LoggedTable, ...]


# ---- what names say


def plain(name: str) -> str:
    """A name in lower case, umlauts written out, words apart, all but letters and digits blank."""
    name = re.sub(r"(?<=[a-zäöü])(?=[A-ZÄÖÜ][a-zäöü])", " ", name).lower()
    for mark, letters in (("ä", "ae"), ("ö", "oe"), ("ü", "ue"), ("ß", "ss")):
        name = name.replace(mark, letters)
    name = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return " ".join(re.sub(r"[^a-z0-9]+", " ", name).split())


def roles_named(name: str) -> list[str]:
    """The roles that a column's name speaks of, the clearest first."""
    words = plain(name)
    rate = _RATE.match(words)
    if rate:
        return [f"rate{rate.group(1) or 1}"]
    spoken = {
        known: role
        for role, names in texts_of(SYNONYMS_FILE)["roles"].items()
        for known in names
        if _speaks_of(words, known)
    }
    first = ["signal"] if _NUMBERED.match(words) or re.fullmatch(r"y[ _]?[a-z1-9]?", words) else []
    return list(dict.fromkeys(first + [spoken[known] for known in sorted(spoken, key=len, reverse=True)]))


def _remarks(name: str, part: str) -> bool:
    """Whether a name has a word of this part of the remarks, and does not deny it: (no wind)."""
    words = re.sub(r"\b(?:no|without|ohne) \w+", "", plain(name))
    return any(_speaks_of(words, known) for known in texts_of(SYNONYMS_FILE)["remarks"][part])


def _speaks_of(words: str, known: str) -> bool:
    """Whether words hold a known name: as a word of its own, or, if it is long, as a part of one."""
    if len(known) == 1:  # x, s, t, v name a column alone, not sensor s1
        return words == known
    return bool(re.search(rf"(?:^| ){re.escape(known)}(?: |\d|$)", words)) or (len(known) > 4 and known in words)


def place_named(name: str) -> str:
    """The place that a signal's name speaks of; "" where it says none, or not enough."""
    words = plain(name)
    says = {part: any(w in words for w in names) for part, names in texts_of(SYNONYMS_FILE)["places"].items()}
    if says["tilt"]:
        return "lower_mid_span" if says["lower"] else "upper_mid_span"
    numbered, named = _NUMBERED.match(words), ""
    if says["tail"] != says["head"] and says["upper"] != says["lower"]:
        named = f"point_{(1 if says['upper'] else 2) if says['tail'] else (4 if says['upper'] else 3)}"
    if numbered and named in ("", f"point_{numbered.group(1)}"):
        return f"point_{numbered.group(1)}"
    return "" if numbered and words[0] in "ykbeal" else named  # y1 at another place than point 1: asked


# ---- proposals


def propose_roles(table: LoggedTable) -> LoggedTable:
    """The table with a role, a unit and a place proposed for every column, and its kind: a record, or a row a run of
    settings or of steady rates."""
    names, notes = {c.name for c in table.columns}, list(table.notes)
    columns = [_propose(c, c.name if (first := _COUNT.sub("", c.name)) not in names else first) for c in table.columns]
    # a column of dates and one of times of day are one time, so that a night does not begin a new run
    stamps = {k: c.numbers for k, c in enumerate(columns) if c.role == "time" and c.stamp and len(c.numbers)}
    dates = [k for k, s in stamps.items() if np.all((s > DAY) & (s % DAY == 0.0))]
    clocks = [k for k, s in stamps.items() if k not in dates and s.max() < DAY]
    if dates and clocks:
        date, clock = columns[dates[0]], columns[clocks[0]]
        of_day = clock.readings.get("hh:mm", clock.values)  # a clock beside a date is none of minutes and seconds
        both = replace(date, name=clock.name, values=date.values + of_day, proposed_by=f"its name, with {date.name}")
        readings = {order: days + of_day for order, days in date.readings.items()}
        columns[dates[0]] = replace(date, role="ignore", unit="", proposed_by=f"in {clock.name} with the time of day")
        columns[clocks[0]] = replace(both, readings=readings)
    for k, column in enumerate(columns):
        if column.stamp and column.role == "time":
            values, remarks = wind_on(column.values)
            readings = {name: wind_on(seconds)[0] for name, seconds in column.readings.items()}
            columns[k] = replace(column, values=values, readings=readings)
            notes += [Note(table.name, f"{column.name}: {remark}") for remark in remarks]
    roles = {c.role for c in columns}
    kind: Literal["record", "settings", "rates"] = "record"
    run = next((c for c in columns if c.role == "run"), None)
    times = [np.diff(np.unique(c.numbers)) for c in columns if c.role == "time"]
    timed = any(len(steps) and float(np.median(steps)) < SPARSE for steps in times)
    if any(role.startswith("rate") for role in roles):
        kind = "rates"
    elif run is not None and roles & {"tension", "yaw"} and _has_row_a_run(run):
        kind = "record" if timed or roles & {"signal", "travel"} else "settings"
    return replace(table, columns=tuple(columns), kind=kind, notes=tuple(notes))


def _has_row_a_run(run: Column) -> bool:
    """Whether a column of runs is of a table with a row a run, remarks under it left aside; a record has more rows."""
    rows = max((k for k, label in enumerate(run.labels, start=1) if label), default=0)
    return len(set(run.values.tolist())) == len(run.values) or 0 < rows <= 2 * len({*run.labels} - {""})


def _propose(column: Column, header: str) -> Column:
    """Role by the name of its header: of those that it speaks of the first that has a unit which the file states, else
    the first; by the unit only where the name speaks of none. Words are names of runs, or directions (1 and -1 of
    forward and reverse, nan where blank), or of no use."""
    name, units = split_units(header)
    # what stands in the place of a unit, as [V], (kgf) or in furlongs
    known = [names for group in ("roles", "places", "remarks") for names in texts_of(SYNONYMS_FILE)[group].values()]
    for found in _STATED.finditer(header) if not (units or column.unit) else ():
        text = next(part for part in found.groups() if part)
        spoken = any(_speaks_of(plain(text), word) for names in known for word in names if len(word) > 1)
        if re.search(r"[^\W\d_]|[%‰°]", text) and not spoken:
            name, units = header[: found.start()] + header[found.end() :], (text,)
            break
    if column.unit:  # a row of units holds no remarks as headers do
        kind = UNITS.get(column.unit, ("",))[0]
        units = (*(u for u in units if UNITS[u][0] == kind and not column.stamp), column.unit)
    column, kinds = replace(column, unit="", stated_units=units), {UNITS[u][0] for u in units if u in UNITS}
    named = [role for role in roles_named(name) if role != "speed" or not _remarks(name, "of_air")]
    named = ["start"] if plain(name) == "start" and kinds == {"length"} else named  # start [m], not a start of its time
    role = named[0] if named else ""
    if column.is_text:
        said, words = texts_of(SYNONYMS_FILE)["directions"], [plain(v) for v in column.values]
        signs = {"": np.nan} | dict.fromkeys(said["forward"], 1.0) | dict.fromkeys(said["reverse"], -1.0)
        if role == "direction" and any(words) and signs.keys() >= {*words}:
            values, why = np.array([signs[w] for w in words]), "its name and words"
            return replace(column, values=values, role=role, unit="1", proposed_by=why)
        is_lost = bool(role) and ROLES[role] != () and bool(kinds)
        why = f"text, though its name and unit say {role}" if is_lost else "text"
        return replace(column, role="run" if role == "run" else "ignore", unit="", is_lost=is_lost, proposed_by=why)
    if not len(column.numbers):
        return replace(column, role="ignore", unit="", proposed_by="holds no numbers")
    place, why = place_named(name), "its name"
    may_be = [*named, *(["signal"] if place and "length" in kinds else [])]
    is_stroke = role in ("yaw", "yaw_head") and kinds == {"length"} and "signal" not in may_be
    if not is_stroke:
        role = next((r for r in may_be if not kinds.isdisjoint(ROLES[r])), role)
    if not role and len(kinds) == 1 and not _remarks(name, "of_air"):
        role, why = BY_DIMENSION.get(next(iter(kinds)), ""), "its unit"
    column = replace(column, role=role, at=place if role == "signal" else "")
    stated = column.stated_unit
    unit = stated if UNITS.get(stated, ("",))[0] in column.dimensions else ""
    if is_stroke:
        why = f"its name; a yaw in {stated} needs its lever"
    elif stated and column.dimensions and not unit:
        why = f"its name; its unit {stated} is not clear" if kinds else f"its name; its unit {stated} is not known"
    return replace(column, unit=unit, proposed_by=why if role else UNKNOWN)


def wind_on(seconds: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Seconds (n,) that go on over midnight and over an hour's change of the clock, and remarks on where they do."""
    there = np.flatnonzero(np.isfinite(seconds))
    out, steps, remarks = seconds.copy(), np.diff(seconds[there]), []
    usual = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 1.0
    changes = [(DAY, SHORT, "the clock passed midnight")] if len(there) and np.nanmax(seconds) <= DAY else []
    hour = ((seconds[there][:-1] % DAY) / 3600.0 >= 1) & ((seconds[there][:-1] % DAY) / 3600.0 <= 4)
    changes += [(3600.0, 5.0, "the clock was set back by an hour"), (-3600.0, 5.0, "the clock was set on by an hour")]
    for shift, short, remark in changes:
        left = steps + shift
        at = np.flatnonzero((left > 0.0) & (left <= max(short, NEXT * usual)) & ((steps < 0.0) | (shift < 0.0)))
        at = at if shift == DAY else at[hour[at] & (left[at] <= max(short, 5.0 * usual))]
        for k in at:
            out[there[k + 1] :] += shift
        if len(at):
            remarks.append(remark)
    return out, remarks


# ---- columns as they are used: by the mapping, else as proposed


def resolve_columns(logged: LoggedTables, mapping: MappingEntry) -> list[LoggedTable]:
    """Tables with every column as the mapping states it, else as proposed; of a run, no two signals get one name.

    Raises InputError for what cannot be.
    """
    names = [c.name for table in logged for c in table.columns]
    strange = next((name for name in mapping.columns if name not in names), None)
    if strange is not None:
        remedy = f"no file has such a column; {did_you_mean(strange, names)}"
        raise InputError(f"columns.{strange}", strange, "", remedy)
    along = {e.against for e in mapping.columns.values()}
    stated = [e.name for e in mapping.columns.values() if e.name]
    form, tables = mapping.format, []
    for table in logged:
        taken: dict[str | None, list[str]] = defaultdict(lambda: [*stated])
        columns: list[Column] = []
        for column in table.columns:
            entry = mapping.columns.get(column.name, ColumnEntry())
            if column.name in along and entry.role is None:
                entry = entry.model_copy(update={"role": "travel"})
            settled = getattr(form, column.asked) if column.asked else None
            if column.asked == "decimal" and settled is None:
                settled = OTHER.get(form.thousands or "")
            if column.asked and (meant := column.readings.get(str(settled))) is not None:
                elapsed = form.time in ("mm:ss", "d:hh:mm:ss") and column.asked == "time"  # no time of day
                column = replace(column, values=meant, asked="", stamp=column.stamp and not elapsed)
            columns.append(_resolve(replace(column, table=table.name, entry=entry), taken[entry.run]))
            taken[entry.run].append(columns[-1].signal)
        notes = list(table.notes)
        for k, column in enumerate(columns):
            twin = next((c.name for c in columns[:k] if (c.at, c.entry.run) == (column.at, column.entry.run)), "")
            if column.at and twin and not column.entry.at:
                notes.append(Note(column.name, f"measures at {column.at}, as {twin} does: is {column.signal}"))
        for role in ONCE:
            same = [k for k, c in enumerate(columns) if c.role == role and not c.entry.run and c.name not in along]
            if len(same) > 1:
                _use_one(role, same, columns, mapping.use.get(role, ""), notes, table.kind)
        table = replace(table, columns=tuple(columns))
        run = table.column("run") if table.kind != "record" else None
        named = np.array([label != "" for label in run.labels]) if run else np.ones(1, dtype=bool)
        if run and named.any() and not named.all():  # remarks under a table, a mean
            lines = shortlist(table.lines[~named])
            notes.append(Note(table.name, f"{run.name} is blank in line {lines}: left out, as of no run"))
            table = table.select_rows(named)
        tables.append(replace(table, notes=tuple(notes)))
    return tables


def _use_one(role: str, same: list[int], columns: list[Column], use: str, notes: list[Note], kind: str) -> None:
    """Leave one of several columns of a role, or their sum or mean, in place; where nothing tells which, all but the
    first are marked ``open`` for a question."""
    if use in OF_SEVERAL.get(role, ()):
        together = np.stack([columns[k].si() for k in same])
        total = together.sum(axis=0) if use == "sum" else together.mean(axis=0)
        first, names = columns[same[0]], ", ".join(columns[k].name for k in same)
        if len({columns[k].dimension for k in same}) > 1:
            raise InputError(f"use.{role}", use, "", f"{names} are in units of several kinds; name one of them")
        columns[same[0]] = replace(first, values=total / first.factor, proposed_by=f"{use} of {names}")
        chosen, why = same[:1], f"in the {use} of {names}"
    else:
        named = [k for k in same if columns[k].name == use]
        stated = [k for k in same if columns[k].entry.role]
        numbers = [k for k in same if not columns[k].is_text]
        actual = [k for k in numbers if not _remarks(columns[k].name, "demanded")]
        counted = [k for k in numbers if columns[k].stated_unit and not columns[k].stamp] if role == "time" else []
        chosen = next((c for c in (named, stated, numbers, actual, counted[:1]) if len(c) == 1), [])
        if (not chosen and role in ("run", "direction", "start", "yaw_at", "y0", "u_rate")) or kind != "record":
            chosen = chosen or (numbers or same)[:1]
        why = f"another column is the {role}"
        if chosen and chosen == actual and chosen != named and len(numbers) > 1:
            set_points = ", ".join(columns[k].name for k in same if k not in chosen)
            notes.append(Note(columns[chosen[0]].name, f"is taken as the {role}; {set_points} is what was set"))
    for k in same:
        if chosen and k not in chosen:
            columns[k] = replace(columns[k], role="ignore", unit="", at="", signal="", proposed_by=why)
        elif not chosen:
            columns[k] = replace(columns[k], open_use=tuple(columns[j].name for j in same))


def _resolve(column: Column, taken: list[str]) -> Column:
    """A column as its entry of the mapping states it, else as proposed; taken: names of other signals.

    Its unit is as stated by the mapping, else by the file; "" where neither states one that is known and of its kind.
    """
    where, entry = f"columns.{column.name}", column.entry
    role = entry.role or ("signal" if entry.at else column.role) or "ignore"
    at = (entry.at or column.at) if role == "signal" else ""
    if entry.at and role == "ignore":
        raise InputError(f"{where}.role", role, "", "leave it out (or role: signal) where at says what it measures")
    if at and kind_at(at) is None:
        raise InputError(f"{where}.at", at, "", f"{did_you_mean(at, PLACES)}, or {ELSEWHERE_EXAMPLE}")
    if column.is_text and role not in ("run", "ignore"):
        raise InputError(f"{where}.role", role, "", "holds text and can only be run or ignore")
    column = replace(column, role=role, at=at)
    stated = column.stated_unit
    if not (kinds := column.dimensions):
        return replace(column, unit="", asked="")
    own, unit = (scaled_unit(entry.unit) if entry.unit else None) or (1.0, entry.unit)
    if column.stroke_unit:
        own, unit = UNITS[column.stroke_unit][1], "rad"  # after entry.factor, 1/lever
    if unit is not None:
        unit = unit_of(unit, kinds, f"{where}.unit")
    elif stated and UNITS.get(stated, ("",))[0] in kinds:
        unit = stated
    elif entry.axis is not None:  # marks of an axis
        unit = "m" if entry.role == "travel" else USUAL_UNITS[kinds[0]]
    else:  # rates are mm per m, as steady.csv has them
        unit = "1" if kinds == ("number",) else "mm/m" if "rate" in role and not stated else ""

    signal = ""
    if role == "signal":  # y1 to y4 and tilt by place; a second one of a place gets a letter
        base = SIGNAL_NAMES.get(at, "y")
        free = (n for n in (base, *(f"{base}{c}" for c in "bcdefghijk")) if n not in taken and n not in RESERVED)
        signal = entry.name or next(free, column.name)
        try:
            check_name(signal, reserved=RESERVED)
        except InputError as error:
            raise InputError(f"{where}.name", signal, "", error.remedy) from None
    scale = UNITS[unit][1] * own * entry.factor * entry.sign
    return replace(column, unit=unit, factor=scale, signal=signal)


# ---- what the mapping must or may still say


#: Where points 1-4 are.
DRAWING = """\
   4 -------- upper span -------- 1
 head pulley         tail pulley (steers)
   3 -------- lower span -------- 2
"""


def column_questions(used: list[LoggedTable]) -> tuple[list[Question], list[Question]]:
    """Questions that must be answered, and those about columns that are left out as long as nobody answers; used: the
    tables as resolved. Raises CampaignError for a record without any number."""
    found: list[Question] = []
    for table in used:
        found += [ask("place", name=c.name) for c in table.columns if c.role == "signal" and not c.at]
        found += [question for column in table.columns for question in _open_questions(column, table)]
        if table.kind != "record":
            continue
        # a record cannot do without these roles
        roles, file = {c.role for c in table.columns}, table.file.name
        numbers = [c for c in table.columns if not c.is_text and c.role == "ignore"]
        if not roles & {"time", "travel"}:
            rising = [c for c in numbers if len(c.values) > 10 and (np.diff(c.values) > 0.0).all()]
            first = next(iter((*rising, *numbers)), None)
            if first is None:
                remedy = "no column holds numbers that could be time or travel; give the log as numbers"
                raise refusal(table.file, remedy, name="columns", value=", ".join(c.name for c in table.columns))
            numbers = [c for c in numbers if c.name != first.name]
            likelier_first = ("travel", "time") if first.stated_units_of("length") else ("time", "travel")
            found.append(ask("time_or_travel", likelier_first, name=first.name, file=file))
        if "signal" not in roles and numbers:
            found.append(ask("signal", name=numbers[0].name, file=file))
    missing = {question.path: question for question in reversed(found)}  # of one path the first
    asked = {path[1] for path in missing}
    options = (*PLACES, *(r for r in ROLES if not r.startswith(("signal", "rate", "u_rate"))))
    columns = [c for t in used if t.kind == "record" for c in t.columns if c.role == "ignore" and not c.entry.role]
    names = dict.fromkeys(c.name for c in columns if c.proposed_by == UNKNOWN and c.name not in asked)
    unknown = [ask("place_or_role", options, proposed="ignore", name=name) for name in names]
    return [missing[path] for path in dict.fromkeys(q.path for q in found)], unknown


def span_of(column: Column) -> str:
    """The first and the last number of a column as they are understood: 0 to 30 m."""
    there = column.numbers
    if not len(there) or not column.unit:
        return f"{there[0]:.6g} to {there[-1]:.6g}" if len(there) else ""
    if column.stamp:
        ends = [str(np.datetime64(int(x), "s")).replace("T", " ") for x in (there[0], there[-1])]
        return " to ".join(ends if there[0] >= 2.0 * DAY else [e.split(" ")[1] for e in ends])
    shown = [x * column.factor / UNITS[column.unit][1] for x in (there[0], there[-1])]
    return f"{shown[0]:.6g} to {shown[1]:.6g} {column.unit}".removesuffix(" 1")


def _open_questions(column: Column, table: LoggedTable) -> Iterator[Question]:
    """What is open about a column: readings between which nothing decides, its sign, which of several is meant, and a
    unit that the file states but that is not known or does not go with the role."""
    words: dict[str, Any] = {"name": column.name, "role": column.role, "file": table.file.name}
    words |= {"span": span_of(column), "stated": column.stated_unit}
    stated, entry = column.stated_unit, column.entry
    if column.asked and column.role != "ignore":
        say = {}
        for answer, values in column.readings.items():
            first, last = values[np.isfinite(values)][[0, -1]]
            say[answer] = f"{first:.10g} to {last:.10g}" + " s" * (column.asked == "time")
            if column.asked == "date":
                say[answer] = " to ".join(str(np.datetime64(int(x), "s")).replace("T", " ") for x in (first, last))
        shown = "; ".join(f"{answer} makes it {text}" for answer, text in say.items())
        yield ask(column.asked, [*say], cell=column.first_cell, shown=shown, **words)
    remark = _SIGN.search(column.name)
    if remark and column.role in ("signal", "yaw", "yaw_head") and "sign" not in entry.model_fields_set:
        yield ask("sign", remark=remark.group().strip(" ()[],;"), **words)
    if column.stroke_unit and "factor" not in entry.model_fields_set:
        yield ask("lever", **words)
    if column.open_use:
        shown = "; ".join(f"{c.name}: {span_of(c)}" for c in table.columns if c.name in column.open_use)
        more = OF_SEVERAL.get(column.role, ())
        several = f", or is it their {' or '.join(more)}" if more else ""
        several += " (a force is that of one strand; an axle bears two: factor: 0.5)" if "sum" in more else ""
        yield ask("use", (*column.open_use, *more), shown=shown, several=several, **words)
    if column.is_lost and not entry.role:
        yield ask("texts", cell=quote(next(filter(None, column.labels))), **words)
    if (kinds := column.dimensions) and not column.unit:
        there = column.numbers
        words["numbers"] = f" ({there[0]:.6g} to {there[-1]:.6g})" if len(there) else ""
        usual, units = USUAL_UNITS[kinds[0]], [u for u in NAMES if UNITS[u][0] in kinds]
        scaled = scaled_unit(stated) if stated else None
        if scaled and UNITS[scaled[1]][0] in kinds:
            yield ask("unit_or_step", (stated, scaled[1]), unit=scaled[1], **words)
        elif len(fitting := column.stated_units_of(*kinds)) > 1:
            yield ask("unit_of_several", fitting, **words)
        elif stated:
            yield ask("unit_unknown", [*units, "ignore"], usual, kinds=" or ".join(kinds), **words)
        else:
            yield ask("unit", units, usual, **words)
    is_force = column.role == "tension" and UNITS.get(column.unit, ("",))[0] == "force"
    if is_force and "factor" not in entry.model_fields_set:
        if _remarks(column.name, "of_two"):
            yield ask("both_strands", **words)
        one_side = [
            [w for w in plain(c.name).split() if not _remarks(w, "of_one_side")] for c in (column, *table.columns)
        ]
        if _remarks(column.name, "of_one_side") and one_side[1:].count(one_side[0]) < 2:
            yield ask("one_side", **words)
