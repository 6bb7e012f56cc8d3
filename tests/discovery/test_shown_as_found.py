"""A discovered law is shown as named effects are: curves, errors and names."""

import numpy as np
from small_discovery import campaign, surveyed

import belt_sim as bs
from belt_sim.discovery import search_data
from belt_sim.discovery.search_data import campaign_places

SAME = 1e-6  # [m]: one table of errors, wherever it is read
PLACES = ("yaw_tail", "yaw_both", "drift_tail", "sensor_y1")
FEW = ("yaw_offset_head",)  # which does nothing alike


def test_where_no_effect_is_named_the_error_falls_by_the_law(monkeypatch):
    few = tuple(p for p in campaign_places(surveyed("yaw_creep").bench.samples) if p.name in PLACES)
    monkeypatch.setattr(search_data, "campaign_places", lambda samples: few)
    seen: list[bs.Diagnosis] = []
    found = bs.diagnose(campaign("yaw_creep"), "strip", FEW, shown=seen.append)
    (early,) = seen  # pictures show the law, for which they wait
    assert not found.effects
    assert early.discovery == found.discovery
    assert found.final_model == "strip + the discovered law"
    told = found.discovery.error
    for one, other in ((found.error.fit, told.fit), (found.error.held_out, told.held_out)):
        assert abs(one.before - other.before) < SAME
        assert abs(one.after - other.after) < SAME
    assert found.error.held_out.after < 0.8 * found.error.held_out.before
    off = [(np.abs(p.base - p.measured).mean(), np.abs(p.final - p.measured).mean()) for p in early.drawings.overlays]
    before, after = np.sum(off, axis=0)
    assert after < 0.8 * before
