"""Forms that the readings cannot tell from plainer ones."""

from dataclasses import replace

import numpy as np
from small_discovery import surveyed

from belt_sim.discovery.search_data import form_inputs, rare_forms, simpler_form, usual_forms
from belt_sim.effects.law import Form

YAW = 1e-3  # rad


def test_powers_of_the_yaw_are_tried_where_its_sizes_differ():
    """Where settings put one stated yaw run by run there is one size of it: its cube is no law of its own."""
    states = surveyed("yaw_creep").states
    on = states.yaw_set * np.where(np.arange(len(states.beta)) % 2, 1.0, -1.0)[:, None]

    def powers(sizes):
        return {f.shape for f in usual_forms(replace(states, beta=on * sizes[:, None]), "yaw") if f.variable == "beta"}

    count = len(states.beta)
    assert powers(YAW * (1.0 + 1e-3 * np.arange(count) / count)) == {"linear"}
    assert "cube" in powers(YAW * np.linspace(0.5, 1.0, count))


def test_what_is_zero_throughout_has_no_knee():
    """As the curvature of a rope: its shares of nothing would be 0/0."""
    states = surveyed("yaw_creep").states
    flat = replace(states, kappa=0.0 * states.kappa)
    with np.errstate(all="raise"):
        assert np.isfinite(form_inputs(flat, usual_forms(flat, "turn"), 0, None)).all()


def test_what_a_yaw_leaves_behind_may_be_as_much_whatever_its_size():
    states = surveyed("yaw_creep").states
    sign = np.where(np.arange(len(states.beta)) % 2, 1.0, -1.0)[:, None]

    def left(sizes):
        moved = replace(states, beta=states.yaw_set * sign * sizes[:, None])
        forms = [f for f in rare_forms(moved, "turn", ()) if f.variable == "beta" and f.shape == "saturation"]
        return form_inputs(moved, [f for f in forms if f.course == "decay"], 0, None).swapaxes(0, 1)

    assert not len(left(np.full(len(sign), YAW)))
    (row, *_) = left(YAW * np.where(np.arange(len(sign)) % 3, 0.5, 1.0))
    largest = np.abs(row).max(axis=1)
    assert largest.min() > 0.9 * largest.max()


def test_what_fades_over_many_records_stays():
    form = Form("beta", course="decay", at=30.0)
    assert simpler_form(form, 10.0, 0.1) == Form("beta")
    assert simpler_form(form, 20.0, 0.1) is form


def test_no_wave_is_searched_that_the_readings_cannot_tell_from_its_aliases():
    states = surveyed("yaw_creep").states
    gap = 0.1 * float(states.s[-1])
    coarse = replace(states, gap=gap)

    def shortest(some):
        forms = [*usual_forms(some, "yaw"), *rare_forms(some, "yaw", (1.5 * gap, 3.0 * gap))]
        return min(f.at for f in forms if f.is_wave and not f.timed)

    assert shortest(states) < gap
    assert shortest(coarse) >= 2.0 * gap
