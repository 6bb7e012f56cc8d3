"""Read campaign.yaml (schema belt-campaign/1) into SI data classes.

YAML is read as text values that remember their lines (mapping.yaml as well). pydantic models check structure, units
and magnitudes; every violation becomes a ``Problem`` at its line.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, partial
from importlib.resources import files
from typing import Annotated, Any, Literal, get_args, get_origin

import yaml
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, ValidationError, model_validator

from belt_sim.campaign.types import (
    ELSEWHERE_EXAMPLE,
    PLACES,
    BeltSheet,
    Campaign,
    Machine,
    Problem,
    Quantity,
    SettingsSheet,
    SignalSheet,
    Source,
    did_you_mean,
    kind_at,
    place_text,
    sensor_place,
)
from belt_sim.errors import InputError
from belt_sim.io import CarefulLoader
from belt_sim.settings import BELT, BOUNDS, MACHINE, SIGNAL_DIMENSION, Range
from belt_sim.units import UNITS

#: Largest campaign.yaml that is parsed [characters]; a sheet of a hundred signals has a tenth of it.
LONGEST_SHEET = 200_000

Path = tuple[str, ...]


@dataclass(frozen=True)
class MarkedYaml:
    """tree: nested dicts and lists with text (or None) leaves; lines: path -> line number from 1."""

    tree: object
    lines: dict[Path, int] = field(default_factory=dict)

    def line(self, path: Path) -> int | None:
        """Line of the nearest known part of ``path``."""
        for n in range(len(path), -1, -1):
            if path[:n] in self.lines:
                return self.lines[path[:n]]
        return None


def parse(text: str, file: str, problems: list[Problem]) -> MarkedYaml | None:
    """Parse; syntax errors, repeated keys and aliases go to ``problems``. None when nothing can be read."""

    def refuse(remedy: str, line: int | None = None, name: str = "", value: object = None, unit: str = "") -> None:
        problems.append(Problem(file=file, line=line, name=name, value=value, unit=unit, remedy=remedy))

    if len(text) > LONGEST_SHEET:
        remedy = f"must be at most {LONGEST_SHEET} characters; is this the campaign sheet?"
        refuse(remedy, name="length", value=len(text), unit="characters")
        return None
    try:
        root = yaml.compose(text, Loader=CarefulLoader)
    except yaml.MarkedYAMLError as error:
        mark, cause = error.problem_mark or error.context_mark, " ".join(str(error.problem or error.context).split())
        refuse(f"not valid YAML ({cause}); mend this line", mark.line + 1 if mark else None)
        return None
    except yaml.reader.ReaderError as error:
        refuse("remove this character", text[: error.position].count("\n") + 1, value=chr(error.character))
        return None
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # as an escape of no character
        refuse(f"not valid YAML ({type(error).__name__}); compare with a sample campaign")
        return None
    if root is None:
        refuse("the file is empty; state schema, title, machine, belt")
        return None
    lines: dict[Path, int] = {}

    def plain(node: yaml.Node, path: Path) -> object:
        """The value of a node, with its lines."""
        line = node.start_mark.line + 1
        lines.setdefault(path, line)
        if isinstance(node, yaml.SequenceNode):
            return [plain(item, (*path, str(i))) for i, item in enumerate(node.value)]
        if not isinstance(node, yaml.MappingNode):
            return None if node.tag == "tag:yaml.org,2002:null" else node.value
        out: dict[str, object] = {}
        for key, value in node.value:
            line, inner = key.start_mark.line + 1, (*path, str(key.value))
            if not isinstance(key, yaml.ScalarNode):
                refuse("a key must be one word", line, ".".join(path))
            elif key.value in out:
                refuse(f"stated twice, first in line {lines[inner]}; keep one", line, ".".join(inner))
            else:
                lines[inner] = line
                out[key.value] = plain(value, inner)
        return out

    return MarkedYaml(plain(root, ()), lines)


#: pydantic's type of error -> what to do about it.
REMEDIES_BY_TYPE = {
    "missing": "is missing; state it",
    "float_parsing": "must be a number, with a decimal point",
    "float_type": "must be a number, with a decimal point",
    "finite_number": "must be a finite number",
    "string_type": "must be text",
    "model_type": "must be a mapping, like {value: 200, unit: mm}",
    "dict_type": "must be a mapping, like {y1: {unit: mm, at: point_1, white: 0.02}}",
}


def validation_problem(
    details: Any,
    path: Path,
    marked: MarkedYaml,
    file: str,
    schema: type[BaseModel],
    *,
    examples: Mapping[str, str] | None = None,
    remedies: Mapping[str, str] = REMEDIES_BY_TYPE,
) -> Problem:
    """Translate one pydantic error into a problem at its line.

    path: of the value in the file; schema: of the whole file; examples: how a required key is written.
    """
    kind, value = details["type"], details["input"]
    value = None if isinstance(value, dict | list | BaseModel) else value
    unit, inner = "", path
    error = details.get("ctx", {}).get("error")
    if isinstance(error, InputError):
        inner = path if not error.name or path[-1:] == (error.name,) else (*path, *error.name.split("."))
        value, unit, remedy = error.value, error.unit, error.remedy
    elif kind == "missing" and examples is not None:
        example = examples.get(".".join(path[-2:])) or examples.get(path[-1], f"{path[-1]}: ...")
        value, remedy = None, f"is missing; state it, for example {example}"
    elif kind == "extra_forbidden":
        known = _keys_at(schema, path[:-1])
        value, remedy = None, f"unknown key; {did_you_mean(path[-1], known)}"
    elif kind == "literal_error":
        remedy = f"must be {details['ctx']['expected']}"
    elif value is None and kind in remedies:
        remedy = "is blank or no single value; " + remedies[kind]
    else:
        remedy = remedies.get(kind, details["msg"])
    return Problem(file=file, line=marked.line(inner), name=".".join(inner), value=value, unit=unit, remedy=remedy)


def _keys_at(annotation: Any, path: Path) -> list[str]:
    """The keys that a schema, as in ``dict[str, Entry] | None``, has at a path; the keys of a dictionary are free."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        fields = annotation.model_fields
        return _keys_at(fields[path[0]].annotation, path[1:]) if path else [name.rstrip("_") for name in fields]
    inner = path[1:] if get_origin(annotation) is dict else path
    return next((keys for part in get_args(annotation) if (keys := _keys_at(part, inner))), [])


