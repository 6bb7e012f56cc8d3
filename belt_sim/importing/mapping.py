"""The mapping, belt-mapping/1: what the files cannot say, by YAML or as plain Python data."""

import re
from collections.abc import Callable, Sequence
from collections.abc import Mapping as AnyMapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import yaml
from pydantic import AfterValidator, BeforeValidator, ValidationError, create_model

from belt_sim.campaign.folder import RUN_NUMBERS
from belt_sim.campaign.sheet import REMEDIES_BY_TYPE, Entry, MarkedYaml, SourceEntry, parse, validation_problem
from belt_sim.campaign.types import CampaignError, Problem, did_you_mean, place_text, refusal
from belt_sim.errors import InputError

MAPPING_SCHEMA = "belt-mapping/1"
DAY = 86400.0  # [s]
#: Name under which the mapping is left in the campaign folder.
MAPPING_FILE = "mapping.yaml"


#: what a column may be -> dimensions that its unit may have; () of one that has none
ROLES: dict[str, tuple[str, ...]] = {
    "run": (),
    "time": ("time",),
    "travel": ("length",),
    "speed": ("speed",),
    "tension": ("stress", "force", "line load"),
    "yaw": ("angle",),
    "yaw_head": ("angle",),
    "direction": ("number",),
    "yaw_at": ("length",),
    "start": ("length",),
    "y0": ("length",),
    "signal": ("length", "angle"),
    **dict.fromkeys(("rate1", "rate2", "rate3", "rate4", "u_rate"), ("angle",)),
    "ignore": (),
}

# ---- the file

#: A number, alone or with a unit, as ``10``, ``10 N/mm2``, ``11.28 +- 0.005 m``.
Text = Annotated[str, BeforeValidator(lambda v: v if v is None else str(v))]


class SourceMapping(SourceEntry):
    kind: Literal["measured", "digitised", "synthetic"] = "measured"


#: numbers of machine and belt -> unit where none is written, and relative u that is assumed where none is stated
DATA = {
    "machine": {"centre_distance": ("m", 5e-4)}
    | dict.fromkeys(("pulley_radius", "head_radius", "tail_radius"), ("m", 3e-3)),
    "belt": {
        "width": ("mm", 5e-4),
        "thickness": ("mm", 1e-2),
        "youngs_modulus": ("GPa", 2e-2),
        "density": ("kg/m^3", 0.0),
        "poisson_ratio": ("1", 0.0),
    },
}
_FIELDS: dict[str, Any] = {part: dict.fromkeys(names, (Text | None, None)) for part, names in DATA.items()}
MachineMapping = create_model("MachineMapping", __base__=Entry, **_FIELDS["machine"])
BeltMapping = create_model("BeltMapping", __base__=Entry, **_FIELDS["belt"])


def zone_seconds(zone: str) -> float:
    """Seconds that a zone (+02:00, Z, "") is ahead of UTC; nan for what is none."""
    found = re.fullmatch(r"([+-])(\d{2}):?(\d{2})", zone)
    if not found:
        return 0.0 if zone.upper() in ("", "Z", "UTC", "GMT") else np.nan
    return (-60.0 if found[1] == "-" else 60.0) * (60 * int(found[2]) + int(found[3]))


def _must(name: str, fits: Callable[[Any], bool], remedy: str | Callable[[Any], str]) -> AfterValidator:
    """A validator of an entry."""

    def check(value: Any) -> Any:
        if not fits(value):
            raise InputError(name, value, "", remedy if isinstance(remedy, str) else remedy(value))
        return value

    return AfterValidator(check)


_FACTOR = "must be a number between 1e-12 and 1e12, or its negative"
_SIGN = "must be 1 or -1; a factor has a key of its own, factor: 0.001"
RoleName = Annotated[str, _must("role", ROLES.__contains__, lambda name: did_you_mean(name, ROLES))]
Sign = Annotated[float, _must("sign", lambda sign: abs(sign) == 1.0, _SIGN)]
Factor = Annotated[float, _must("factor", lambda factor: 1e-12 <= abs(factor) <= 1e12, _FACTOR)]
_MARKS = "give two different marks: pixel: [80, 680], value: [0, 25]"
Marks = Annotated[tuple[float, float], _must("", lambda marks: marks[0] != marks[1], _MARKS)]
Zone = Annotated[str, _must("zone", lambda zone: zone_seconds(zone) == zone_seconds(zone), "write it as Z or +02:00")]


