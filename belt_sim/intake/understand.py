"""Tables and a mapping -> what the campaign would be, and what is still to be answered."""

from dataclasses import replace
from typing import Any

import numpy as np

from belt_sim.campaign import Campaign, Run, SignalSheet
from belt_sim.campaign.nouns import PLACES, Machine, SettingsSheet, Source
from belt_sim.campaign.runs import REPEAT_TOLERANCE
from belt_sim.errors import InputError
from belt_sim.intake.known import mapping_used
from belt_sim.intake.machine import belt_of, machine_of
from belt_sim.intake.mapping import MappingEntry, mapping_of
from belt_sim.intake.noise import noise_of
from belt_sim.intake.nouns import Logged
from belt_sim.intake.proposal import ColumnUse, NoiseRead, Proposal, Question
from belt_sim.intake.rates import rates_of
from belt_sim.intake.resample import cut_alike, from_yaw, resampled, step_for
from belt_sim.intake.roles import WRITTEN, Used, used_columns
from belt_sim.intake.stated import KINDS, questions, unknown_runs
from belt_sim.intake.tracks import Made, made_of
from belt_sim.intake.units import UNITS, quantity

#: Stated when the mapping says nothing: relative error of the tension, of the yaw [rad], of a sensor's scale.
TENSION_REL, YAW_U, GAIN = 0.01, 5e-6, 0.005


def understand(logged: Logged, mapping: Any = None) -> Proposal:
    """What the files mean, given a mapping (plain data, a YAML file, or None).

    Raises CampaignError or InputError for what cannot be; what is merely not known becomes a question.
    """
    entry = mapping_of(mapping)
    used, missing = used_columns(logged, entry)
    machine, remarks, more = machine_of(entry)
    belt, of_belt, further = belt_of(entry)
    remarks |= of_belt
    missing += more + further
    section = belt.width.value * belt.thickness.value if belt else float("nan")
    tables = [(t, used[t.name]) for t in logged.tables]
    ready = not any(q.path[-1] == "role" for q in missing)
    made, asked, names = made_of(tables, entry, section) if ready else ([], [], list(entry.runs))
    rated = rates_of([(t, u) for t, u in tables if t.kind == "rates"], entry, section)
    missing += asked + rated.missing
    if ready and not asked:
        unknown_runs(entry, [*names, *rated.names])
    for run in made:
        missing += questions(run.key, run.settings.numbers, run.file)
    notes = [n for t in logged.tables for n in t.notes] + [f"{m.key}: {n}" for m in made for n in m.notes]
    if ready and not made and not rated.runs and not missing:
        raise InputError("files", "no run", "", "no run was found in them; is the right column the run or the travel?")
    runs, told, step = _runs(made, entry, used)
    notes += told
    signals, noise, of_signals = _signals(runs, entry, used, _span(machine))
    campaign = None
    if not missing and machine is not None and belt is not None:
        campaign = Campaign(
            title=entry.title or f"imported from {', '.join(t.file.name for t in logged.tables[:4])}",
            source=Source(**entry.source.model_dump()),
            machine=machine,
            belt=belt,
            signals=signals,
            settings=_settings(entry, remarks),
            runs=(*runs, *rated.runs),
            steady=rated.steady,
        )
    return Proposal(
        logged=logged,
        columns=_uses(used),
        missing=tuple(dict.fromkeys(missing)),
        campaign=campaign,
        mapping=mapping_used(entry, used, made, rated.written, step),
        noise=noise,
        comments=remarks | of_signals,
        notes=tuple(notes),
    )


def _span(machine: Machine | None) -> float:
    return machine.centre_distance.value if machine else 10.0


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


def _runs(
    made: list[Made], entry: MappingEntry, used: dict[str, tuple[Used, ...]]
) -> tuple[list[Run], list[str], float]:
    """Runs on one grid, their readings counted from the yaw, repeats recognised; remarks; the step [m]."""
    if not made:
        return [], [], 0.0
    notes: list[str] = []
    step = _number(entry.step_m, "step_m") if entry.step_m else step_for([m.track for m in made])
    tracks = [resampled(m.track, step) for m in made]
    if step > 0.0:
        rows = sum(len(m.track.travel) for m in made)
        notes.append(
            f"{rows} rows were averaged over steps of {step:g} m, {sum(len(t.travel) for t in tracks)} are left"
        )
    runs = [_run(m) for m in made]
    runs, repeats = _with_repeats(runs, [m.entry.repeat_of is not None for m in made])
    notes += [f"{r.name} repeats {r.repeat_of}: same settings" for r in repeats]
    at = {r.name: k for k, r in enumerate(runs)}
    groups = [[k, *(at[r.name] for r in runs if r.repeat_of == first.name)] for k, first in enumerate(runs)]
    tracks = cut_alike([g for g in groups if len(g) > 1], tracks)
    out = []
    for run, track in zip(runs, tracks, strict=True):
        if entry.start == "yaw":
            track, off = from_yaw(track, run.yaw_at)
            large = [f"{n} {x * 1e3:.4g}" for n, x in off.items() if abs(x) > 1e-6]
            if large:
                notes.append(f"{run.name}: readings count from the yaw; taken off: {', '.join(large)} (mm or mrad)")
        out.append(replace(run, travel=track.travel, time=track.time, signals=track.signals))
    return out, notes, step


