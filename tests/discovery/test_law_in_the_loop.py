"""The closed loop of impulse responses against the march with the written effect in it, and what it protects from."""

import numpy as np
import pytest
from small_discovery import marched, surveyed

from belt_sim.discovery.closed_loop import fit_closed_loop, solve_loop, states_with
from belt_sim.effects.law import Form, Law, Term, stop

#: a crown that steers the belt [1/m^2], and a belt that slides by much of its angle: what they make is not what the
#: base model's states would
STEERING = {
    "turn_tail": (Form("y"), 0.03),
    "shift_both": (Form("alpha"), 1.0),
}


#: laws against which whole rounds swing ever further, though the belt stays where it was
STRONG = {"drift_both": (Form("alpha"), -3.0)}


def law_of(place: str, form: Form) -> Law:
    (where,) = (p for p in surveyed("yaw_creep").places if p.name == place)
    return Law((Term(where, form),))


@pytest.mark.parametrize("place", STEERING)
def test_a_law_that_steers_itself_does_what_the_march_does(place):
    form, size = STEERING[place]
    data, law = surveyed("yaw_creep"), law_of(place, form)
    made, whole = fit_closed_loop(data, law, [size], steps=0), marched(data, law, [size])
    open_loop = size * data.columns(law)[0]
    assert np.linalg.norm(made.readings - whole) < 0.03 * np.linalg.norm(whole)
    assert np.linalg.norm(open_loop - whole) > 0.1 * np.linalg.norm(whole)


@pytest.mark.parametrize("place", STRONG)
def test_a_law_that_steers_against_what_it_reads_by_much_is_followed(place):
    form, size = STRONG[place]
    data, law = surveyed("yaw_creep"), law_of(place, form)
    made, whole = fit_closed_loop(data, law, [size], steps=0), marched(data, law, [size])
    assert made is not None
    assert made.sizes[0] == size
    assert np.linalg.norm(made.readings - whole) < 0.05 * np.linalg.norm(whole)


def test_a_belt_that_runs_away_is_brought_back_or_given_up():
    law = law_of("turn_tail", Form("y"))
    made = fit_closed_loop(surveyed("yaw_creep"), law, [-1e3])
    assert made is None or abs(made.sizes[0]) < 1e3


def test_the_fit_in_closed_loop_finds_what_was_made_with_it():
    data, law = surveyed("yaw_creep"), law_of("yaw_tail", Form("beta", course="rise", at=12.0))
    _, sizes = data.projector.fit_sizes(data.columns(law))
    made = fit_closed_loop(data, law, sizes)
    assert made.gain > 0.9 * 25.0**2
    states = states_with(data, made)
    assert np.abs(states.y - data.states.y).max() > 1e-5
    assert states.beta is data.states.beta


def test_what_sticks_follows_and_slides():
    path = np.array([0.0, 1.0, 3.0, 2.5, 0.0])
    assert stop(path, 1.0) == pytest.approx([0.0, 1.0, 1.0, 0.5, -1.0])


def test_a_pull_acts_where_the_belt_is_bent_as_it_is_then():
    """Most of what a pull does goes through where the belt runs then."""
    data, law, size = surveyed("yaw_creep"), law_of("tension", Form("none")), -0.05
    whole = marched(data, law, [size])
    made = solve_loop(data, law, np.array([[size]]))
    off = [np.linalg.norm(readings - whole) for readings in (made[0][0], size * data.columns(law)[0])]
    assert off[0] < 0.4 * off[1]
    assert off[0] < 0.06 * np.linalg.norm(whole)
