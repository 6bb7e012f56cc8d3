"""Role, unit and place of every column: proposed by names, units and numbers, or stated by the mapping."""

import re
import unicodedata
from collections import defaultdict
from dataclasses import dataclass, field, replace

import numpy as np

from belt_sim.campaign.problems import did_you_mean
from belt_sim.campaign.sheet import RESERVED, check_signal_name
from belt_sim.campaign.types import PLACES
from belt_sim.errors import InputError
from belt_sim.importing.mapping import AxisEntry, ColumnEntry, MappingEntry
from belt_sim.importing.types import ROLES, Column, Logged, LoggedTable, Question, TableKind
from belt_sim.importing.units import UNITS, factor, split_unit, unit_named

#: role -> words that name it, longest first in effect; matched against a name in lower case without marks
WORDS: dict[str, tuple[str, ...]] = {
    "yaw_head": ("yaw head", "head yaw", "yaw_head", "antriebstrommel winkel", "winkel antrieb", "winkel kopf"),
    "yaw": (
        "yaw",
        "steer",
        "steering",
        "schwenkwinkel",
        "schwenk",
        "lenkwinkel",
        "gierwinkel",
        "gier",
        "stellwinkel",
        "schraegstellung",
        "skew angle",
        "schraenkung",
        "tail angle",
        "winkel",
        "angle",
        "verstellung",
    ),
    "u_rate": ("u_rate", "u rate", "rate u", "unsicherheit", "uncertainty"),
    "direction": ("direction", "richtung", "drehrichtung", "laufrichtung", "fahrtrichtung"),
    "run": ("run", "lauf nr", "laufnummer", "lauf", "versuch", "messung", "fahrt", "test", "trial", "experiment"),
    "speed": ("speed", "velocity", "geschwindigkeit", "bandgeschwindigkeit", "v band", "v belt", "geschw", "v"),
    "travel": (
        "travel",
        "belt travel",
        "bandweg",
        "laufweg",
        "weg",
        "distance",
        "strecke",
        "fahrweg",
        "laufstrecke",
        "encoder",
        "drehgeber",
        "s",
        "x",
    ),
    "time": ("time", "zeit", "timestamp", "zeitstempel", "uhrzeit", "datum", "date", "t", "clock", "sekunden"),
    "tension": (
        "tension",
        "bandzug",
        "bandspannung",
        "zugspannung",
        "zugkraft",
        "spannung",
        "bandkraft",
        "stress",
        "sigma",
        "kraft",
        "force",
        "zug",
        "load cell",
    ),
    "signal": (
        "kante",
        "bandkante",
        "edge",
        "lateral",
        "querlage",
        "querablage",
        "bandlage",
        "ablage",
        "versatz",
        "auswanderung",
        "wander",
        "displacement",
        "position",
        "quer",
        "tilt",
        "roll",
        "neigung",
        "kippwinkel",
        "rollwinkel",
        "verkippung",
        "laser",
        "sensor",
        "y",
    ),
}
TILT = ("tilt", "roll", "neigung", "kipp", "verkippung")
TAIL = ("tail", "umlenk", "heck", "spann", "hinten", "return", "unwind")
HEAD = ("head", "antrieb", "kopf", "drive", "vorn")
UPPER = ("upper", "top", "ober", "oben", "carry")
LOWER = ("lower", "bottom", "unter", "unten", "return strand")
_NUMBERED = re.compile(
    r"^(?:y|kante|edge|bandkante|lateral|pos|position|point|punkt|ablage|sensor|laser|p)[ _]*([1-4])\b"
)
_RATE = re.compile(r"^(?:rate|drift|driftrate|laufrate)[ _]*([1-4])?$")


def plain(name: str) -> str:
    """A name in lower case, umlauts written out, everything but letters and digits as blanks."""
    name = name.lower()
    for mark, letters in (("ä", "ae"), ("ö", "oe"), ("ü", "ue"), ("ß", "ss")):
        name = name.replace(mark, letters)
    name = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return " ".join(re.sub(r"[^a-z0-9]+", " ", name).split())


def role_named(name: str) -> str:
    """The role that a column's name speaks of; "" where it says nothing."""
    words = plain(name)
    rate = _RATE.match(words)
    if rate:
        return f"rate{rate.group(1) or 1}"
    if _NUMBERED.match(words) or re.fullmatch(r"y[ _]?\w?", words):
        return "signal"
    best = ("", 0)
    for role, names in WORDS.items():
        for known in names:
            known = plain(known)
            whole = re.search(rf"(?:^| ){re.escape(known)}(?: |\d|$)", words)
            within = len(known) > 4 and known in words
            if (whole or within) and len(known) > best[1]:
                best = (role, len(known))
    return best[0]


