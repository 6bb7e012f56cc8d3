"""Tables -> runs with their travel, signals and settings, as far as these are known."""

from dataclasses import dataclass, replace

import numpy as np

from belt_sim.errors import InputError
from belt_sim.intake.mapping import MappingEntry, RunEntry
from belt_sim.intake.nouns import LoggedTable
from belt_sim.intake.proposal import Question
from belt_sim.intake.resample import Track, merged
from belt_sim.intake.roles import Used
from belt_sim.intake.split import FEWEST, Block, blocks_of, run_name
from belt_sim.intake.stated import KINDS, Settings, from_columns, from_entry, from_name, of_tables
from belt_sim.intake.way import Way, way_of


@dataclass(frozen=True, kw_only=True)
class Made:
    """One run as far as it is known: key, its name in the mapping; entry: what the mapping says of it."""

    key: str
    entry: RunEntry
    track: Track
    settings: Settings
    file: str
    notes: tuple[str, ...]


def made_of(
    tables: list[tuple[LoggedTable, tuple[Used, ...]]], mapping: MappingEntry, section: float | None
) -> tuple[list[Made], list[Question], list[str]]:
    """Runs of all tables, questions, and all names that the mapping may speak of."""
    records = [(t, u) for t, u in tables if t.kind == "record"]
    listed = of_tables([(t, u) for t, u in tables if t.kind == "settings"], section)
    questions: list[Question] = []
    found: dict[str, list[Made]] = {}
    for table, used in records:
        for view in _views(table, used):
            for block in _blocks(table, *view, alone=len(records) == 1 and not listed):
                made = _made(block, mapping, listed, section)
                if made is None:
                    questions.append(_speed_question())
                elif not made.entry.skip:
                    found.setdefault(block.name, []).append(made)
    names = [*dict.fromkeys([*found, *mapping.runs])] if questions else [*found]
    return [_together(parts) for parts in found.values()], questions[:1], [*names, *listed]


def _views(table: LoggedTable, used: tuple[Used, ...]) -> list[tuple[tuple[Used, ...], str | None]]:
    """The columns of each run of a table whose columns belong to different runs, or have travels of their own."""
    own = [u for u in used if u.entry.run or u.entry.against]
    if not own:
        return [(used, None)]
    travels = {u.entry.against for u in own if u.entry.against}
    base = tuple(u for u in used if u not in own and u.column.name not in travels)
    found = []
    for u in own:
        along = table.column(u.entry.against) if u.entry.against else None
        if u.entry.against and along is None:
            raise InputError(f"columns.{u.column.name}.against", u.entry.against, "", "names no column of its file")
        shared = tuple(b for b in base if along is None or b.role not in ("time", "travel"))
        if along is not None:
            twin = next(v for v in used if v.column is along)
            shared = (*shared, twin)
        found.append(((*(b for b in shared if b.role != "signal"), u), u.entry.run))
    rest = tuple(b for b in base if b.role == "signal")
    return [*found, (base, None)] if rest else found


def _blocks(table: LoggedTable, used: tuple[Used, ...], run: str | None, *, alone: bool) -> list[Block]:
    if run is None:
        return blocks_of(table, used)
    rows = np.arange(len(table.lines))
    return [Block(table=table, used=used, rows=rows, name=run_name(run), text=run)]


def _made(
    block: Block, mapping: MappingEntry, listed: dict[str, dict[str, float]], section: float | None
) -> Made | None:
    entry = mapping.runs.get(block.name, RunEntry())
    settings = from_entry(entry, f"runs.{block.name}", section, Settings())
    for key, value in listed.get(block.name, {}).items():
        settings = settings.with_(key, value, _written(key, value), "the table of runs")
    given = from_entry(mapping.all_runs, "all_runs", section, settings)
    named = from_name(block.text, section, given)
    way = way_of(block, named.numbers.get("speed"))
    if way is None:
        return None
    if len(way.keep) < FEWEST:
        raise block.refuse(0, "rows", len(way.keep), "", f"run {block.name} has too few rows with time or travel")
    given = from_columns(block, way.keep, way.travel, section, given)
    given = from_name(block.text, section, given)
    given = _of_way(given, way)
    notes = (*way.notes, f"yaw_at is {given.told['yaw_at']}") if "yaw_at" in given.told else way.notes
    signals = {u.name: u.si(block.rows[way.keep]) for u in block.used if u.role == "signal"}
    signals = {n: y for n, y in signals.items() if np.isfinite(y).any()}
    track = Track(name=block.name, travel=way.travel, time=way.time, signals=signals)
    file = block.table.file.name
    return Made(key=block.name, entry=entry, track=track, settings=given, file=file, notes=notes)


def _of_way(settings: Settings, way: Way) -> Settings:
    if way.direction < 0.0:
        settings = settings.with_("direction", -1.0, "-1", "the sign of travel or speed")
    if way.speed > 0.0:
        speed = float(f"{way.speed:.4g}")
        settings = settings.with_("speed", speed, f"{speed:g} m/s", "travel over time")
    at = settings.numbers.get("yaw_at_time")
    if at is not None and way.time is not None:
        where = float(np.interp(at, way.time, way.travel))
        settings = settings.with_("yaw_at", where, f"{where:.6g} m", "the time of the yaw")
    return settings


def _written(key: str, value: float) -> str:
    unit, scale = {
        "tension": ("N/mm2", 1e6),
        "yaw": ("deg", np.pi / 180.0),
        "yaw_head": ("deg", np.pi / 180.0),
        "speed": ("m/s", 1.0),
        "yaw_at": ("m", 1.0),
        "yaw_at_u": ("m", 1.0),
    }.get(key, ("", 1.0))
    return f"{value / scale:.6g} {unit}".strip()


def _together(parts: list[Made]) -> Made:
    """One run from several files: its records on all their travels; settings of the first that has them."""
    if len(parts) == 1:
        return parts[0]
    settings = parts[0].settings
    for other in parts[1:]:
        for key, value in other.settings.numbers.items():
            settings = settings.with_(key, value, other.settings.written[key], other.settings.told[key])
    notes = tuple(dict.fromkeys(n for p in parts for n in p.notes))
    files = ", ".join(dict.fromkeys(p.file for p in parts))
    return replace(parts[0], track=merged([p.track for p in parts]), settings=settings, notes=notes, file=files)


def _speed_question() -> Question:
    return Question(
        path=("all_runs", "speed"),
        text="the files have time but neither travel nor speed; how fast did the belt run?",
        example="0.5 m/s",
    )


__all__ = ["KINDS", "Made", "made_of"]
