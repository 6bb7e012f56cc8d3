"""What the sliders show is what a simulation says, and moving them compiles nothing."""

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the app needs NiceGUI: pip install 'belt-sim[app]'")

from belt_sim.api.simulate import simulate
from belt_sim.app.simulate_page import choices, reach, simulate_sliders, warnings
from belt_sim.app.widgets import search_words
from belt_sim.effects.base import library
from belt_sim.line import march

TAPER = {"taper": {"kappa_t": 2e-5}}


def simulated(**changes):
    sliders = {"model": "strip", "tension": 10.0, "yaw": -0.042, "travel": 40.0, "effects": TAPER}
    return simulate_sliders(**sliders | changes)


def test_a_shorter_travel_is_the_start_of_the_longest():
    shown = simulated()
    alone = simulate(model="strip", tension=10.0, yaw=-0.042, travel=40.0, effects=[{"id": "taper", "kappa_t": 2e-5}])
    np.testing.assert_allclose(shown.curves.y, np.asarray(alone.curves.y), atol=1e-9)
    assert shown.curves.travel[-1] == pytest.approx(40.0)


@pytest.mark.parametrize(
    ("word", "effect"), [("worn", "crown"), ("schief", "cant"), ("schief", "yaw_offset_tail"), ("konisch", "taper")]
)
def test_effects_are_found_by_what_people_call_them(word, effect):
    assert word in search_words(effect)


def test_moving_a_slider_compiles_nothing(monkeypatch):
    simulated()
    monkeypatch.setattr(march, "_steps_traced", None)  # nothing can be traced anew
    first = simulated(tension=11.0, yaw=0.1, travel=25.0)
    second = simulated(tension=30.0, yaw=0.1, effects={"taper": {"kappa_t": -1e-5}})
    assert not np.array_equal(first.curves.y[:, 100], second.curves.y[:, 100])


def test_a_slider_of_an_effect_may_stand_at_nothing():
    np.testing.assert_array_equal(
        simulated(effects={"taper": {"kappa_t": 0.0}}).curves.y, simulated(effects={}).curves.y
    )


def test_slack_edges_and_limits_are_told():
    said = " ".join(warnings(simulated(model="beam_th2", tension=3.0, yaw=0.2)))
    assert "edge goes slack" in said
    assert "use strip" in said


def test_every_number_of_every_effect_has_a_slider_that_reaches_both_ways():
    for effect_id in choices("strip"):
        for p in library()[effect_id].parameters.values():
            low, high, start = reach(p)
            assert low < high
            assert low <= start <= high


def test_nothing_is_said_of_what_happens_beyond_the_travel_that_is_shown():
    """After 146 m the belt lies half beside a face of its width: said of 200 m, not of 60."""
    asked = {
        "model": "strip",
        "tension": 80.0,
        "yaw": -0.15,
        "effects": {"taper": {"kappa_t": 3e-5, "kappa_t_head": 2e-5}},
    }
    long, short = (simulate_sliders(**asked, travel=travel) for travel in (200.0, 60.0))
    assert any("from 146 m" in line for line in warnings(long))
    assert warnings(short) == []
