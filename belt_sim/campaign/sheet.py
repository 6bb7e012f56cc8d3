"""campaign.yaml -> the nouns, with every violation as a problem at its line."""

from collections.abc import Iterable
from dataclasses import dataclass

from pydantic import BaseModel, ValidationError

from belt_sim.campaign import schema
from belt_sim.campaign.marked_yaml import MarkedYaml, Path, parse
from belt_sim.campaign.nouns import (
    PLACES,
    BeltSheet,
    Campaign,
    Machine,
    Quantity,
    Run,
    SettingsSheet,
    SignalSheet,
    Source,
    SteadyRate,
)
from belt_sim.campaign.plausible import SIGNAL_DIMENSION
from belt_sim.campaign.problems import Problem, did_you_mean
from belt_sim.errors import InputError
from belt_sim.si import to_si

FILE = "campaign.yaml"

#: How a required key is written.
EXAMPLES = {
    "schema": "schema: belt-campaign/1",
    "title": "title: slack belt, 12 May",
    "source": '{kind: measured, reference: "log book 7", licence: "CC-BY-4.0"}',
    "kind": "kind: measured",
    "machine": "centre_distance and pulley_radius",
    "centre_distance": "{value: 11.28, u: 0.005, unit: m}",
    "belt": "width, thickness, youngs_modulus and density",
    "width": "{value: 200, u: 0.1, unit: mm}",
    "thickness": "{value: 0.3, u: 0.003, unit: mm}",
    "youngs_modulus": "{value: 210, u: 4, unit: GPa}",
    "density": "{value: 7850, unit: kg/m^3}",
    "unit": "unit: mm",
    "at": "at: point_1",
    "yaw.unit": "unit: urad",
    "white": "white: 0.02",
    "length_m": "{sd: 0.05, length_m: 3}",
    "sd": "{sd: 0.05, length_m: 3}",
}
#: pydantic's type of error -> what to do about it.
REMEDIES = {
    "float_parsing": "must be a number, with a decimal point",
    "float_type": "must be a number, with a decimal point",
    "finite_number": "must be a finite number",
    "string_type": "must be text",
    "model_type": "must be a mapping, like {value: 200, unit: mm}",
    "dict_type": "must be a mapping, like {y1: {unit: mm, at: point_1, white: 0.02}}",
}


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """What campaign.yaml states, in SI."""

    title: str
    source: Source
    machine: Machine
    belt: BeltSheet
    signals: tuple[SignalSheet, ...]
    settings: SettingsSheet

    def campaign(self, runs: Iterable[Run], sha256: str, steady: tuple[SteadyRate, ...] = ()) -> Campaign:
        """The campaign of these runs."""
        return Campaign(**vars(self), runs=tuple(runs), steady=steady, sha256=sha256)


def read_sheet(text: str, problems: list[Problem]) -> tuple[Sheet | None, frozenset[str] | None]:
    """The sheet and the names of its signals; None for what the problems leave unknown."""
    before = len(problems)
    marked = parse(text, FILE, problems)
    if marked is None:
        return None, None
    if not isinstance(marked.tree, dict):
        remedy = "must be a mapping that begins with schema: belt-campaign/1"
        problems.append(Problem(file=FILE, line=1, remedy=remedy))
        return None, None
    signals = marked.tree.get("signals")
    names = frozenset(signals) if isinstance(signals, dict) else frozenset()
    try:
        entry = schema.CampaignEntry.model_validate(marked.tree)
    except ValidationError as error:
        problems.extend(_problem(details, marked) for details in error.errors())
        return None, names
    return (_sheet(entry) if len(problems) == before else None), names


