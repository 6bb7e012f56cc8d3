"""A tension that changes by much, which does not act in proportion, and the exponents of laws that go with tension."""

from dataclasses import replace

import numpy as np
import pytest
from small_discovery import surveyed

from belt_sim.campaign import case_of
from belt_sim.discovery.forms import Form, seldom
from belt_sim.discovery.refit import _round, effect_file
from belt_sim.discovery.search import Scored
from belt_sim.discovery.survey import Law, Term
from belt_sim.laws.influence import BoundaryValues, no_bend
from belt_sim.laws.span import response, strip

ENDS = np.array([[1e-3, 2e-4], [3e-4, -1e-4], [-2e-4, 1e-4], [0.0, 1e-4], [1e-4, 0.0]])


@pytest.mark.parametrize("share", [-0.5, -0.1, 0.3, 1.0])
def test_a_found_law_of_tension_bends_the_span_as_another_tension_does(share):
    survey = surveyed("yaw_creep")
    place = next(p for p in survey.places if p.name == "tension")
    cls = effect_file(survey, Scored(Law((Term(place, Form("one")),)), 0.0, 0.0), [share], "A test.").cls
    case = case_of(survey.bench.campaign, survey.bench.campaign.runs[0])
    there = replace(case, settings=replace(case.settings, tension=case.settings.tension * (1.0 + share)))
    effect = cls(size=share)
    boundary = BoundaryValues(travel=5.0, start=0.0, ends=ENDS, direction=1.0)
    bend = effect.bend(no_bend(), boundary, effect.influence(strip(case), case), case)
    true = (response(strip(there)).runup - response(strip(case)).runup) @ ENDS
    assert np.abs(bend.runup - true).max() < 0.02 * np.abs(true).max()


def test_an_exponent_is_rounded_to_what_its_readings_cannot_tell_it_from():
    assert _round(0.7, 0.2, 1.0) == 1.0
    assert _round(2.1, 0.2, 1.0) == 2.0
    assert _round(1.5, 0.1, 1.0) is None


def test_waves_in_time_are_tried_where_speeds_differ():
    states = surveyed("yaw_creep").states
    periods = (1.0,)
    alike = seldom(replace(states, speed=np.full_like(states.speed, 0.5)), "yaw", periods)
    differ = seldom(replace(states, speed=np.linspace(0.5, 1.0, len(states.speed))), "yaw", periods)
    assert not any(f.timed for f in alike)
    assert {f.course for f in differ if f.timed and f.waving} == {"wave", "ring"}
