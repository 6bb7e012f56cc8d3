"""The admission test lets a sound effect in and names what is wrong with the others."""

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "diagnose"))
from small_campaign import MODEL, campaign

from belt_sim.api import check
from belt_sim.effects.base import Effect, Parameter, effect, library
from belt_sim.effects.load import load_classes
from belt_sim.errors import InputError
from belt_sim.io import MODEL_FOLDER
from belt_sim.line.march import march_case

SIZE = Parameter(unit="1/m", meaning="turn where the belt runs up", plausible=(-1e-3, 1e-3), scale=2e-5)


class Turn(Effect):
    """A turn of the belt where it runs up, declared as each test wants it; physically a taper."""

    law = "run-up"
    parity = "even"

    def runup(self, runup, state, case):
        return replace(runup, turn=runup.turn + self.a)


@effect
@dataclass(frozen=True, kw_only=True)
class WrongParity(Turn):
    id = "wrong_parity"
    parity = "odd"
    parameters = {"a": SIZE}
    a: float = 0.0


@effect
@dataclass(frozen=True, kw_only=True)
class NoUnit(Turn):
    id = "no_unit"
    parameters = {"a": replace(SIZE, unit="")}
    a: float = 0.0


@effect
@dataclass(frozen=True, kw_only=True)
class NoRange(Turn):
    id = "no_range"
    parameters = {"a": replace(SIZE, plausible=(1.0, 1.0))}
    a: float = 0.0


@effect
@dataclass(frozen=True, kw_only=True)
class NeverNull(Turn):
    id = "never_null"
    parameters = {"a": SIZE}
    a: float = 0.0

    def runup(self, runup, state, case):
        return replace(runup, turn=runup.turn + self.a + 1e-9)


@effect
@dataclass(frozen=True, kw_only=True)
class NullChangesReadings(Effect):
    id = "null_changes_readings"
    law = "sensor"
    parameters = {"a": SIZE}
    a: float = 0.0

    def sensor(self, reading, case):
        return replace(reading, y=reading.y * (1.0 + 1e-12) + self.a)


@effect
@dataclass(frozen=True, kw_only=True)
class DoesNothing(Effect):
    id = "does_nothing"
    law = "run-up"
    parity = "even"
    parameters = {"a": SIZE}
    a: float = 0.0


@effect
@dataclass(frozen=True, kw_only=True)
class WrongExponent(Turn):
    id = "wrong_exponent"
    tension_exponent = -2.0
    parameters = {"a": SIZE}
    a: float = 0.0


@pytest.mark.parametrize(
    ("cls", "says"),
    [
        (WrongParity, "wrong_parity.parity = odd: measured"),
        (NoUnit, "no_unit.parameters.a"),
        (NoRange, "give .low, high."),
        (NeverNull, "never_null.null.* = changes the curves"),
        (NullChangesReadings, "null_changes_readings.null.* = changes the curves"),
        (DoesNothing, "moves nothing"),
        (WrongExponent, "wrong_exponent.tension_exponent = -2.0: measured"),
    ],
)
def test_what_is_wrong_is_named_in_one_line(cls, says):
    with pytest.raises(InputError, match=says) as caught:
        check.admit(cls, MODEL, campaign("nothing"))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("share", "says"), [(2e-15, "past the null limit"), (1e-12, "changes the curves")])
def test_null_parameters_may_change_the_rounding_where_jax_fuses(share, says, monkeypatch):
    """In plain Python, without ``prepare()``: also where a curve itself is 0."""

    def fused(case, model, effects=(), **how):
        curves = march_case(case, model, **how)
        return replace(curves, y=curves.y + share * np.abs(curves.y).max()) if effects else curves

    def declarations(*_):
        raise InputError("effect", "", "", "past the null limit")

    monkeypatch.setattr(check, "UNFUSED", "not among the flags")
    monkeypatch.setattr(check, "march_case", fused)
    monkeypatch.setattr(check, "_check_declarations", declarations)
    with pytest.raises(InputError, match=says):
        check.admit(library()["taper"], MODEL, campaign("nothing"))


def test_the_worked_example_is_admitted(monkeypatch):
    few = {i: c for i, c in library().items() if i in ("taper", "sensor_gain")}  # all of them compile for half a minute
    monkeypatch.setattr(check, "library", lambda: few)
    wind = load_classes([str(MODEL_FOLDER / "effects" / "wind.py")])["wind"]
    lines = check.admit(wind, MODEL, campaign("nothing"))
    assert all(line.startswith("wind: ") for line in lines)
    assert "bit for bit" in lines[0]
    assert "even in yaw, as declared" in lines[1]
    alike = {line.split(" with ")[1].split(":")[0]: line for line in lines if "collinearity" in line}
    assert alike["taper"].endswith(": taper can imitate yours")  # a steady turn at both pulleys is a taper of both
    assert float(alike["taper"].split("collinearity ")[1].split()[0]) > 0.98
    assert "imitate" not in alike["sensor_gain"]
    assert not any("cannot tell" in line for line in lines)  # a taper of one pulley is no wind: the evidence decides