def _problem(details, marked: MarkedYaml) -> Problem:
    """One of pydantic's errors at its line, in our words."""
    path: Path = tuple(str(part) for part in details["loc"] if part != "[key]")
    kind, value = details["type"], details["input"]
    value = None if isinstance(value, dict | list | BaseModel) else value
    unit, inner = "", path
    error = details.get("ctx", {}).get("error")
    if isinstance(error, InputError):
        inner = (*path, *error.name.split(".")) if error.name else path
        value, unit, remedy = error.value, error.unit, error.remedy
    elif kind == "missing":
        example = EXAMPLES.get(".".join(path[-2:])) or EXAMPLES.get(path[-1], f"{path[-1]}: ...")
        value, remedy = None, f"is missing; state it, for example {example}"
    elif kind == "extra_forbidden":
        value, remedy = None, f"unknown key; {did_you_mean(path[-1], _known_keys(path[:-1]))}"
    elif kind == "literal_error":
        remedy = f"must be {details['ctx']['expected']}"
    elif value is None and kind in REMEDIES:
        remedy = "is blank or no single value; " + REMEDIES[kind]
    else:
        remedy = REMEDIES.get(kind, details["msg"])
    name = ".".join(inner)
    return Problem(file=FILE, line=marked.line(inner), name=name, value=value, unit=unit, remedy=remedy)


def _known_keys(path: Path) -> list[str]:
    """The keys that the schema has at ``path``."""
    if path == ():
        return [name.rstrip("_") for name in schema.CampaignEntry.model_fields]
    if path[0] == "signals":
        return list((schema.WanderEntry if len(path) > 2 else schema.SignalEntry).model_fields)
    if path == ("settings", "yaw"):
        return list(schema.SpreadEntry.model_fields)
    if len(path) > 1:
        return list(schema.QuantityEntry.model_fields)
    sections: dict[str, type[BaseModel]] = {
        "source": schema.SourceEntry,
        "machine": schema.MachineEntry,
        "belt": schema.BeltEntry,
        "settings": schema.SettingsEntry,
    }
    return list(sections[path[0]].model_fields)


def _sheet(entry: schema.CampaignEntry) -> Sheet:
    machine, belt = entry.machine, entry.belt
    head, tail = machine.head_radius or machine.pulley_radius, machine.tail_radius or machine.pulley_radius
    assert head is not None
    assert tail is not None
    yaw = entry.settings.yaw
    return Sheet(
        title=entry.title,
        source=Source(**entry.source.model_dump()),
        machine=Machine(
            centre_distance=_quantity(machine.centre_distance, "length"),
            head_radius=_quantity(head, "length"),
            tail_radius=_quantity(tail, "length"),
        ),
        belt=BeltSheet(
            width=_quantity(belt.width, "length"),
            thickness=_quantity(belt.thickness, "length"),
            youngs_modulus=_quantity(belt.youngs_modulus, "stress"),
            density=_quantity(belt.density, "density"),
            poisson_ratio=_quantity(belt.poisson_ratio, "number"),
        ),
        signals=tuple(_signal(name, signal) for name, signal in entry.signals.items()),
        settings=SettingsSheet(
            tension_rel=entry.settings.tension_rel,
            yaw_u=to_si(yaw.u, yaw.unit, dimension="angle", name="settings.yaw"),
        ),
    )


def _quantity(entry: schema.QuantityEntry, dimension: str) -> Quantity:
    return Quantity(
        value=to_si(entry.value, entry.unit, dimension=dimension, name="value"),
        u=to_si(entry.u, entry.unit, dimension=dimension, name="u"),
    )


def _signal(name: str, entry: schema.SignalEntry) -> SignalSheet:
    kind = PLACES[entry.at]

    def si(value: float) -> float:
        return to_si(value, entry.unit, dimension=SIGNAL_DIMENSION[kind], name=name)

    wander = entry.wander
    return SignalSheet(
        name=name,
        at=entry.at,
        kind=kind,
        unit=entry.unit,
        white=si(entry.white),
        zero=si(entry.zero),
        gain=entry.gain,
        wander_sd=si(wander.sd) if wander else 0.0,
        wander_length=wander.length_m if wander else 1.0,
    )