CAMPAIGN_SCHEMA = "belt-campaign/1"
#: Column names of signals.csv that no signal may take.
RESERVED = ("run", "travel_m", "time_s")
NAME = re.compile(r"\w[\w.+ -]*")


class Entry(BaseModel):
    """A mapping of a file: unknown keys and non-finite numbers are refused; ``schema_`` is the key schema."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, alias_generator=lambda name: name.rstrip("_")
    )


class QuantityEntry(Entry):
    value: float
    u: float = 0.0
    unit: str = ""

    @property
    def si(self) -> Quantity:
        scale = UNITS[self.unit][1]
        return Quantity(value=self.value * scale, u=self.u * scale)


def in_range(bounds: Range) -> AfterValidator:
    """Return a validator of a quantity's unit and magnitude, which also requires 0 <= u <= |value|."""

    def check(entry: QuantityEntry) -> QuantityEntry:
        bounds.check(entry.value, entry.unit)
        if not 0.0 <= entry.u <= abs(entry.value):
            raise InputError("u", entry.u, entry.unit, "one sigma in the unit of the value: 0 to the value itself")
        return entry

    return AfterValidator(check)


def to_one_line(text: str, *, if_empty: str = "") -> str:
    """Return text with single blanks; raise InputError for unprintable characters, and with the remedy ``if_empty``."""
    text = " ".join(text.split())
    if not text.isprintable():
        raise InputError("", text, "", "remove the unprintable characters")
    if if_empty and not text:
        raise InputError("", None, "", if_empty)
    return text


