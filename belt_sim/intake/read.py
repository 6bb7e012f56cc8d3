"""Logger files -> tables with proposals for what their columns are."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from belt_sim.errors import InputError
from belt_sim.intake.encoding import encoding_of, head_of, is_workbook
from belt_sim.intake.layout import Layout
from belt_sim.intake.nouns import Column, Logged, LoggedTable
from belt_sim.intake.propose import proposed
from belt_sim.intake.scan import scan
from belt_sim.intake.text_table import read_text
from belt_sim.intake.units import split_unit, unit_named
from belt_sim.intake.words import role_named
from belt_sim.intake.workbook import sheets


def read(files: Sequence[str | Path], form: Mapping[str, str] | None = None) -> Logged:
    """Read logger files (CSV, TSV, other separated text, xlsx), with a role, a unit and a place proposed per column.

    form: what is known of the format of text files: separator, decimal, encoding. Raises CampaignError, InputError.
    """
    paths = [Path(f) for f in files]
    if not paths:
        raise InputError(
            "files", "[]", "", "name the files of your logger after the command, as belt-sim import a.csv b.csv"
        )
    twice = next((p for k, p in enumerate(paths) if p in paths[:k]), None)
    if twice is not None:
        raise InputError("files", twice, "", "is named twice; name each file once")
    tables: list[LoggedTable] = []
    for path in paths:
        head = head_of(path)
        tables += _workbook(path) if is_workbook(head) else [_text(path, head, form or {})]
    return Logged(tables=tuple(proposed(t) for t in _named_apart(tables)))


def _text(path: Path, head: bytes, form: Mapping[str, str]) -> LoggedTable:
    encoding = form.get("encoding") or encoding_of(path, head)
    seen = scan(path, encoding, dict(form))
    roles = [role_named(split_unit(n)[0]) for n in seen.layout.names]
    key = next((roles.index(role) for role in ("travel", "time") if role in roles), None)
    columns, lines, every, stamps = read_text(path, seen, key)
    notes = [f"{path.name}: {seen.encoding}, {seen.layout.words}, {seen.rows} rows"]
    notes += [f"{path.name}: {note}" for note in seen.notes]
    if every > 1:
        notes.append(f"{path.name}: every {every} rows were averaged while reading")
    starts = np.searchsorted(lines, seen.again)
    return LoggedTable(
        name=path.stem,
        file=path,
        columns=_columns(columns, seen.layout, stamps),
        lines=lines,
        starts=tuple(int(k) for k in starts if 0 < k < len(lines)),
        averaged=every,
        notes=tuple(notes),
    )


def _workbook(path: Path) -> list[LoggedTable]:
    found = []
    for sheet, layout, columns, lines, stamps in sheets(path):
        notes = (f"{path.name} [{sheet}]: {len(lines)} rows",)
        found.append(
            LoggedTable(name=sheet, file=path, columns=_columns(columns, layout, stamps), lines=lines, notes=notes)
        )
    if len(found) == 1:
        found = [replace(found[0], name=path.stem)]
    return found


def _columns(values: Mapping[str, np.ndarray], layout: Layout, stamps: set[str]) -> tuple[Column, ...]:
    stated = [unit_named(u) or "" if u else "" for u in layout.units]
    units = ["s" if n in stamps else u for n, u in zip(values, stated, strict=True)]
    return tuple(Column(name=n, values=v, unit=u) for (n, v), u in zip(values.items(), units, strict=True))


def _named_apart(tables: list[LoggedTable]) -> list[LoggedTable]:
    """Tables of one name get their file's, or a number, to tell them apart."""
    found: list[LoggedTable] = []
    for table in tables:
        name, n = table.name, 2
        while any(t.name == name for t in found):
            name, n = f"{table.name}_{n}", n + 1
        found.append(replace(table, name=name))
    return found
