"""Units as people write them: whatever the spelling, one number in SI comes out."""

import math
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from belt_sim.errors import InputError
from belt_sim.settings import BELT, BOUNDS, check_range
from belt_sim.units import NAMES, SPELLINGS, UNITS, number_of, quantity, scaled_unit, split_units, unit_named, unit_of

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
    if re.search(r"(?<![\d.])[1-9]\d{0,2},\d{3}(?!\d)", comma):  # a thousand to some
        with pytest.raises(InputError, match="two readings"):
            quantity(comma, (UNITS[unit][0],), "m", "x")
        return
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
        assert split_units(header) == (name, (unit,))
    assert split_units(f"{name} (d) [{unit}]") == (name, ("d", unit))
    assert split_units(name) == (name, ())


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


@pytest.mark.parametrize(
    ("written", "unit"),
    [("PLI", "lbf/in"), ("N/mm", "N/mm"), ("kN/m", "kN/m"), ("daN", "daN"), ("kp", "kp"), ("kgf", "kp"), ("MPA", "MPa"),
     ("mpa", "MPa"), ("mPa", None), ("arcmin", "arcmin"), ("N/mm\u00b2", "N/mm2"), ("\u00b5m", "um"), ("MM", "mm")],
)  # fmt: skip
def test_units_of_the_shop_and_one_that_is_two(written, unit):
    assert unit_named(written) == unit


@pytest.mark.parametrize(
    ("text", "number"),
    [("1,2", 1.2), ("0,170", 0.17), ("1.200", 1.2), ("1,200.5", 1200.5), ("1.200,5", 1200.5), ("1 200", 1200.0),
     ("1'200", 1200.0), ("1,200,300", 1200300.0), ("\u22120.04", -0.04), ("1,200", None), ("12,345", None),
     ("1,20,3", None), ("1.2.3", None)],
)  # fmt: skip
def test_marks_of_thousands_are_read_where_they_have_one_reading(text, number):
    if number is None:
        with pytest.raises(InputError, match=r"two readings|is no number"):
            number_of(text)
    else:
        assert number_of(text) == number


@pytest.mark.parametrize(
    ("text", "found"),
    [("0.01 mm", (0.01, "mm")), ("1/100 mm", (0.01, "mm")), ("mm x 0.01", (0.01, "mm")), ("10^-2 mm", (0.01, "mm")),
     ("0,01mm", (0.01, "mm")), ("mm/m", None), ("N/mm2", None), ("mm", None), ("kg/m3", None)],
)  # fmt: skip
def test_a_number_times_a_unit(text, found):
    assert scaled_unit(text) == found


def test_one_table_of_bounds_for_configurations_and_data_sheets():
    for key in ("rig.centre_distance", "rig.head_radius", *(f"belt.{name}" for name in BELT)):
        bounds = BOUNDS[key.partition(".")[2]]
        for end in (bounds.low, bounds.high):
            assert check_range({key: end * UNITS[bounds.unit][1]}, key) == pytest.approx(bounds.check(end))
        with pytest.raises(InputError, match="must be"):
            check_range({key: bounds.high * 1.001 * UNITS[bounds.unit][1]}, key)
        with pytest.raises(InputError, match="must be"):
            bounds.check(bounds.high * 1.001)