def place_named(name: str) -> str:
    """The place that a signal's name speaks of; "" where it says none, or not enough."""
    words = plain(name)
    upper, lower = (any(w in words for w in names) for names in (UPPER, LOWER))
    if any(w in words for w in TILT):
        return "lower_mid_span" if lower else "upper_mid_span"
    numbered = _NUMBERED.match(words)
    if numbered:
        return f"point_{numbered.group(1)}"
    tail, head = (any(w in words for w in names) for names in (TAIL, HEAD))
    if tail != head and upper != lower:
        return {(True, True): "point_1", (True, False): "point_2", (False, False): "point_3", (False, True): "point_4"}[
            (tail, upper)
        ]
    return ""


_STATED = {
    "tension": re.compile(r"(\d+(?:[.,]\d+)?) ?_?(?:N_?(?:/|p|per)?_?mm-?[2²]|MPa)", re.IGNORECASE),
    "yaw": re.compile(r"([+-]?(?<![\d.,])\d+(?:[.,]\d+)?) ?_?(mrad|urad|deg|grad|°)", re.IGNORECASE),
    "speed": re.compile(r"(\d+(?:[.,]\d+)?) ?_?(m_?(?:/|p|per)_?s|m_?(?:/|p|per)_?min)(?![a-z0-9])", re.IGNORECASE),
}


def settings_in(name: str) -> dict[str, str]:
    """Settings that the name of a file or run states: ``lauf3_10Nmm2_-0,042grad`` -> tension and yaw, with units."""
    found = {}
    for key, pattern in _STATED.items():
        seen = pattern.search(name)
        if seen:
            number = seen.group(1).replace(",", ".")
            units = {"tension": "N/mm2", "yaw": "deg", "speed": "m/s"}
            unit = units[key]
            if key == "yaw" and seen.group(2).lower() in ("mrad", "urad"):
                unit = seen.group(2).lower()
            if key == "speed" and "min" in seen.group(2).lower():
                unit = "m/min"
            found[key] = f"{number} {unit}"
    return found


#: role -> (units tried in this order, low and high of what a machine has [SI] as a 95 % span or level)
PLAUSIBLE: dict[str, tuple[tuple[str, ...], float, float]] = {
    "time": (("s", "ms", "min", "h"), 5.0, 2e5),
    "travel": (("m", "mm"), 2.0, 2e4),
    "speed": (("m/s", "m/min", "mm/s"), 0.02, 12.0),
    "tension": (("N/mm2", "N", "kN"), 1e6, 4e8),
    "yaw": (("deg", "mrad", "rad", "urad"), 2e-5, 0.02),
    "yaw_head": (("deg", "mrad", "rad", "urad"), 2e-5, 0.02),
    "signal": (("mm", "m", "um"), 2e-5, 0.2),
    "tilt": (("mrad", "deg", "rad"), 2e-5, 0.5),
    "rate": (("mm/m",), 1e-6, 0.2),
}
DAY = 86400.0  # [s]
#: Columns that a table has once.
ONCE = ("run", "time", "travel", "speed", "tension", "yaw", "yaw_head", "direction", "u_rate")


def proposed(table: LoggedTable) -> LoggedTable:
    """The table with a role, a unit and a place proposed for every column, and its kind."""
    columns = _dated([_proposed(column) for column in table.columns])
    for role in ONCE:
        same = [k for k, c in enumerate(columns) if c.role == role]
        keep = max(same, key=lambda k: (not columns[k].is_text, columns[k].sure, -k), default=None)
        for k in same:
            if k != keep:
                columns[k] = replace(columns[k], role="ignore", unit="", why=f"another column is the {role}")
    columns = _rising(columns)
    return replace(table, columns=tuple(columns), kind=_kind(columns))


def _proposed(column: Column) -> Column:
    """Role by the name and the unit; unit by the name or by magnitude."""
    name, unit = split_unit(column.name)
    unit = column.unit or unit or ""
    role = role_named(name)
    if column.is_text:
        role = "run" if role == "run" else "ignore"
        return replace(column, role=role, unit="", sure=False, why="text")
    if not np.isfinite(column.values).any():
        return replace(column, role="ignore", unit="", why="holds no numbers")
    dimension = UNITS[unit][0] if unit else ""
    if role and dimension and ROLES[role] and dimension not in ROLES[role]:
        role = _role_of_dimension(dimension)
    if not role and dimension:
        role = _role_of_dimension(dimension)
    if role.startswith(("rate", "u_rate")):
        return replace(column, role=role, unit=unit or "mm/m", sure=bool(unit), why="its name")
    if not role:
        return replace(column, role="", unit=unit, why="nothing is known of it")
    at = place_named(name) if role == "signal" else ""
    if role in ("run", "direction") or unit:
        return replace(column, role=role, unit=unit, at=at, sure=bool(unit), why="its name")
    tilt = role == "signal" and any(w in plain(name) for w in TILT)
    guess, why = _unit_by_size(column, "tilt" if tilt else role)
    return replace(column, role=role, unit=guess, at=at, why=f"its name; {why}")


