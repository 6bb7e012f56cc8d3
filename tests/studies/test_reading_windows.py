"""Windows in which rates may have been read, and the statements on records whose rates are known."""

import numpy as np
import pytest

from studies.reading_windows import STEP, TENSIONS, TIGHT, Record, judge, windows

RATES = {7.0: 0.3, 10.0: 0.2, 20.0: 0.12, TIGHT: 0.1}
PLACES = 121


def straight(rates) -> Record:
    return Record({t: rates[t] * STEP * np.arange(PLACES) for t in TENSIONS}, dict(rates))


def test_windows_are_two_to_twenty_metres_long_and_end_in_time():
    begin, end = windows(30.0, PLACES)
    lengths = STEP * (end - begin)
    assert (lengths.min(), lengths.max(), STEP * end.max()) == (2.0, 20.0, 30.0)
    assert len(set(zip(begin, end, strict=True))) == len(begin)


@pytest.mark.parametrize(("slack", "share"), [(0.3, 1.0), (0.11, 0.0)])
def test_a_belt_of_constant_rates_is_read_alike_in_every_window(slack, share):
    own, beam = straight(RATES | {7.0: slack}), straight(dict.fromkeys(TENSIONS, 0.1) | {20.0: 0.12})
    bounds = straight(dict.fromkeys(TENSIONS, 1.0)).y[TIGHT], np.zeros(PLACES)
    found = judge(own, beam, *bounds, length=30.0)
    assert found["M3 read"] == found["both, same window"] == share
    np.testing.assert_allclose(found["M3"], [slack / 0.1, 2.0])
    np.testing.assert_allclose(found["M4"], 0.0, atol=1e-12)
    assert found["M6"] == 0.0
