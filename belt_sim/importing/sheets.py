"""Machine, belt, signals and settings of the campaign: stated by the mapping, read off the runs, or assumed."""

from typing import NamedTuple

from belt_sim.campaign import Run, SignalSheet, plausible
from belt_sim.campaign.plausible import SIGNAL_DIMENSION
from belt_sim.campaign.types import BeltSheet, Machine, Quantity, SettingsSheet, kind_at
from belt_sim.config import belt_from, rig_from
from belt_sim.errors import InputError
from belt_sim.files import group_names
from belt_sim.importing.columns import USUAL, Column
from belt_sim.importing.mapping import BeltMapping, MachineMapping, MappingEntry, Question
from belt_sim.importing.noise import NoiseRead, noise_of
from belt_sim.importing.units import UNITS, quantity, size_of
from belt_sim.si import round_digits


class Datum(NamedTuple):
    """A number of the machine or the belt. unit: where none is written; relative_u: assumed where none is stated;
    question: "" where the number need not be given; proposed: a likely answer."""

    unit: str
    bounds: plausible.Range
    relative_u: float
    question: str = ""
    example: str = ""
    proposed: str = ""


_AXES = "how far apart are the axes of the two pulleys?"
_PULLEYS = "what is the radius of the pulleys, to the belt's middle surface?"
_MODULUS = "which Young's modulus has the belt (steel: 210 GPa)?"
_DENSITY = "which density has the belt (steel: 7850 kg/m^3)?"
MACHINE = {
    "centre_distance": Datum("m", plausible.CENTRE_DISTANCE, 5e-4, _AXES, "11.28 +- 0.005 m"),
    "pulley_radius": Datum("m", plausible.RADIUS, 3e-3, _PULLEYS, "0.170 m"),
    "head_radius": Datum("m", plausible.RADIUS, 3e-3),
    "tail_radius": Datum("m", plausible.RADIUS, 3e-3),
}
BELT = {
    "width": Datum("mm", plausible.WIDTH, 5e-4, "how wide is the belt?", "200 mm"),
    "thickness": Datum("mm", plausible.THICKNESS, 1e-2, "how thick is the belt?", "0.3 +- 0.003 mm"),
    "youngs_modulus": Datum("GPa", plausible.YOUNGS_MODULUS, 2e-2, _MODULUS, "210 +- 4 GPa", "210 +- 4 GPa"),
    "density": Datum("kg/m^3", plausible.DENSITY, 0.0, _DENSITY, "7850 kg/m^3", "7850 kg/m^3"),
    "poisson_ratio": Datum("1", plausible.POISSON_RATIO, 0.0),
}


def machine_of(mapping: MappingEntry) -> tuple[Machine | None, dict[str, str], list[Question]]:
    """The machine, remarks on its numbers, and what is missing."""
    found, remarks, missing = _quantities(mapping.machine, "rig", MACHINE, "machine")
    own = [k for k in ("head_radius", "tail_radius") if k in found]
    if len(own) == 1 or (own and "pulley_radius" in found):
        remedy = "state either pulley_radius, or both head_radius and tail_radius"
        raise InputError("machine", ", ".join(own), "", remedy)
    missing = [q for q in missing if not (own and q.path[-1] == "pulley_radius")]
    if missing:
        return None, remarks, missing
    radii = {k: found[k if own else "pulley_radius"] for k in ("head_radius", "tail_radius")}
    machine = Machine(centre_distance=found["centre_distance"], **radii)
    if machine.head_radius.value + machine.tail_radius.value >= machine.centre_distance.value:
        value = machine.centre_distance.value
        raise InputError("machine.centre_distance", value, "m", "the pulleys overlap; check the radii")
    return machine, remarks, []


def belt_of(mapping: MappingEntry) -> tuple[BeltSheet | None, dict[str, str], list[Question]]:
    """The belt, remarks on its numbers, and what is missing."""
    found, remarks, missing = _quantities(mapping.belt, "belt", BELT, "belt")
    if missing:
        return None, remarks, missing
    if found["thickness"].value >= found["width"].value:
        raise InputError("belt.thickness", f"{found['thickness'].value * 1e3:g}", "mm", "must be below the width")
    return BeltSheet(**found), remarks, []


def _number_texts(entry: MachineMapping | BeltMapping | str | None, kind: str, key: str) -> dict[str, str]:
    """Numbers with units as text, of a name or a mapping."""
    if entry is None:
        return {}
    if not isinstance(entry, str):
        return {k: v for k, v in entry.model_dump().items() if v is not None}
    names = group_names(kind)
    if entry not in names:
        raise InputError(key, entry, "", f"is no {kind} that is known ({', '.join(names)}); give its numbers")
    numbers = dict(vars(rig_from(entry) if kind == "rig" else belt_from(entry)))
    if kind == "rig" and numbers["head_radius"] == numbers["tail_radius"]:
        numbers["pulley_radius"] = numbers.pop("head_radius")
        del numbers["tail_radius"]
    units = {"youngs_modulus": " Pa", "density": " kg/m^3", "poisson_ratio": ""}
    return {k: f"{v:.15g}{units.get(k, ' m')}" for k, v in numbers.items() if k != "gravity"}