OneLine = Annotated[str, AfterValidator(to_one_line)]
Radius = Annotated[QuantityEntry, in_range(BOUNDS["pulley_radius"])]


class SourceEntry(Entry):
    kind: Literal["measured", "digitised", "synthetic"]
    reference: OneLine = ""
    licence: OneLine = ""


class MachineEntry(Entry):
    centre_distance: Annotated[QuantityEntry, in_range(BOUNDS["centre_distance"])]
    pulley_radius: Radius | None = None
    head_radius: Radius | None = None
    tail_radius: Radius | None = None

    @model_validator(mode="after")
    def _pulleys(self) -> "MachineEntry":
        given = [entry is not None for entry in (self.pulley_radius, self.head_radius, self.tail_radius)]
        if given not in ([True, False, False], [False, True, True]):
            raise InputError("", None, "", "state either pulley_radius, or both head_radius and tail_radius")
        machine = self.si()
        if machine.head_radius.value + machine.tail_radius.value >= machine.centre_distance.value:
            entry = self.centre_distance
            raise InputError("centre_distance", entry.value, entry.unit, "the pulleys overlap; check the radii")
        return self

    def si(self) -> Machine:
        return Machine(**{n: (getattr(self, n) or self.pulley_radius).si for n in MACHINE})  # type: ignore[union-attr]


class BeltEntry(Entry):
    width: Annotated[QuantityEntry, in_range(BOUNDS["width"])]
    thickness: Annotated[QuantityEntry, in_range(BOUNDS["thickness"])]
    youngs_modulus: Annotated[QuantityEntry, in_range(BOUNDS["youngs_modulus"])]
    density: Annotated[QuantityEntry, in_range(BOUNDS["density"])]
    poisson_ratio: Annotated[QuantityEntry, in_range(BOUNDS["poisson_ratio"])] = QuantityEntry(value=0.3)

    @model_validator(mode="after")
    def _flat(self) -> "BeltEntry":
        if self.thickness.si.value >= self.width.si.value:
            raise InputError("thickness", self.thickness.value, self.thickness.unit, "must be below the width")
        return self


class WanderEntry(Entry):
    sd: float
    length_m: Annotated[float, AfterValidator(BOUNDS["wander_length"].check)]


class SignalEntry(Entry):
    unit: str
    at: Annotated[str, BeforeValidator(place_text)]
    white: float
    zero: float = 0.0
    gain: Annotated[float, AfterValidator(BOUNDS["gain"].check)] = 0.0
    wander: WanderEntry | None = None

    @model_validator(mode="after")
    def _magnitudes(self) -> "SignalEntry":
        kind = kind_at(self.at)
        if kind is None:
            remedy = f"{did_you_mean(self.at, PLACES)}, or {ELSEWHERE_EXAMPLE}"
            raise InputError("at", self.at, "", remedy)
        units = [unit for unit, (dimension, _) in UNITS.items() if dimension == SIGNAL_DIMENSION[kind]]
        if self.unit not in units:
            remedy = f"{self.at} gives a {kind} signal; use one of {', '.join(units)}"
            raise InputError("unit", self.unit, "", remedy)
        BOUNDS[f"white_{kind}"].check(self.white, self.unit, name="white")
        BOUNDS[f"error_{kind}"].check(self.zero, self.unit, name="zero")
        if self.wander is not None:
            BOUNDS[f"error_{kind}"].check(self.wander.sd, self.unit, name="wander.sd")
        return self

    def si(self, name: str) -> SignalSheet:
        scale, kind = UNITS[self.unit][1], kind_at(self.at) or "lateral"
        errors = {"white": self.white * scale, "zero": self.zero * scale, "gain": self.gain}
        if self.wander:
            errors |= {"wander_sd": self.wander.sd * scale, "wander_length": self.wander.length_m}
        return SignalSheet(name=name, at=self.at, kind=kind, unit=self.unit, **errors)


class SpreadEntry(Entry):
    u: float
    unit: str

    @model_validator(mode="after")
    def _magnitude(self) -> "SpreadEntry":
        BOUNDS["u_yaw"].check(self.u, self.unit, name="u")
        return self


