"""What the sliders show is what a simulation says, and moving them compiles nothing."""

from urllib.parse import parse_qsl

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the app needs NiceGUI: pip install 'belt-sim[app]'")

from belt_sim.api.simulate import model_named, simulate
from belt_sim.app.simulate_page import View, reach
from belt_sim.app.widgets import effect_words
from belt_sim.effects.base import library
from belt_sim.line import march

TAPER = {"taper": {"kappa_t": 2e-5}}


def simulated(model="strip", **changes):
    view = View(effects=changes.pop("effects", TAPER))
    view.values |= {"travel": 40.0} | changes
    acting = [library()[i](**numbers) for i, numbers in view.effects.items()]
    return simulate(view.case(), model=model, effects=acting, travel=view.values["travel"])


@pytest.mark.parametrize(
    ("word", "effect"),
    [
        ("splice", "weld"),
        ("gap", "edge_guide"),
        ("warped", "camber"),
        ("wind", "machine_tilt"),
        ("worn", "crown"),
        ("schief", "cant"),
        ("schief", "yaw_offset_tail"),
        ("konisch", "taper"),
    ],
)
def test_effects_are_found_by_what_people_call_them(word, effect):
    assert word in effect_words()[effect]


def test_moving_a_slider_compiles_nothing(monkeypatch):
    simulated()
    monkeypatch.setattr(march, "_steps_traced", None)  # nothing can be traced anew
    first = simulated(tension=11.0, yaw=0.1, travel=39.0)
    second = simulated(tension=30.0, yaw=0.1, effects={"taper": {"kappa_t": -1e-5}})
    assert not np.array_equal(first.curves.y[:, 100], second.curves.y[:, 100])


def test_a_slider_of_an_effect_may_stand_at_nothing():
    np.testing.assert_array_equal(
        simulated(effects={"taper": {"kappa_t": 0.0}}).curves.y, simulated(effects={}).curves.y
    )


def test_slack_edges_and_limits_are_told():
    slack = simulated(model="beam_th2", tension=3.0, yaw=0.2)
    said = " ".join(slack.lines())
    assert "edge goes slack" in said
    assert "use strip_lift_off" in said
    assert "use strip (" not in said
    calm = simulated(model="strip_lift_off", tension=2.0, yaw=0.2, effects={})
    assert calm.slackest_edge > 0.0  # the sag takes up what the yaw stretches
    assert "edge_stretch" not in {limit.id for limit in calm.beyond}


def test_every_number_of_every_effect_has_a_slider_that_reaches_both_ways():
    for cls in (cls for cls in library().values() if model_named("strip").refusal(cls) is None):
        for p in cls.parameters.values():
            low, high, start = reach(p)
            assert low < high
            assert low <= start <= high


def test_nothing_is_said_of_what_happens_beyond_the_travel_that_is_shown():
    """After 146 m the belt lies half beside a face of its width: said of 200 m, not of 60."""
    asked = {"tension": 80.0, "yaw": -0.15, "effects": {"taper": {"kappa_t": 3e-5, "kappa_t_head": 2e-5}}}
    long, short = (simulated(**asked, travel=travel) for travel in (200.0, 60.0))
    (beside,) = (limit for limit in long.beyond if "from 146 m" in limit.words)
    assert any(beside.words in line for line in long.lines())
    assert beside.id not in {limit.id for limit in short.beyond}


@pytest.mark.parametrize(
    ("asked", "told", "kept"),
    [
        ({"tension": "-5"}, "tension=-5: must be a number from 2 to 80; it is left out", {"tension": 10.0}),
        ({"yaw": "99"}, "yaw=99: must be a number from -0.2 to 0.2; it is left out", {"yaw": -0.042}),
        ({"tension": "abc"}, "tension=abc: must be a number from 2 to 80; it is left out", {"tension": 10.0}),
        ({"tension": "nan"}, "it is left out", {"tension": 10.0}),
        ({"taper.kappa_t": "1"}, "taper.kappa_t=1: must be a number from", {}),
        ({"model": "strp"}, "model=strp: must be one of", {"model": "by_tension"}),
        ({"taper": "1"}, "taper=1: is no setting of this page; give such as", {}),
        ({"tapr.kappa_t": "1"}, "is no setting of this page", {}),
        ({"length": "1"}, "is no setting of this page", {}),
        ({"width": "inf"}, "width=inf: must be a number from 5 to 3000; it is left out", {"width": 200.0}),
    ],
)
def test_an_address_that_is_wrong_is_told(asked, told, kept):
    view = View.of_address(asked)
    (line,) = view.notes
    assert told in line
    assert {name: view.values[name] for name in kept} == kept
    assert not view.effects


def test_an_address_of_the_page_is_read_as_it_was_written():
    view = View.of_address({"tension": "12", "model": "strip", "taper.kappa_t": "2e-05", "width": "300"})
    assert not view.notes
    assert (view.values["tension"], view.values["model"], view.values["width"]) == (12.0, "strip", 300.0)
    assert view.effects["taper"]["kappa_t"] == 2e-5
    again = View.of_address(dict(parse_qsl(view.address.partition("?")[2])))
    assert (again.values, again.effects, again.notes) == (view.values, view.effects, [])
