"""Which laws are put in the place of several effects."""

from dataclasses import replace

import numpy as np
from small_discovery import surveyed

from belt_sim.discovery import rival
from belt_sim.discovery.forms import Form
from belt_sim.discovery.loop import closed
from belt_sim.discovery.rival import at_first_order, in_closed_loop, one_law
from belt_sim.discovery.rounds import Loop
from belt_sim.discovery.search import singles
from belt_sim.discovery.survey import Law, Term

GRIP = -0.6  # of its angle, by which the belt follows it less at both pulleys


def test_a_law_that_changes_what_it_reads_is_found_in_closed_loop_only():
    survey = surveyed("yaw_creep")
    there = next(p for p in survey.places if p.name == "drift_both")
    made = closed(Loop(survey), Law((Term(there, Form("alpha")),)), [GRIP], steps=0)
    noise = np.random.default_rng(0).standard_normal(made.readings.shape)
    whole = noise + made.readings
    survey = replace(survey, ground=replace(survey.ground, residual=whole), kept={})
    read = survey.informed(survey.courses()[0])
    (best, *_), (first, *_) = in_closed_loop(survey, read), at_first_order(read, singles(read))
    assert best.law.says[0][:3] == ("drift_both", "alpha", "x")
    assert abs(best.sizes[0] / GRIP - 1.0) < 0.05
    assert best.gain > first.gain + 100.0


def test_in_the_place_of_several_effects_the_whole_dictionary_is_tried(monkeypatch):
    """Several together imitate what is seldom as well."""
    asked = []
    monkeypatch.setattr(rival, "in_closed_loop", lambda survey, read: asked.append((survey.wide, read.wide)) or [])
    monkeypatch.setattr(rival, "at_first_order", lambda read, ones: asked.append((False, read.wide)) or [])
    for closely in (True, False):
        assert one_law(surveyed("yaw_creep"), 1e9, closely=closely) is None
    assert asked == [(True, True), (False, False)]
