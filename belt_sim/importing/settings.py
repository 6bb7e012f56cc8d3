"""Settings of a run, one function a source: the mapping, tables of runs, names, and columns of the record."""

import re
from dataclasses import dataclass

import numpy as np

from belt_sim.campaign.run_tables import NUMBERS
from belt_sim.errors import InputError
from belt_sim.importing.columns import LoggedTable
from belt_sim.importing.mapping import MappingEntry, Question, RunEntry
from belt_sim.importing.units import UNITS, plain_minus, quantity
from belt_sim.si import DEGREE, round_digits

#: setting -> its range, in the unit that a number without one has
RANGES = {name: bounds for name, bounds, _ in NUMBERS.values()}
#: A yaw that moves by less than this share of its largest value stands still.
STILL = 0.05
#: Digits that a logged setting is rounded to, and those of a place on the belt, of up to 20000 m.
DIGITS, START_DIGITS = 4, 7


@dataclass(frozen=True)
class Setting:
    """value [SI]; source: where it comes from, in words; text: as it goes into the mapping, "" of one that was logged,
    which is read off the record again when the import is repeated."""

    value: float
    source: str
    text: str = ""


Settings = dict[str, Setting]


# ---- stated: by the mapping, by a table of runs, by a name


def stated_settings(mapping: MappingEntry, run: str, listed: dict[str, Settings], section: float) -> Settings:
    """Settings of a run by all_runs, ``listed`` (tables of runs) and its own entry; of each the last that has it.

    section [m2]: of the belt, for a tension given as a force, nan where it is not known yet.
    """
    own = _settings_of(mapping.runs.get(run, RunEntry()), f"runs.{run}", section)
    return _settings_of(mapping.all_runs, "all_runs", section) | listed.get(run, {}) | own


def _settings_of(entry: RunEntry, where: str, section: float) -> Settings:
    texts = {key: getattr(entry, key) for key in RANGES if getattr(entry, key) is not None}
    return {k: Setting(_number(t, k, f"{where}.{k}", section), "the mapping", t) for k, t in texts.items()}


def table_settings(tables: list[LoggedTable], section: float) -> dict[str, Settings]:
    """Run -> settings that tables of runs state, one row a run."""
    found: dict[str, Settings] = {}
    for table in tables:
        run = table.column("run")
        labels = [f"r{k}" for k in range(1, len(table.lines) + 1)] if run is None else run.labels
        columns = [(c, c.si()) for c in table.columns if c.role in RANGES]
        for row, label in enumerate(labels):
            own = found.setdefault(run_name(label), {})
            for column, values in columns:
                if np.isfinite(values[row]):
                    value = float(values[row]) / (section if column.is_force else 1.0)
                    unit = RANGES[column.role].unit
                    text = f"{value / UNITS[unit][1]:.6g} {unit}".strip()
                    own[column.role] = Setting(value, "the table of runs", text)
    return found


def run_name(text: str) -> str:
    """A name that a run may have in a campaign: letters, digits, blanks and _ . + - only, beginning with a letter."""
    kept = "".join(c if c.isalnum() or c in "_.+- " else "_" for c in text).strip(" .+-")
    kept = " ".join(kept.split())[:60].strip()
    return f"r{kept}" if kept[:1].isdigit() or not kept else kept


_NAMED = {
    "tension": re.compile(r"(\d+(?:[.,]\d+)?) ?_?(N_?(?:/|p|per)?_?mm-?[2²]|MPa)", re.IGNORECASE),
    "yaw": re.compile(r"([+-]?(?<![\d.,])\d+(?:[.,]\d+)?) ?_?(mrad|urad|mdeg|deg|grad|°)", re.IGNORECASE),
    "speed": re.compile(r"(\d+(?:[.,]\d+)?) ?_?(m_?(?:/|p|per)_?s|m_?(?:/|p|per)_?min)(?![a-z0-9])", re.IGNORECASE),
}


def name_settings(name: str, section: float) -> Settings:
    """Settings that the name of a file or run states: ``lauf3_10Nmm2_-0,042grad`` -> tension and yaw."""
    found: Settings = {}
    for key, pattern in _NAMED.items():
        seen = pattern.search(plain_minus(name))
        if seen:
            number, unit = seen.group(1).replace(",", "."), seen.group(2).lower()
            unit = "m/min" if "min" in unit else unit if unit in ("mrad", "urad", "mdeg") else RANGES[key].unit
            text = f"{number} {unit}"
            found[key] = Setting(_number(text, key, key, section), f"the name {name}", text)
    return found


