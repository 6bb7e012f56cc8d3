"""Numbers as people read them."""

import pytest

from belt_sim.results import words


@pytest.mark.parametrize(
    ("value", "u", "unit", "text"),
    [
        (2.0e-5, 1e-6, "1/m", "(2.00 ± 0.10)·10⁻⁵ 1/m"),
        (1.02, 0.03, "1", "1.020 ± 0.030"),
        (-733.2, 14.0, "urad", "−733 ± 14 urad"),
        (0.5, None, "m", "0.500 m"),
        (float("nan"), 1.0, "m", "–"),
    ],
)
def test_values_carry_two_digits_of_their_uncertainty(value, u, unit, text):
    assert words.with_u(value, u, unit) == text


@pytest.mark.parametrize(
    ("value", "text"), [(0.0410e-3, "0.041"), (1.884e-3, "1.88"), (0.0, "0.00"), (-0.25e-3, "−0.25"), (None, "–")]
)
def test_millimetres_have_no_idle_digits(value, text):
    assert words.thousandths(value) == text


@pytest.mark.parametrize(
    ("value", "sign", "text"), [(1.5e-3, False, "1.5000"), (1.5e-3, True, "+1.5000"), (None, False, "-")]
)
def test_columns_have_four_decimals(value, sign, text):
    assert words.column(value, sign=sign) == text


@pytest.mark.parametrize(
    ("names", "text"), [([], "nothing"), (["a"], "a"), (["a", "b"], "a and b"), (["a", "b", "c"], "a, b and c")]
)
def test_lists_read_as_people_write_them(names, text):
    assert words.join_words(names) == text


def test_nested_tables_become_rows():
    table = {"versions": {"jax": "1"}, "seed": 5, "share": 0.123456, "none": None}
    assert words.rows(table) == [("versions · jax", "1"), ("seed", "5"), ("share", "0.1235"), ("none", "None")]