def _quantities(
    entry: MachineMapping | BeltMapping | str | None, kind: str, wanted: dict[str, Datum], key: str
) -> tuple[dict[str, Quantity], dict[str, str], list[Question]]:
    """Numbers that are written, remarks on them, and questions on those that are missing."""
    written, found, remarks, missing = _number_texts(entry, kind, key), {}, {}, []
    for name, datum in wanted.items():
        if name in written:
            value, u, unit = quantity(written[name], (datum.bounds.dimension,), datum.unit, f"{key}.{name}")
            si = datum.bounds.check(value, unit, name=f"{key}.{name}")
            if u is None and datum.relative_u:
                remarks[f"{key}.{name}"] = "u is assumed, none was stated"
            spread = datum.relative_u * si if u is None else u * UNITS[unit][1]
            found[name] = Quantity(value=round_digits(si, 12), u=round_digits(spread, 12))
        elif datum.question:
            path = (key, name)
            missing.append(Question(path=path, text=datum.question, example=datum.example, proposed=datum.proposed))
    return found, remarks, missing


#: Stated when the mapping says nothing: relative error of the tension, of the yaw [rad], of a sensor's scale.
TENSION_REL, YAW_U, GAIN = 0.01, 5e-6, 0.005


def signals_of(
    runs: list[Run], used: tuple[Column, ...], span: float
) -> tuple[tuple[SignalSheet, ...], dict[str, NoiseRead], dict[str, str]]:
    """Sheets of the signals, what was read off them, and remarks on each number."""
    columns: dict[str, Column] = {}
    for column in used:
        if column.role == "signal" and column.at and any(column.signal in r.signals for r in runs):
            columns.setdefault(column.signal, column)
    noise = {name: noise_of(name, runs, span) for name in columns}
    remarks: dict[str, str] = {}
    sheets = tuple(_sheet(column, noise[name], remarks) for name, column in columns.items())
    return sheets, noise, remarks


def _sheet(column: Column, read: NoiseRead, remarks: dict[str, str]) -> SignalSheet:
    """The sheet of a signal; where each of its numbers comes from is added to the remarks."""
    own, where, kind = column.entry, f"columns.{column.name}", kind_at(column.at)
    assert kind is not None
    unit, length = USUAL[SIGNAL_DIMENSION[kind]], read.length
    found = {
        "white": (read.white, f"from {read.white_from}"),
        "zero": (read.zero, f"from {read.zero_from}"),
        "gain": (GAIN, "assumed, no data tell it; state the sensor's accuracy"),
        "wander": (read.wander, f"from {read.wander_from}"),
    }
    if column.by_hand is not None:
        found |= {"white": (column.by_hand, "one sigma of reading the picture"), "wander": (0.0, "none, read by hand")}
        length = 1.0
    for key, text in (("white", own.white), ("zero", own.zero), ("gain", own.gain)):
        if text is not None:
            found[key] = size_of(text, "1" if key == "gain" else unit, f"{where}.{key}"), "stated"
    if own.wander is not None:
        found["wander"] = size_of(own.wander.sd, unit, f"{where}.wander.sd"), "stated"
        length = size_of(own.wander.length_m, "m", f"{where}.wander.length_m")
    remarks |= {f"signals.{column.signal}.{key}": source for key, (_, source) in found.items()}
    white, zero, wander = (round_digits(found[key][0], 3) for key in ("white", "zero", "wander"))
    errors = {"white": white, "zero": zero, "gain": found["gain"][0], "wander_sd": wander, "wander_length": length}
    return SignalSheet(name=column.signal, at=column.at, kind=kind, unit=unit, **errors)


def settings_of(entry: MappingEntry) -> tuple[SettingsSheet, dict[str, str]]:
    """How well runs hit their settings, and remarks on it."""
    asked, remarks = entry.settings, {}
    if asked.tension_rel is None:
        remarks["settings.tension_rel"] = "assumed, no data tell it; state how well the tension is known"
    if asked.yaw is None:
        remarks["settings.yaw"] = "assumed, no data tell it; state how well a run hits its yaw"
    yaw = YAW_U if asked.yaw is None else size_of(asked.yaw, "urad", "settings.yaw")
    relative = TENSION_REL if asked.tension_rel is None else size_of(asked.tension_rel, "1", "settings.tension_rel")
    return SettingsSheet(tension_rel=relative, yaw_u=yaw), remarks