def _number(text: str, key: str, where: str, section: float) -> float:
    """A setting [SI]; raises InputError for what cannot be."""
    bounds = RANGES[key]
    kinds = (bounds.dimension, "force") if key == "tension" else (bounds.dimension,)
    value, _, unit = quantity(text, kinds, bounds.unit or "1", where)
    dimension, scale = UNITS[unit]
    if dimension == "force":
        return value * scale / section
    si = bounds.check(value, unit, name=where)
    if key == "direction" and abs(value) != 1.0:
        raise InputError(where, f"{value:g}", "", "must be 1 (upper span runs from head to tail) or -1")
    return si


# ---- read off the record


def yaw_settings(block: LoggedTable, travel: np.ndarray, known: Settings) -> Settings:
    """The yaw that columns hold, and the place of its step where ``known`` has none; travel [m], shape (n,)."""
    found: Settings = {}
    for key in ("yaw", "yaw_head"):
        values = _logged_values(block, key)
        if values is None:
            continue
        level, at = _step(block, key, values, key in known)
        found[key] = Setting(round_digits(level, DIGITS), "its column")
        if at and "yaw_at" not in known | found:
            before, after = travel[at - 1 : at + 1]
            words = f"the step of {key}, somewhere within {after - before:.2g} m"
            u = round_digits((after - before) / np.sqrt(12.0), DIGITS)
            found |= {"yaw_at": Setting(0.5 * (before + after), words), "yaw_at_u": Setting(u, words)}
    return found


def column_settings(block: LoggedTable, section: float) -> Settings:
    """The mean tension, the direction, and where on the belt the run starts, of columns that hold them."""
    found: Settings = {}
    tension, start, direction = (_logged_values(block, k) for k in ("tension", "start", "direction"))
    if tension is not None:
        mean = float(np.nanmean(tension)) / (section if any(c.is_force for c in block.columns) else 1.0)
        found["tension"] = Setting(round_digits(mean, DIGITS), "the mean of its column")
    if start is not None:
        found["start"] = Setting(round_digits(float(start[np.isfinite(start)][0]), START_DIGITS), "its column")
    if direction is not None:
        found["direction"] = Setting(float(np.sign(np.nanmedian(direction))) or 1.0, "its column")
    return found


def _logged_values(block: LoggedTable, role: str) -> np.ndarray | None:
    """Numbers [SI] of a column; None where it holds none."""
    values = block.values(role)
    return None if values is None or not np.isfinite(values).any() else values


def _step(block: LoggedTable, key: str, values: np.ndarray, stated: bool) -> tuple[float, int]:
    """Level of a yaw after its step, and the row of the step (0: it stood there from the beginning)."""
    there = np.flatnonzero(np.isfinite(values))
    y = values[there]
    ends = max(1, len(y) // 50)
    before, after = float(np.median(y[:ends])), float(np.median(y[-ends:]))
    change = after - before
    if abs(change) <= STILL * np.abs(y).max():
        return float(np.median(y)), 0
    beyond = (y - before) / change > 0.5
    at = int(np.argmax(beyond))
    if not stated and np.mean(beyond[at:]) < 0.98:
        again = at + int(np.argmin(beyond[at:]))
        remedy = "the yaw moves more than once; cut the record into runs, one yaw step each"
        raise block.refuse(there[again], key, float(y[again] / DEGREE), "deg", remedy)
    if not stated and abs(before) > STILL * abs(after):
        given = f"runs: {{{block.name}: {{{key}: ...}}}}"
        remedy = f"the yaw is not zero before its step; begin a run at zero yaw, or state {given}"
        raise block.refuse(there[0], key, float(before / DEGREE), "deg", remedy)
    return after, int(there[at])


# ---- what nothing tells


def questions(name: str, settings: Settings, file: str) -> list[Question]:
    """Questions on settings of a run that nothing tells."""
    asked = {
        "tension": (f"at which tension was run {name} ({file})?", "10 N/mm2"),
        "yaw": (
            f"to which yaw was the tail pulley turned in run {name} ({file}; 0 for a run without yaw)?",
            "-0.042 deg",
        ),
    }
    return [Question(path=("runs", name, k), text=t, example=e) for k, (t, e) in asked.items() if k not in settings]