class SettingsEntry(Entry):
    tension_rel: Annotated[float, AfterValidator(BOUNDS["tension_rel"].check)] = 0.0
    yaw: SpreadEntry = SpreadEntry(u=0.0, unit="rad")


def check_name(name: str, *, reserved: tuple[str, ...] = ()) -> str:
    """Return a name of a signal or run; raise InputError unless it has letters, digits, blanks and _ . + - only.

    reserved: columns of signals.csv whose names no signal may take.
    """
    if name in reserved:
        raise InputError("", None, "", f"{', '.join(reserved)} are columns of their own; choose another name")
    if not NAME.fullmatch(name) or name != name.strip():
        raise InputError("", None, "", "name it with letters, digits, blanks and _ . + - only")
    return name


class CampaignEntry(Entry):
    schema_: Literal["belt-campaign/1"]
    title: Annotated[str, AfterValidator(partial(to_one_line, if_empty="is empty; say what the campaign is"))]
    source: SourceEntry
    machine: MachineEntry
    belt: BeltEntry
    signals: dict[Annotated[str, AfterValidator(partial(check_name, reserved=RESERVED))], SignalEntry] = {}
    settings: SettingsEntry = SettingsEntry()


SHEET_FILE = "campaign.yaml"


@cache
def field_texts(what: Literal["meaning", "example"]) -> dict[str, str]:
    """Key of campaign.yaml -> what it means, or how it is written."""
    fields = yaml.safe_load(files("belt_sim.campaign").joinpath("fields.yaml").read_text(encoding="utf-8"))
    return {key: texts[what] for key, texts in fields.items() if what in texts}


def read_sheet(text: str, problems: list[Problem]) -> tuple[Campaign | None, frozenset[str] | None]:
    """Return the campaign that the sheet states, without its runs, and the names of its signals.

    The campaign is None if it has any violation, the names are None if the file is no mapping. Violations are appended
    to ``problems``.
    """
    before = len(problems)
    marked = parse(text, SHEET_FILE, problems)
    if marked is None:
        return None, None
    if not isinstance(marked.tree, dict):
        remedy = "must be a mapping that begins with schema: belt-campaign/1"
        problems.append(Problem(file=SHEET_FILE, line=1, remedy=remedy))
        return None, None
    signals = marked.tree.get("signals")
    names = frozenset(signals) if isinstance(signals, dict) else frozenset()
    try:
        entry = CampaignEntry.model_validate(marked.tree)
    except ValidationError as error:
        examples = field_texts("example")
        for details in error.errors():
            path: Path = tuple(str(part) for part in details["loc"] if part != "[key]")
            problems.append(validation_problem(details, path, marked, SHEET_FILE, CampaignEntry, examples=examples))
        return None, names
    machine, found, yaw = entry.machine.si(), [], entry.settings.yaw
    ends = {"tail_wrap": math.pi * machine.tail_radius.value, "head_wrap": math.pi * machine.head_radius.value}
    for name, signal in entry.signals.items():
        place = sensor_place(signal.at)
        end = ends.get(place.where, machine.centre_distance.value) if place else 0.0
        if place and place.distance > end:  # farther along a span or a wrap than it is long
            remedy = f"must be 0 to {end:.4g} m: the {place.where.replace('_', ' ')} is no longer"
            where: dict[str, Any] = {"line": marked.line(("signals", name, "at")), "name": f"signals.{name}.at"}
            problems.append(Problem(file=SHEET_FILE, value=place.distance, unit="m", remedy=remedy, **where))
        found.append(signal.si(name))
    sheet = Campaign(
        title=entry.title,
        source=Source(**entry.source.model_dump()),
        machine=machine,
        belt=BeltSheet(**{n: getattr(entry.belt, n).si for n in BELT}),
        signals=tuple(found),
        settings=SettingsSheet(tension_rel=entry.settings.tension_rel, yaw_u=yaw.u * UNITS[yaw.unit][1]),
        runs=(),
    )
    return (sheet if len(problems) == before else None), names
