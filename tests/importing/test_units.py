"""Units as people write them: whatever the spelling, one number in SI comes out."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from belt_sim.errors import InputError
from belt_sim.importing.units import NAMES, SPELLINGS, quantity, split_unit, unit_named, unit_of
from belt_sim.si import UNITS

ROUNDING = 1e-12  # relative: a product or two in float64
NUMBERS = st.floats(min_value=-1e6, max_value=1e6).filter(lambda x: x == 0 or abs(x) > 1e-6)
NAMED = [u for u in NAMES if u not in ("1", "%")]
#: relations that any textbook has, as products of units
SAME = [
    ("m", 1e3, "mm"), ("mm", 1e3, "um"), ("cm", 10, "mm"), ("rad", 1e3, "mrad"), ("mrad", 1, "mm/m"),
    ("mrad", 1e3, "urad"), ("rad", 180 / math.pi, "deg"), ("h", 60, "min"), ("min", 60, "s"), ("s", 1e3, "ms"),
    ("m/s", 60, "m/min"), ("m/s", 1e3, "mm/s"), ("N/mm2", 1, "MPa"), ("GPa", 1e3, "MPa"), ("MPa", 1e3, "kPa"),
    ("kN", 1e3, "N"), ("1", 100, "%"), ("in", 25.4, "mm"), ("ft", 12, "in"), ("in", 1e3, "mil"), ("ft/s", 60, "ft/min"),
    ("ksi", 1e3, "psi"), ("ft/s", 0.3048, "m/s"), ("lbf", 4.4482216152605, "N"), ("MPa", 145.03773773020923, "psi"),
]  # fmt: skip


def in_si(text: str, *dimensions: str, default: str = "1") -> float:
    value, _, unit = quantity(text, dimensions, default, "x")
    return value * UNITS[unit][1]


@pytest.mark.parametrize(("large", "times", "small"), SAME)
def test_a_unit_is_so_many_of_another(large, times, small):
    assert UNITS[large][0] == UNITS[small][0]
    assert UNITS[large][1] == pytest.approx(times * UNITS[small][1], rel=ROUNDING)


@settings(deadline=None)
@given(value=NUMBERS, u=st.none() | st.floats(min_value=1e-6, max_value=1e3), unit=st.sampled_from(NAMED))
def test_a_quantity_that_is_written_is_read_back(value, u, unit):
    text = f"{value!r}" + (f" +- {u!r}" if u is not None else "") + f" {unit}"
    assert quantity(text, (UNITS[unit][0],), "m", "x") == (value, u, unit)
    comma = text.replace(".", ",")
    assert quantity(comma, (UNITS[unit][0],), "m", "x") == (value, u, unit)


@settings(deadline=None)
@given(value=NUMBERS, spelling=st.sampled_from([s for s in SPELLINGS if s not in ("", "-")]))
def test_a_spelling_changes_no_value(value, spelling):
    unit = SPELLINGS[spelling]
    kind = UNITS[unit][0]
    for written in (spelling, spelling.upper(), f" {spelling} ", f"[{spelling}]"):
        assert unit_named(written) == unit
    assert in_si(f"{value!r} {spelling}", kind) == in_si(f"{value!r} {unit}", kind)


@settings(deadline=None)
@given(
    name=st.text(alphabet="abcxyzABC", min_size=2, max_size=8).filter(lambda s: unit_named(s) is None),
    unit=st.sampled_from(NAMED),
)
def test_a_header_is_a_name_and_a_unit(name, unit):
    for header in (f"{name} [{unit}]", f"{name} ({unit})", f"{name} in {unit}"):
        assert split_unit(header) == (name, unit)
    assert split_unit(name) == (name, None)


@given(unit=st.sampled_from(NAMES), kind=st.sampled_from(sorted({kind for kind, _ in UNITS.values()})))
def test_a_unit_of_another_kind_is_refused(unit, kind):
    if UNITS[unit][0] == kind:
        assert unit_of(unit, (kind,), "x") == unit
    else:
        with pytest.raises(InputError, match="is no unit of"):
            unit_of(unit, (kind,), "x")


@given(text=st.sampled_from(["", "left", "1 2 mm", "--1 mm", "1..2 mm", "nan mm", "inf mm", "1e999x mm", "3 parsec"]))
def test_what_is_no_quantity_is_refused_in_a_line(text):
    with pytest.raises(InputError) as refusal:
        quantity(text, ("length",), "mm", "travel")
    assert "travel" in str(refusal.value)
    assert "\n" not in str(refusal.value)