class FormatEntry(Entry):
    separator: str | None = None
    decimal: Literal[".", ","] | None = None
    thousands: Literal[".", ",", " ", "'"] | None = None
    date: Literal["dmy", "mdy", "ymd"] | None = None
    time: Literal["hh:mm", "mm:ss", "hh:mm:ss:cc", "d:hh:mm:ss"] | None = None
    zone: Zone | None = None
    counter: Literal["new_run", "goes_on"] | None = None
    standstill: Literal["belt_stood", "belt_ran"] | None = None
    encoding: str | None = None
    missing: list[float] | float | None = None


class WanderMapping(Entry):
    sd: Text
    length_m: Text


class AxisEntry(Entry):
    """Two marks of an axis of a digitised picture; u: one sigma of reading it, in pixels."""

    pixel: Marks
    value: Marks
    u: float = 1.0

    @property
    def scale(self) -> float:
        """Of a pixel."""
        return (self.value[1] - self.value[0]) / (self.pixel[1] - self.pixel[0])


class ColumnEntry(Entry):
    role: RoleName | None = None
    unit: str | None = None
    at: Annotated[str | None, BeforeValidator(place_text)] = None
    name: str | None = None
    sign: Sign = 1.0
    factor: Factor = 1.0
    run: Text | None = None
    against: str | None = None
    middle: Text | None = None
    white: Text | None = None
    zero: Text | None = None
    gain: Text | None = None
    wander: WanderMapping | None = None
    axis: AxisEntry | None = None


#: settings of a run, as runs.csv has them
_RUN_FIELDS: dict[str, Any] = {name: (Text | None, None) for name, _, _ in RUN_NUMBERS.values()}


class RunEntry(create_model("RunNumbers", __base__=Entry, **_RUN_FIELDS)):  # type: ignore[misc]
    name: str | None = None
    repeat_of: Text | None = None
    use: Literal["fit", "hold_out"] | None = None
    skip: bool = False


class SettingsMapping(Entry):
    tension_rel: Text | None = None
    yaw: Text | None = None


class MappingEntry(Entry):
    schema_: Literal["belt-mapping/1"] = "belt-mapping/1"
    title: str | None = None
    source: SourceMapping = SourceMapping()
    machine: MachineMapping | str | None = None  # type: ignore[valid-type]
    belt: BeltMapping | str | None = None  # type: ignore[valid-type]
    format: FormatEntry = FormatEntry()
    columns: dict[str, ColumnEntry] = {}
    all_runs: RunEntry = RunEntry()
    runs: dict[str, RunEntry] = {}
    settings: SettingsMapping = SettingsMapping()
    use: dict[str, Text] = {}
    trust: dict[str, Text | bool] = {}
    step_m: Text | None = None
    start: Literal["yaw", "as_logged"] = "yaw"
    spikes: Literal["leave_out", "keep"] = "leave_out"

    def is_trusted(self, role: str) -> bool:
        """Whether an unlikely number of this role is taken as it is."""
        return str(self.trust.get(role, "")).lower() in ("yes", "true")


def mapping_of(stated: Any) -> MappingEntry:
    """The mapping from plain data, a YAML file, or None; raises CampaignError naming line, key and remedy."""
    if stated is None or isinstance(stated, MappingEntry):
        return stated or MappingEntry()
    file = "mapping"
    if isinstance(stated, AnyMapping):
        marked = MarkedYaml(_as_text(stated))
    else:
        path, file = Path(stated), str(Path(stated))
        try:
            if path.exists() and not path.is_file():  # a pipe would wait for ever
                what = "is a folder; name the file in it" if path.is_dir() else "is no file; name one"
                raise refusal(path, f"{what}, as mapping=FOLDER/{MAPPING_FILE}")
            text = path.read_text(encoding="utf-8-sig")
        except (OSError, ValueError) as error:
            cause = getattr(error, "strerror", None) or "not UTF-8 text"
            raise refusal(path, f"cannot be read ({cause}); name a YAML file, or leave mapping out") from None
        marked = parse_mapping(text, file)
    try:
        return MappingEntry.model_validate(marked.tree)
    except ValidationError as error:
        found: dict[tuple[str, ...], Any] = {}
        for details in error.errors():  # of a union (machine: name or numbers) the one about the numbers
            location = tuple(str(p) for p in details["loc"])
            if location[-1:] != ("str",) or len(error.errors()) == 1:
                found.setdefault(tuple(p for p in location if p not in _NAME_OR_NUMBERS), details)
    remedies = REMEDIES_BY_TYPE | _OWN_REMEDIES
    said = (validation_problem(d, path, marked, file, MappingEntry, remedies=remedies) for path, d in found.items())
    raise CampaignError([*said])


