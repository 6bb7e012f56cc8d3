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
    question: "" where the number need not be given; is_of_steel: whether the example is a likely answer."""

    unit: str
    bounds: plausible.Range
    relative_u: float
    question: str = ""
    example: str = ""
    is_of_steel: bool = False


_RADIUS = Datum("m", plausible.RADIUS, 3e-3)
MACHINE = {
    "centre_distance": Datum(
        "m", plausible.CENTRE_DISTANCE, 5e-4, "how far apart are the axes of the two pulleys?", "11.28 +- 0.005 m"
    ),
    "pulley_radius": _RADIUS._replace(
        question="what is the radius of the pulleys, to the belt's middle surface?", example="0.170 m"
    ),
    "head_radius": _RADIUS,
    "tail_radius": _RADIUS,
}
BELT = {
    "width": Datum("mm", plausible.WIDTH, 5e-4, "how wide is the belt?", "200 mm"),
    "thickness": Datum("mm", plausible.THICKNESS, 1e-2, "how thick is the belt?", "0.3 +- 0.003 mm"),
    "youngs_modulus": Datum(
        "GPa",
        plausible.YOUNGS_MODULUS,
        2e-2,
        "which Young's modulus has the belt (steel: 210 GPa)?",
        "210 +- 4 GPa",
        is_of_steel=True,
    ),
    "density": Datum(
        "kg/m^3",
        plausible.DENSITY,
        0.0,
        "which density has the belt (steel: 7850 kg/m^3)?",
        "7850 kg/m^3",
        is_of_steel=True,
    ),
    "poisson_ratio": Datum("1", plausible.POISSON_RATIO, 0.0),
}


def machine_of(mapping: MappingEntry) -> tuple[Machine | None, dict[str, str], list[Question]]:
    """The machine, remarks on its numbers, and what is missing."""
    written = _number_texts(mapping.machine, "rig", "machine")
    found, remarks, missing = _quantities(written, MACHINE, "machine")
    own = [k for k in ("head_radius", "tail_radius") if k in found]
    if len(own) == 1 or (own and "pulley_radius" in found):
        remedy = "state either pulley_radius, or both head_radius and tail_radius"
        raise InputError("machine", ", ".join(own), "", remedy)
    missing = [q for q in missing if not (own and q.path[-1] == "pulley_radius")]
    if missing:
        return None, remarks, missing
    head, tail = (found[k] for k in own or ("pulley_radius", "pulley_radius"))
    machine = Machine(centre_distance=found["centre_distance"], head_radius=head, tail_radius=tail)
    if machine.head_radius.value + machine.tail_radius.value >= machine.centre_distance.value:
        value = machine.centre_distance.value
        raise InputError("machine.centre_distance", value, "m", "the pulleys overlap; check the radii")
    return machine, remarks, []


def belt_of(mapping: MappingEntry) -> tuple[BeltSheet | None, dict[str, str], list[Question]]:
    """The belt, remarks on its numbers, and what is missing."""
    found, remarks, missing = _quantities(_number_texts(mapping.belt, "belt", "belt"), BELT, "belt")
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
    written: dict[str, str], wanted: dict[str, Datum], key: str
) -> tuple[dict[str, Quantity], dict[str, str], list[Question]]:
    """Numbers that are written, remarks on them, and questions on those that are missing."""
    found, remarks, missing = {}, {}, []
    for name, datum in wanted.items():
        if name in written:
            value, u, unit = quantity(written[name], (datum.bounds.dimension,), datum.unit, f"{key}.{name}")
            si = datum.bounds.check(value, unit, name=f"{key}.{name}")
            if u is None and datum.relative_u:
                remarks[f"{key}.{name}"] = "u is assumed, none was stated"
            spread = datum.relative_u * si if u is None else u * UNITS[unit][1]
            found[name] = Quantity(value=round_digits(si, 12), u=round_digits(spread, 12))
        elif datum.question:
            likely = datum.example if datum.is_of_steel else ""
            missing.append(Question(path=(key, name), text=datum.question, example=datum.example, proposed=likely))
    return found, remarks, missing


#: Stated when the mapping says nothing: relative error of the tension, of the yaw [rad], of a sensor's scale.
TENSION_REL, YAW_U, GAIN = 0.01, 5e-6, 0.005


def signals_of(
    runs: list[Run], used: tuple[Column, ...], span: float
) -> tuple[tuple[SignalSheet, ...], dict[str, NoiseRead], dict[str, str]]:
    """Sheets of the signals, what was read off them, and remarks on each number."""
    sheets: list[SignalSheet] = []
    noise: dict[str, NoiseRead] = {}
    remarks: dict[str, str] = {}
    for u in (u for u in used if u.role == "signal" and u.at):
        if u.signal in noise or not any(u.signal in r.signals for r in runs):
            continue
        noise[u.signal] = noise_of(u.signal, runs, span)
        sheet, sources = _sheet(u, noise[u.signal])
        sheets.append(sheet)
        remarks |= {f"signals.{u.signal}.{key}": source for key, source in sources.items()}
    return tuple(sheets), noise, remarks


def _sheet(u: Column, read: NoiseRead) -> tuple[SignalSheet, dict[str, str]]:
    """The sheet of a signal, and where each of its numbers comes from."""
    own, where, kind = u.entry, f"columns.{u.name}", kind_at(u.at)
    assert kind is not None
    unit, length = USUAL[SIGNAL_DIMENSION[kind]], read.length
    found = {
        "white": (read.white, f"from {read.white_from}"),
        "zero": (read.zero, f"from {read.zero_from}"),
        "gain": (GAIN, "assumed, no data tell it; state the sensor's accuracy"),
        "wander": (read.wander, f"from {read.wander_from}"),
    }
    if u.by_hand is not None:
        found |= {"white": (u.by_hand, "one sigma of reading the picture"), "wander": (0.0, "none, read by hand")}
        length = 1.0
    for key, text in (("white", own.white), ("zero", own.zero), ("gain", own.gain)):
        if text is not None:
            found[key] = size_of(text, "1" if key == "gain" else unit, f"{where}.{key}"), "stated"
    if own.wander is not None:
        found["wander"] = size_of(own.wander.sd, unit, f"{where}.wander.sd"), "stated"
        length = size_of(own.wander.length_m, "m", f"{where}.wander.length_m")
    white, zero, gain, wander = (value for value, _ in found.values())
    sheet = SignalSheet(
        name=u.signal,
        at=u.at,
        kind=kind,
        unit=unit,
        white=round_digits(white, 3),
        zero=round_digits(zero, 3),
        gain=gain,
        wander_sd=round_digits(wander, 3),
        wander_length=length,
    )
    return sheet, {key: source for key, (_, source) in found.items()}


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