def _dated(columns: list[Column]) -> list[Column]:
    """A column of dates and one of times of day as one time, so that a night does not begin a new run."""
    times = [k for k, c in enumerate(columns) if c.role == "time" and not c.is_text]
    dates = [k for k in times if _whole_days(columns[k].values)]
    clocks = [k for k in times if k not in dates and np.nanmax(columns[k].values) < DAY]
    if not dates or not clocks:
        return columns
    date, clock = columns[dates[0]], columns[clocks[0]]
    columns[dates[0]] = replace(date, role="ignore", unit="", why=f"in {clock.name} with the time of day")
    columns[clocks[0]] = replace(clock, values=date.values + clock.values, why=f"its name, with {date.name}")
    return columns


def _whole_days(values: np.ndarray) -> bool:
    there = values[np.isfinite(values)]
    return len(there) > 0 and bool(np.all(there > DAY) and np.all(there % DAY == 0.0))


def _role_of_dimension(dimension: str) -> str:
    return {"time": "time", "speed": "speed", "stress": "tension", "force": "tension"}.get(dimension, "")


def _unit_by_size(column: Column, role: str) -> tuple[str, str]:
    """The first unit in which the numbers are what a machine has, and that in words."""
    units, low, high = PLAUSIBLE[role]
    values = column.values[np.isfinite(column.values)]
    size = float(np.ptp(values)) if role in ("time", "travel", "signal") else float(np.abs(values).max())
    if role == "time" and len(values) > 2:
        step = float(np.median(np.abs(np.diff(values))))
        if step >= 1.0 and step == round(step) and size > 2e5:
            return "ms", f"steps of {step:g} in ms"
    for unit in units:
        if low <= size * UNITS[unit][1] <= high:
            return unit, f"{size:.3g} would be likely in {unit}"
    return (units[0], f"{size:.3g}, unlikely in any unit") if size else (units[0], "it does not change")


def _rising(columns: list[Column]) -> list[Column]:
    """Where neither time nor travel is named, the first column of unknown role that rises is what is asked for."""
    if any(c.role in ("time", "travel") for c in columns):
        return columns
    for k, column in enumerate(columns):
        if column.role == "" and not column.is_text and len(column.values) > 10 and (np.diff(column.values) > 0).all():
            columns[k] = replace(column, role="", why="it rises throughout: time or travel?")
            break
    return columns


def _kind(columns: list[Column]) -> TableKind:
    roles = {c.role for c in columns}
    if any(role.startswith("rate") for role in roles):
        return "rates"
    run = next((c for c in columns if c.role == "run"), None)
    if run is not None and len(set(run.values.tolist())) == len(run.values) and roles & {"tension", "yaw"}:
        return "settings" if not roles & {"signal", "time", "travel"} else "record"
    return "record"


#: dimension that a place measures
DIMENSION = {"lateral": "length", "tilt": "angle"}
#: unit in which signals are written
WRITTEN = {"lateral": "mm", "tilt": "mrad"}


@dataclass(frozen=True, kw_only=True)
class Used:
    """A column with its role, its factor to SI and its sign; name: of the signal in the campaign."""

    column: Column
    role: str
    unit: str
    factor: float
    at: str = ""
    name: str = ""
    entry: ColumnEntry = field(default_factory=ColumnEntry)

    def si(self, rows: np.ndarray) -> np.ndarray:
        """Numbers [SI]; of a force [N]; of an axis of a digitised picture, the value at each pixel."""
        values = self.column.values[rows].astype(float)
        if self.entry.axis is not None:
            values = on_axis(values, self.entry.axis)
        return self.entry.sign * self.factor * values


def on_axis(pixels: np.ndarray, axis: AxisEntry) -> np.ndarray:
    """Values at pixels of a digitised picture, from two marks of its axis."""
    (p0, p1), (v0, v1) = axis.pixel, axis.value
    if axis.log:
        v0, v1 = np.log(v0), np.log(v1)
    values = v0 + (pixels - p0) * (v1 - v0) / (p1 - p0)
    return np.exp(values) if axis.log else values


