"""Sheets of the signals and settings: what the mapping states, what was read off the runs, what is assumed."""

from belt_sim.campaign import Run, SignalSheet
from belt_sim.campaign.types import PLACES, SettingsSheet
from belt_sim.errors import InputError
from belt_sim.intake.mapping import MappingEntry
from belt_sim.intake.noise import noise_of
from belt_sim.intake.proposal import NoiseRead
from belt_sim.intake.roles import WRITTEN, Used
from belt_sim.intake.units import UNITS, quantity

#: Stated when the mapping says nothing: relative error of the tension, of the yaw [rad], of a sensor's scale.
TENSION_REL, YAW_U, GAIN = 0.01, 5e-6, 0.005


def signals_of(
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
        read_off = "one sigma of reading the picture" if u.entry.axis else f"from {noise[name].white_from}"
        remarks[f"{key}.white"] = "stated" if u.entry.white else read_off
        remarks[f"{key}.zero"] = "stated" if u.entry.zero else f"from {noise[name].zero_from}"
        remarks[f"{key}.gain"] = "stated" if u.entry.gain else "assumed, no data tell it; state the sensor's accuracy"
        slow = "none, read by hand" if u.entry.axis else f"from {noise[name].wander_from}"
        remarks[f"{key}.wander"] = "stated" if u.entry.wander else slow
    return tuple(sheets), noise, remarks


def _sheet(name: str, u: Used, read: NoiseRead) -> SignalSheet:
    kind = PLACES[u.at]
    own, where = u.entry, f"columns.{u.column.name}"

    def si(text: str | None, key: str, otherwise: float) -> float:
        return otherwise if text is None else _size(text, WRITTEN[kind], f"{where}.{key}")

    white = read.white
    if own.axis is not None:
        (p0, p1), (v0, v1) = own.axis.pixel, own.axis.value
        white = abs((v1 - v0) / (p1 - p0)) * own.axis.u * u.factor  # a hand's error is no sensor's
    by_hand = own.axis is not None
    wander_sd, length = (0.0, 1.0) if own.wander is not None or by_hand else (read.wander, read.length)
    if own.wander is not None:
        wander_sd = _size(own.wander.sd, WRITTEN[kind], f"{where}.wander.sd")
        length = number_of(own.wander.length_m, f"{where}.wander.length_m")
    return SignalSheet(
        name=name,
        at=u.at,
        kind=kind,
        unit=WRITTEN[kind],
        white=_three(si(own.white, "white", white)),
        zero=_three(si(own.zero, "zero", read.zero)),
        gain=GAIN if own.gain is None else number_of(own.gain, f"{where}.gain", "number"),
        wander_sd=_three(wander_sd),
        wander_length=length,
    )


def _size(text: str, unit: str, where: str) -> float:
    value, _, own = quantity(text, (UNITS[unit][0],), unit, where)
    if value < 0.0:
        raise InputError(where, text, "", "one sigma; must not be negative")
    return value * UNITS[own][1]


def number_of(text: str, where: str, kind: str = "length") -> float:
    """A number in SI that is not negative."""
    value, _, unit = quantity(text, (kind,), "m" if kind == "length" else "1", where)
    if value < 0.0:
        raise InputError(where, text, "", "must not be negative")
    return value * UNITS[unit][1]


def _three(x: float) -> float:
    return float(f"{x:.3g}")


def settings_of(entry: MappingEntry) -> tuple[SettingsSheet, dict[str, str]]:
    """How well runs hit their settings, and remarks on it."""
    asked, remarks = entry.settings, {}
    if asked.tension_rel is None:
        remarks["settings.tension_rel"] = "assumed, no data tell it; state how well the tension is known"
    if asked.yaw is None:
        remarks["settings.yaw"] = "assumed, no data tell it; state how well a run hits its yaw"
    yaw = YAW_U if asked.yaw is None else _size(asked.yaw, "urad", "settings.yaw")
    relative = (
        TENSION_REL if asked.tension_rel is None else number_of(asked.tension_rel, "settings.tension_rel", "number")
    )
    return SettingsSheet(tension_rel=relative, yaw_u=yaw), remarks