def parse_mapping(text: str, file: str) -> MarkedYaml:
    """A mapping of plain text values, with their lines; raises CampaignError for what is none."""
    problems: list[Problem] = []
    marked = parse(text, file, problems)
    if problems or marked is None:
        raise CampaignError(problems)
    if not isinstance(marked.tree, dict):
        raise refusal(file, f"must be a mapping that begins with schema: {MAPPING_SCHEMA}", line=1)
    return marked


def _as_text(value: Any) -> Any:
    """Plain data as YAML would hold it; blanks are left out."""
    if isinstance(value, AnyMapping):
        return {str(k): _as_text(v) for k, v in value.items() if v not in (None, "")}
    return [_as_text(v) for v in value] if isinstance(value, list | tuple) else value


#: what pydantic adds to the path of an error in ``machine`` and ``belt``, each a name or numbers
_NAME_OR_NUMBERS = (MachineMapping.__name__, BeltMapping.__name__, "str")
_OWN_REMEDIES = {"model_type": "give a name, or a mapping of numbers"}


# ---- what is still open


@dataclass(frozen=True)
class Question:
    """Something that the files cannot say.

    path: keys in the mapping under which the answer stands; text: the question; example: how an answer looks; options:
    all possible answers, where there are few; proposed: a likely answer.
    """

    path: tuple[str, ...]
    text: str
    example: str
    options: tuple[str, ...] = ()
    proposed: str = ""

    @property
    def key(self) -> str:
        return ".".join(self.path)

    def put(self, mapping: dict[str, Any], answer: str | None) -> None:
        """Write an answer into the mapping; of a place or a unit, a role may be given instead."""
        key = "role" if self.path[-1] in ("at", "unit") and answer in ROLES else self.path[-1]
        inner = inner_mapping(mapping, self.path[:-1])
        if key == "at" and inner.get("role") == "ignore":
            del inner["role"]  # where it measures says what it is
        inner[key] = answer

    @property
    def problem(self) -> Problem:
        """The question as one line: what is missing and how to give it."""
        nested: Any = self.example
        for key in reversed(self.path):
            nested = {key: nested}
        choice = f" (one of {', '.join(self.options)})" if self.options else ""
        return Problem(
            file="mapping", name=self.key, remedy=f"{self.text}{choice}; give it as  {flow_text(nested)[1:-1]}"
        )


def flow_text(value: Any) -> str:
    """A value as YAML on one line."""
    text = yaml.safe_dump(value, sort_keys=False, allow_unicode=True, width=10_000, default_flow_style=True)
    return text.removesuffix("\n...\n").strip()


@cache
def texts_of(file: str) -> dict[str, Any]:
    """The content of a YAML file of this package: questions, or synonyms (what people call roles, places, ...)."""
    found: dict[str, Any] = yaml.safe_load(Path(__file__).with_name(file).read_text(encoding="utf-8"))
    return found


def ask(kind: str, answers: Sequence[str] = (), example: str = "", proposed: str = "", **words: object) -> Question:
    """The question of a kind of questions.yaml, its words filled in; answers, example, proposed: before the kind's."""
    form = texts_of("questions.yaml")[kind]
    path, answers = tuple(p.format(**words) for p in form["key"].split("|")), tuple(answers or form.get("answers", ()))
    example, proposed = example or form.get("example") or answers[0], proposed or form.get("proposed", "")
    return Question(path, form["text"].format(**words), example, answers, proposed)


def inner_mapping(mapping: dict[str, Any], path: tuple[str, ...]) -> dict[str, Any]:
    """The mapping at a path of keys, put there where none is."""
    for key in path:
        if not isinstance(mapping.get(key), dict):
            mapping[key] = {}
        mapping = mapping[key]
    return mapping
