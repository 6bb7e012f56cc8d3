"""Which role, unit and place each column seems to have: by its name, its units, and what its numbers could be."""

from dataclasses import replace

import numpy as np

from belt_sim.intake.nouns import ROLES, Column, LoggedTable, TableKind
from belt_sim.intake.units import UNITS, split_unit
from belt_sim.intake.words import TILT, place_named, plain, role_named

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
