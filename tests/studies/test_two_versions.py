"""Two versions of the diagnosis on the same campaigns, counted."""

from studies.two_versions import rows


def test_each_kind_is_counted_by_who_was_right():
    found = [(True, True, "nothing"), *[(True, False, "library")] * 5, (False, True, "library"), (False, False, "two")]
    nothing, library, two = rows(found)
    assert nothing == ("nothing", "1", "1", "0", "0", "0", "1")
    assert library == ("one effect", "6", "0", "5", "1", "0", "0.22")  # 2 (1 + 6) / 2^6
    assert two == ("two effects", "1", "0", "0", "0", "1", "1")
