"""The schema belt-campaign/1 of campaign.yaml: structure, units and plausible magnitudes."""

import re
from collections.abc import Callable
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, model_validator

from belt_sim.campaign import plausible
from belt_sim.campaign.nouns import PLACES
from belt_sim.campaign.plausible import ERROR, SIGNAL_DIMENSION, WHITE
from belt_sim.campaign.problems import did_you_mean
from belt_sim.errors import InputError
from belt_sim.si import UNITS

SCHEMA = "belt-campaign/1"
#: Column names of signals.csv that no signal may take.
RESERVED = ("run", "travel_m", "time_s")
NAME = re.compile(r"\w[\w.+ -]*")


class Entry(BaseModel):
    """A mapping of the sheet: unknown keys and non-finite numbers are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class QuantityEntry(Entry):
    value: float
    u: float = 0.0
    unit: str = ""


def within(bounds: plausible.Range) -> Callable[[QuantityEntry], QuantityEntry]:
    """Check of a quantity's unit and magnitude, and that its u is neither negative nor above the value."""

    def check(entry: QuantityEntry) -> QuantityEntry:
        bounds.check(entry.value, entry.unit)
        if not 0.0 <= entry.u <= abs(entry.value):
            raise InputError("u", entry.u, entry.unit, "one sigma in the unit of the value: 0 to the value itself")
        return entry

    return check


def number(bounds: plausible.Range) -> Callable[[float], float]:
    """Check of a plain number that is stated in the unit of ``bounds``."""

    def check(value: float) -> float:
        bounds.check(value)
        return value

    return check


def one_line(text: str) -> str:
    """Text with every white space as one blank; refused when something in it cannot be printed."""
    text = " ".join(text.split())
    if not text.isprintable():
        raise InputError("", text, "", "remove the unprintable characters")
    return text


def stated(text: str) -> str:
    if not text:
        raise InputError("", None, "", "is empty; say what the campaign is")
    return text


Line = Annotated[str, AfterValidator(one_line)]
CentreDistance = Annotated[QuantityEntry, AfterValidator(within(plausible.CENTRE_DISTANCE))]
Radius = Annotated[QuantityEntry, AfterValidator(within(plausible.RADIUS))]


class SourceEntry(Entry):
    kind: Literal["measured", "digitised", "synthetic"]
    reference: Line = ""
    licence: Line = ""


class MachineEntry(Entry):
    centre_distance: CentreDistance
    pulley_radius: Radius | None = None
    head_radius: Radius | None = None
    tail_radius: Radius | None = None

    @model_validator(mode="after")
    def _pulleys(self) -> "MachineEntry":
        both = self.head_radius is not None and self.tail_radius is not None
        either = self.head_radius is not None or self.tail_radius is not None
        if (self.pulley_radius is not None) == either or (either and not both):
            raise InputError("", None, "", "state either pulley_radius, or both head_radius and tail_radius")
        radii = [
            plausible.RADIUS.check(entry.value, entry.unit)
            for entry in (self.head_radius or self.pulley_radius, self.tail_radius or self.pulley_radius)
            if entry is not None
        ]
        distance = plausible.CENTRE_DISTANCE.check(self.centre_distance.value, self.centre_distance.unit)
        if sum(radii) >= distance:
            entry = self.centre_distance
            raise InputError("centre_distance", entry.value, entry.unit, "the pulleys overlap; check the radii")
        return self


class BeltEntry(Entry):
    width: Annotated[QuantityEntry, AfterValidator(within(plausible.WIDTH))]
    thickness: Annotated[QuantityEntry, AfterValidator(within(plausible.THICKNESS))]
    youngs_modulus: Annotated[QuantityEntry, AfterValidator(within(plausible.YOUNGS_MODULUS))]
    density: Annotated[QuantityEntry, AfterValidator(within(plausible.DENSITY))]
    poisson_ratio: Annotated[QuantityEntry, AfterValidator(within(plausible.POISSON_RATIO))] = QuantityEntry(value=0.3)

    @model_validator(mode="after")
    def _flat(self) -> "BeltEntry":
        width = plausible.WIDTH.check(self.width.value, self.width.unit)
        if plausible.THICKNESS.check(self.thickness.value, self.thickness.unit) >= width:
            raise InputError("thickness", self.thickness.value, self.thickness.unit, "must be below the width")
        return self


class WanderEntry(Entry):
    sd: float
    length_m: Annotated[float, AfterValidator(number(plausible.WANDER_LENGTH))]


class SignalEntry(Entry):
    unit: str
    at: str
    white: float
    zero: float = 0.0
    gain: Annotated[float, AfterValidator(number(plausible.GAIN))] = 0.0
    wander: WanderEntry | None = None

    @model_validator(mode="after")
    def _magnitudes(self) -> "SignalEntry":
        if self.at not in PLACES:
            raise InputError("at", self.at, "", did_you_mean(self.at, PLACES))
        kind = PLACES[self.at]
        units = [unit for unit, (dimension, _) in UNITS.items() if dimension == SIGNAL_DIMENSION[kind]]
        if self.unit not in units:
            remedy = f"{self.at} gives a {kind} signal; use one of {', '.join(units)}"
            raise InputError("unit", self.unit, "", remedy)
        WHITE[kind].check(self.white, self.unit, name="white")
        ERROR[kind].check(self.zero, self.unit, name="zero")
        if self.wander is not None:
            ERROR[kind].check(self.wander.sd, self.unit, name="wander.sd")
        return self


class SpreadEntry(Entry):
    u: float
    unit: str

    @model_validator(mode="after")
    def _magnitude(self) -> "SpreadEntry":
        plausible.YAW_U.check(self.u, self.unit, name="u")
        return self


class SettingsEntry(Entry):
    tension_rel: Annotated[float, AfterValidator(number(plausible.TENSION_REL))] = 0.0
    yaw: SpreadEntry = SpreadEntry(u=0.0, unit="rad")


def known_name(name: str) -> str:
    """A name of a signal or run: letters, digits, blanks and _ . + - only."""
    if not NAME.fullmatch(name) or name != name.strip():
        raise InputError("", None, "", "name it with letters, digits, blanks and _ . + - only")
    return name


def free_name(name: str) -> str:
    if name in RESERVED:
        raise InputError("", None, "", f"{', '.join(RESERVED)} are columns of their own; choose another name")
    return known_name(name)


class CampaignEntry(Entry):
    schema_: Literal["belt-campaign/1"]
    title: Annotated[Line, AfterValidator(stated)]
    source: SourceEntry
    machine: MachineEntry
    belt: BeltEntry
    signals: dict[Annotated[str, AfterValidator(free_name)], SignalEntry] = {}
    settings: SettingsEntry = SettingsEntry()

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, alias_generator=lambda name: name.rstrip("_")
    )
