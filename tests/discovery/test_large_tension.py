"""A tension that changes by much, which does not act in proportion, and the exponents of laws that go with tension."""

from dataclasses import replace

import numpy as np
import pytest
from paper_cases import response
from small_discovery import effect_of, surveyed

from belt_sim.campaign import case_of
from belt_sim.discovery.search_data import rare_forms
from belt_sim.effects.law import Form, Law, Term
from belt_sim.jax_setup import LEAST_EFFORT, jit_float64
from belt_sim.line.span import Bend, BoundaryValues, strip

FILE = 0.02  # of what a large change adds: the file has it as a polynomial of its logarithm
ENDS = np.array([[1e-3, 2e-4], [3e-4, -1e-4], [-2e-4, 1e-4], [0.0, 1e-4], [1e-4, 0.0]])


@pytest.mark.parametrize("share", [-0.5, 1.0])
def test_a_found_law_of_tension_bends_the_span_as_another_tension_does(share):
    data = surveyed("yaw_creep")
    case = case_of(data.bench.campaign, data.bench.campaign.runs[0])
    there = replace(case, settings=replace(case.settings, tension=case.settings.tension * (1.0 + share)))
    true = (response(strip(there)).runup - response(strip(case)).runup) @ ENDS
    assert np.abs(bent_by("tension", share, case) - true).max() < FILE * np.abs(true).max()


@pytest.mark.parametrize("share", [-0.8, 1.0])
@pytest.mark.parametrize("what", ["bending", "torsion"])
def test_a_found_law_of_a_stiffness_bends_one_span_as_another_stiffness_does(what, share):
    case = case_of(surveyed("yaw_creep").bench.campaign, surveyed("yaw_creep").bench.campaign.runs[0])
    span = strip(case)
    other = replace(span, **{what: getattr(span, what) * (1.0 + share)})
    true = (response(other).runup - response(span).runup) @ ENDS
    found = bent_by(f"{what}_lower", share, case)  # up the head pulley: the belt travels forwards
    assert found[0] == 0.0
    assert abs(found[1] - true[1]) < FILE * abs(true[1])


def bent_by(name, share, case):
    """Curvature (2,) that the file of a law of a constant relative change adds at the run-ups."""
    data = surveyed("yaw_creep")
    place = next(p for p in data.places if p.name == name)
    cls = effect_of(data, Law((Term(place, Form("none")),)), [share])
    effect = cls(size=share)
    boundary = BoundaryValues(travel=5.0, start=0.0, ends=ENDS, direction=1.0)

    def added(case):
        bend = effect.bend(Bend(), boundary, effect.influence(strip(case), case), case)
        return bend.runup + bend.natural_runup

    return jit_float64(added, effort=LEAST_EFFORT)(case)


def test_waves_in_time_are_tried_where_speeds_differ():
    states = surveyed("yaw_creep").states
    periods = (1.0,)
    alike = rare_forms(replace(states, speed=np.full_like(states.speed, 0.5)), "yaw", periods)
    differ = rare_forms(replace(states, speed=np.linspace(0.5, 1.0, len(states.speed))), "yaw", periods)
    assert not any(f.timed for f in alike)
    assert {f.course for f in differ if f.timed and f.is_wave} == {"wave", "decaying_wave"}
