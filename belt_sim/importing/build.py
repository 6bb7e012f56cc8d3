"""Tables and a mapping -> the campaign, the mapping as it was used, and the questions that are still open."""

from dataclasses import replace
from typing import Any

import numpy as np

from belt_sim.campaign import Campaign, Run
from belt_sim.campaign.types import Source
from belt_sim.errors import InputError
from belt_sim.importing.mapping import SCHEMA, MappingEntry, mapping_of
from belt_sim.importing.roles import Used, used_columns
from belt_sim.importing.runs import (
    KINDS,
    Made,
    Rated,
    made_of,
    questions,
    rates_of,
    snapped,
    unknown_runs,
    with_repeats,
)
from belt_sim.importing.sheets import belt_of, machine_of, number_of, settings_of, signals_of
from belt_sim.importing.travel import Track, counted_from_yaw, cut_alike, resampled, step_for
from belt_sim.importing.types import ColumnUse, Logged, Proposal, Question
from belt_sim.importing.units import UNITS

#: settings of a run that go into the mapping; what comes from columns is read again
_FROM_FILES = ("its column", "the mean of its column", "travel over time", "the sign of travel or speed", "the step of")


def mapping_used(
    entry: MappingEntry, used: dict[str, tuple[Used, ...]], made: list[Made], step: float
) -> dict[str, Any]:
    """Plain data that ``understand`` accepts."""
    stated = {k: v for k, v in _plain(entry.model_dump(by_alias=True, exclude_unset=True)).items() if k != "schema"}
    columns: dict[str, Any] = {}
    for own in used.values():
        for u in own:
            columns.setdefault(u.column.name, _column(u))
    runs: dict[str, Any] = {}
    for run in made:
        told = {k: v for k, v in run.settings.written.items() if not run.settings.told[k].startswith(_FROM_FILES)}
        told = {k: v for k, v in told.items() if getattr(entry.all_runs, k, None) is None}
        runs[run.key] = told | _plain(run.entry.model_dump(exclude_unset=True))
    out: dict[str, Any] = {"schema": SCHEMA} | stated
    out |= {"columns": columns}
    if runs:
        out["runs"] = runs | {k: v for k, v in stated.get("runs", {}).items() if k not in runs}
    if step > 0.0:
        out["step_m"] = f"{step:g}"
    return out | {"runs": {k: v for k, v in out["runs"].items() if v}} if "runs" in out else out


def in_order(mapping: dict[str, Any]) -> dict[str, Any]:
    """The mapping with its keys in the order in which they are read best."""
    names = [name.rstrip("_") for name in MappingEntry.model_fields]
    return {k: mapping[k] for k in sorted(mapping, key=lambda k: names.index(k) if k in names else len(names))}


def _column(u: Used) -> dict[str, Any]:
    found: dict[str, Any] = {"role": u.role}
    if u.unit and u.role != "ignore":
        found["unit"] = u.unit
    if u.at:
        found |= {"at": u.at, "name": u.name}
    return found | _plain(u.entry.model_dump(exclude_unset=True))


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items() if v is not None}
    return [_plain(v) for v in value] if isinstance(value, list | tuple) else value


def understand(logged: Logged, mapping: Any = None) -> Proposal:
    """What the files mean, given a mapping (plain data, a YAML file, or None).

    Raises CampaignError or InputError for what cannot be; what is merely not known becomes a question.
    """
    entry = mapping_of(mapping)
    used, missing = used_columns(logged, entry)
    machine, remarks, more = machine_of(entry)
    belt, of_belt, further = belt_of(entry)
    missing += more + further
    section = belt.width.value * belt.thickness.value if belt else float("nan")
    made, rated, asked = _found(logged, used, entry, section, [q.path[-1] for q in missing])
    missing += asked
    notes = [n for t in logged.tables for n in t.notes] + [f"{m.key}: {n}" for m in made for n in m.notes]
    runs, told, step = _runs(made, entry)
    signals, noise, of_signals = signals_of(runs, entry, used, machine.centre_distance.value if machine else 10.0)
    settings, of_settings = settings_of(entry)
    campaign = None
    if not missing and machine is not None and belt is not None:
        campaign = Campaign(
            title=entry.title or f"imported from {', '.join(t.file.name for t in logged.tables[:4])}",
            source=Source(**entry.source.model_dump()),
            machine=machine,
            belt=belt,
            signals=signals,
            settings=settings,
            runs=(*runs, *rated.runs),
            steady=rated.steady,
        )
    return Proposal(
        logged=logged,
        columns=_uses(used),
        missing=tuple(dict.fromkeys(missing)),
        campaign=campaign,
        mapping=mapping_used(entry, used, made, step),
        noise=noise,
        comments=remarks | of_belt | of_signals | of_settings,
        notes=tuple(notes + told),
    )