def _run(made: Made) -> Run:
    numbers = made.settings.numbers
    values: dict[str, Any] = {
        k: numbers[k] for k in ("tension", "yaw", "yaw_head", "speed", "direction", "yaw_at") if k in numbers
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


def _with_repeats(runs: list[Run], stated: list[bool]) -> tuple[list[Run], list[Run]]:
    """Runs at one setting as repeats of the first, with its settings; those that were recognised."""
    out: list[Run] = []
    found: list[Run] = []
    for run, told in zip(runs, stated, strict=True):
        twin = next((f for f in out if not told and f.repeat_of is None and _same(f, run)), None)
        if twin is not None:
            run = replace(run, repeat_of=twin.name, tension=twin.tension, yaw=twin.yaw, yaw_head=twin.yaw_head)
            run = replace(run, speed=twin.speed, yaw_at=twin.yaw_at)
            found.append(run)
        out.append(run)
    return out, found


def _same(a: Run, b: Run) -> bool:
    near = all(
        abs(getattr(a, k) - getattr(b, k)) <= 0.5 * REPEAT_TOLERANCE * abs(getattr(a, k))
        for k in ("tension", "yaw", "yaw_head", "speed")
    )
    return near and a.direction == b.direction and abs(a.yaw_at - b.yaw_at) <= 0.05 * max(a.yaw_at, 0.0)


def _signals(
    runs: list[Run], entry: MappingEntry, used: dict[str, tuple[Used, ...]], span: float
) -> tuple[tuple[SignalSheet, ...], dict[str, NoiseRead], dict[str, str]]:
    """Sheets of the signals, what was read off them, and remarks on each number."""
    found: dict[str, Used] = {}
    for columns in used.values():
        for u in columns:
            if u.role == "signal" and u.at:
                found.setdefault(u.name, u)
    sheets, noise, remarks = [], {}, {}
    for name, u in found.items():
        if not any(name in r.signals for r in runs):
            continue
        noise[name] = noise_of(name, runs, span)
        sheets.append(_sheet(name, u, noise[name]))
        key = f"signals.{name}"
        remarks[f"{key}.white"] = "stated" if u.entry.white else f"from {noise[name].white_from}"
        remarks[f"{key}.zero"] = "stated" if u.entry.zero else f"from {noise[name].zero_from}"
        remarks[f"{key}.gain"] = "stated" if u.entry.gain else "assumed, no data tell it; state the sensor's accuracy"
        remarks[f"{key}.wander"] = "stated" if u.entry.wander else f"from {noise[name].wander_from}"
    return tuple(sheets), noise, remarks


def _sheet(name: str, u: Used, read: NoiseRead) -> SignalSheet:
    kind = PLACES[u.at]
    own, where = u.entry, f"columns.{u.column.name}"

    def si(text: str | None, key: str, otherwise: float) -> float:
        return otherwise if text is None else _size(text, WRITTEN[kind], f"{where}.{key}")

    white = read.white
    if own.axis is not None:
        (p0, p1), (v0, v1) = own.axis.pixel, own.axis.value
        white = max(white, abs((v1 - v0) / (p1 - p0)) * own.axis.u * u.factor)
    wander_sd, length = (read.wander, read.length) if own.wander is None else (0.0, 1.0)
    if own.wander is not None:
        wander_sd = _size(own.wander.sd, WRITTEN[kind], f"{where}.wander.sd")
        length = _number(own.wander.length_m, f"{where}.wander.length_m")
    return SignalSheet(
        name=name,
        at=u.at,
        kind=kind,
        unit=WRITTEN[kind],
        white=_three(si(own.white, "white", white)),
        zero=_three(si(own.zero, "zero", read.zero)),
        gain=GAIN if own.gain is None else _number(own.gain, f"{where}.gain", "number"),
        wander_sd=_three(wander_sd),
        wander_length=length,
    )


def _size(text: str, unit: str, where: str) -> float:
    value, _, own = quantity(text, (UNITS[unit][0],), unit, where)
    if value < 0.0:
        raise InputError(where, text, "", "one sigma; must not be negative")
    return value * UNITS[own][1]


def _number(text: str, where: str, kind: str = "length") -> float:
    value, _, unit = quantity(text, (kind,), "m" if kind == "length" else "1", where)
    if value < 0.0:
        raise InputError(where, text, "", "must not be negative")
    return value * UNITS[unit][1]


def _three(x: float) -> float:
    return float(f"{x:.3g}")


def _settings(entry: MappingEntry, remarks: dict[str, str]) -> SettingsSheet:
    asked = entry.settings
    if asked.tension_rel is None:
        remarks["settings.tension_rel"] = "assumed, no data tell it; state how well the tension is known"
    if asked.yaw is None:
        remarks["settings.yaw"] = "assumed, no data tell it; state how well a run hits its yaw"
    yaw = YAW_U if asked.yaw is None else _size(asked.yaw, "urad", "settings.yaw")
    relative = (
        TENSION_REL if asked.tension_rel is None else _number(asked.tension_rel, "settings.tension_rel", "number")
    )
    return SettingsSheet(tension_rel=relative, yaw_u=yaw)


__all__ = ["Question", "understand"]