def used_columns(logged: Logged, mapping: MappingEntry) -> tuple[dict[str, tuple[Used, ...]], list[Question]]:
    """Table -> its columns as used, and what is not known of them; raises InputError for what cannot be."""
    unknown = [name for name in mapping.columns if name not in logged.columns]
    if unknown:
        remedy = f"no file has such a column; {did_you_mean(unknown[0], logged.columns)}"
        raise InputError(f"columns.{unknown[0]}", unknown[0], "", remedy)
    questions: dict[tuple[str, ...], Question] = {}
    used: dict[str, tuple[Used, ...]] = {}
    for table in logged.tables:
        found = []
        taken: dict[str | None, list[str]] = defaultdict(lambda: [e.name for e in mapping.columns.values() if e.name])
        along = {e.against for e in mapping.columns.values()}
        for column in table.columns:
            entry = mapping.columns.get(column.name, ColumnEntry())
            if column.name in along and entry.role is None:
                entry = entry.model_copy(update={"role": "travel"})
            one = _used(column, entry, taken[entry.run])
            if one.role == "signal" and not one.at:
                question = _place_question(column)
                questions.setdefault(question.path, question)
            found.append(one)
        used[table.name] = tuple(found)
        if table.kind == "record":
            for question in _lacking(table, used[table.name]):
                questions.setdefault(question.path, question)
    return used, list(questions.values())


def _used(column: Column, entry: ColumnEntry, taken: list[str]) -> Used:
    where = f"columns.{column.name}"
    role = entry.role or ("signal" if entry.at else column.role) or "ignore"
    at = (entry.at or column.at) if role == "signal" else ""
    if at and at not in PLACES:
        raise InputError(f"{where}.at", at, "", did_you_mean(at, PLACES))
    if column.is_text and role not in ("run", "ignore"):
        raise InputError(f"{where}.role", role, "", "holds text and can only be run or ignore")
    if not ROLES[role]:
        return Used(column=column, role=role, unit="", factor=1.0, entry=entry)
    kinds = (DIMENSION[PLACES[at]],) if at else ROLES[role]
    unit = _unit(column, entry, kinds, where)
    name = ""
    if role == "signal":
        name = entry.name or _signal_name(column, at, taken)
        taken.append(name)
        try:
            check_signal_name(name)
        except InputError as error:
            raise InputError(f"{where}.name", name, "", error.remedy) from None
    return Used(column=column, role=role, unit=unit, factor=UNITS[unit][1], at=at, name=name, entry=entry)


def _unit(column: Column, entry: ColumnEntry, kinds: tuple[str, ...], where: str) -> str:
    """The unit: as stated; as proposed, when it is of a kind that fits; else the usual one of that kind."""
    if entry.unit is not None:
        unit = unit_named(entry.unit)
        if unit is None or UNITS[unit][0] not in kinds:
            factor(entry.unit, kinds[0], f"{where}.unit")  # raises
            raise InputError(f"{where}.unit", entry.unit, "", f"give a unit of {' or '.join(kinds)}")
        return unit
    if column.unit and UNITS[column.unit][0] in kinds and (column.sure or entry.axis is None):
        return column.unit  # of pixels no unit can be guessed
    if entry.role == "travel":
        return "m"
    return {"length": "mm", "angle": "mrad", "time": "s", "speed": "m/s", "stress": "N/mm2", "number": "1"}[kinds[0]]


def _signal_name(column: Column, at: str, taken: list[str]) -> str:
    """y1 to y4 and tilt by place; a second one of a place gets a letter."""
    base = {"upper_mid_span": "tilt", "lower_mid_span": "tilt_lower"}.get(at, f"y{at[-1:]}" if at else "y")
    own = [base, *(f"{base}{c}" for c in "bcdefghijk")]
    return next((n for n in own if n not in taken and n not in RESERVED), column.name)


def _place_question(column: Column) -> Question:
    return Question(
        path=("columns", column.name, "at"),
        text=f"where does the column {column.name} measure? points 1 and 2: upper and lower end at the tail pulley (the"
        " one that yaws); 3 and 4: lower and upper end at the head pulley",
        example="point_1",
        options=tuple(PLACES),
    )


def _lacking(table: LoggedTable, used: tuple[Used, ...]) -> list[Question]:
    """Roles that a record cannot do without."""
    roles, found = {u.role for u in used}, []
    numbers = [u.column.name for u in used if not u.column.is_text and u.role == "ignore"]
    if not roles & {"time", "travel"}:
        name = next((u.column.name for u in used if u.column.why.startswith("it rises")), (numbers or ["..."])[0])
        found.append(
            Question(
                path=("columns", name, "role"),
                text=f"{table.file.name} has no column of time or travel that is known by its name; which is it?",
                example="time",
                options=("time", "travel"),
            )
        )
    if "signal" not in roles:
        left = [n for n in numbers if not found or n != found[0].path[1]]
        found += [
            Question(
                path=("columns", name, "at"),
                text=f"no column of {table.file.name} is known as a signal by its name; where does {name} measure?",
                example="point_1",
                options=tuple(PLACES),
            )
            for name in left[:1]
        ]
    return found