def _found(
    logged: Logged, used: dict[str, tuple[Used, ...]], entry: MappingEntry, section: float, unknown: list[str]
) -> tuple[list[Made], Rated, list[Question]]:
    """Runs of records, runs of rates, and what is missing of them; unknown: kinds of questions that are open."""
    tables = [(t, used[t.name]) for t in logged.tables]
    rated = rates_of([(t, u) for t, u in tables if t.kind == "rates"], entry, section)
    if "role" in unknown:
        return [], rated, rated.missing
    made, asked, names = made_of(tables, entry, section)
    if not asked:
        unknown_runs(entry, [*names, *rated.names])
    missing = rated.missing + asked
    for run in made:
        missing += questions(run.key, run.settings.numbers, run.file)
    if not made and not rated.runs and not missing and not unknown:
        raise InputError("files", "no run", "", "no run was found in them; is the right column the run or the travel?")
    return made, rated, missing


def _uses(used: dict[str, tuple[Used, ...]]) -> tuple[ColumnUse, ...]:
    return tuple(
        ColumnUse(
            table=table,
            column=u.column.name,
            role=u.role,
            unit=u.unit,
            at=u.at,
            signal=u.name,
            sure=u.column.sure or bool(u.entry.role or u.entry.unit or u.entry.at),
            why="the mapping" if u.entry.role or u.entry.unit or u.entry.at else u.column.why,
        )
        for table, columns in used.items()
        for u in columns
    )


def _runs(made: list[Made], entry: MappingEntry) -> tuple[list[Run], list[str], float]:
    """Runs on one grid, their readings counted from the yaw, repeats recognised; remarks; the step [m]."""
    if not made:
        return [], [], 0.0
    notes: list[str] = []
    step = number_of(entry.step_m, "step_m") if entry.step_m else step_for([m.track for m in made])
    tracks = [resampled(m.track, step) for m in made]
    if step > 0.0:
        rows = sum(len(m.track.travel) for m in made)
        notes.append(
            f"{rows} rows were averaged over steps of {step:g} m, {sum(len(t.travel) for t in tracks)} are left"
        )
    runs = snapped([_run(m) for m in made], [m.settings.told for m in made])
    runs, repeats = with_repeats(runs, [m.entry.repeat_of is not None for m in made])
    notes += [f"{r.name}: repeats {r.repeat_of}, same settings" for r in repeats] + _blank(tracks)
    at = {r.name: k for k, r in enumerate(runs)}
    groups = [[k, *(at[r.name] for r in runs if r.repeat_of == first.name)] for k, first in enumerate(runs)]
    tracks = cut_alike([g for g in groups if len(g) > 1], tracks)
    if entry.start == "yaw":
        tracks, told = counted_from_yaw(tracks, [r.yaw_at for r in runs])
        notes += told
    out = [
        replace(run, travel=track.travel, time=track.time, signals=track.signals)
        for run, track in zip(runs, tracks, strict=True)
    ]
    return out, notes, step


def _blank(tracks: list[Track]) -> list[str]:
    """Runs without a signal that others have: a column of that name may be missing in their file."""
    names = dict.fromkeys(n for t in tracks for n in t.signals)
    lacking = {t.name: [n for n in names if n not in t.signals] for t in tracks}
    return [
        f"{run}: has no {' and no '.join(blank)}, which other runs have; is its column called otherwise there?"
        for run, blank in lacking.items()
        if blank
    ]


def _run(made: Made) -> Run:
    numbers = made.settings.numbers
    values: dict[str, Any] = {
        k: numbers[k]
        for k in ("tension", "yaw", "yaw_head", "speed", "direction", "yaw_at", "yaw_at_u")
        if k in numbers
    }
    for key, value in values.items():
        bounds = KINDS[key][2]
        if np.isfinite(value) and not bounds.holds(value):
            shown = value / UNITS[bounds.unit or "1"][1]
            remedy = f"must be {bounds.low:g} to {bounds.high:g} {bounds.unit}; it came from {made.settings.told[key]}"
            raise InputError(f"runs.{made.key}.{key}", f"{shown:.6g}", bounds.unit, remedy)
    values.setdefault("tension", np.nan)
    values.setdefault("yaw", np.nan)
    entry = made.entry
    return Run(name=entry.name or made.key, repeat_of=entry.repeat_of, use=entry.use or "fit", **values)
