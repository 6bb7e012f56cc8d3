"""Schedules of a yaw: what is written is what the pulley does, whatever the steps and ramps."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from belt_sim.case import Schedule
from belt_sim.errors import InputError
from belt_sim.line.runup import angle_at, mean_angle
from belt_sim.results.simulation import Simulation, summary_json
from belt_sim.settings import BOUNDS, make_case, schedule_from
from belt_sim.units import DEGREE

ROUNDING = 1e-12  # [rad] sums of a dozen numbers below 0.1
FINE = 20_000  # parts of an integral by the midpoint rule
MAX_YAW = BOUNDS["yaw"].high  # [degrees]
INTEGRATED = 2 * MAX_YAW * DEGREE / FINE * 12  # [rad]: each step may fall into a part


@st.composite
def entries(draw):
    """A list of {at, over, yaw} as ``yaw=`` takes it: one after another from travel 0 on."""
    at, listed = 0.0, []
    for _ in range(draw(st.integers(1, 4))):
        at += draw(st.floats(0.0, 20.0))
        over = draw(st.just(0.0) | st.floats(0.01, 10.0))
        if over == 0.0 and listed and listed[-1]["at"] == at:  # two steps at one place are refused
            at += 0.01
        listed.append({"at": at, "over": over, "yaw": draw(st.floats(-MAX_YAW, MAX_YAW))})
        at += over
    return listed


def angles(schedule: Schedule, travels) -> np.ndarray:
    return np.array([float(angle_at(schedule, s)) for s in travels])


@settings(max_examples=40, deadline=None)
@given(listed=entries())
def test_the_pulley_stands_where_the_list_says(listed):
    schedule = schedule_from(listed, "yaw")
    ends = [entry["at"] + entry["over"] for entry in listed]
    last = {end: entry["yaw"] * DEGREE for end, entry in zip(ends, listed, strict=True)}  # of several at one travel
    starts = [entry["at"] for entry in listed]
    for k, end in enumerate(ends):
        if starts[k + 1 : k + 2] != [end]:  # a step that begins there counts already
            assert angles(schedule, [end])[0] == pytest.approx(last[end], abs=ROUNDING)
    assert float(schedule.last()) == pytest.approx(listed[-1]["yaw"] * DEGREE, abs=ROUNDING)
    assert angles(schedule, [ends[-1] + 1.0])[0] == pytest.approx(float(schedule.last()), abs=ROUNDING)


@settings(max_examples=40, deadline=None)
@given(listed=entries(), travel=st.floats(0.0, 150.0))
def test_a_yaw_never_leaves_the_angles_between_which_it_moves(listed, travel):
    reached = [0.0, *(entry["yaw"] * DEGREE for entry in listed)]
    angle = angles(schedule_from(listed, "yaw"), [travel])[0]
    assert min(reached) - ROUNDING <= angle <= max(reached) + ROUNDING


@settings(max_examples=40, deadline=None)
@given(one=entries(), other=entries(), travel=st.floats(0.0, 150.0))
def test_one_schedule_after_another_is_their_sum(one, other, travel):
    a, b = schedule_from(one, "yaw"), schedule_from(other, "yaw")
    assert angles(a.then(b), [travel])[0] == pytest.approx(
        angles(a, [travel])[0] + angles(b, [travel])[0], abs=ROUNDING
    )


@settings(max_examples=20, deadline=None)
@given(listed=entries(), start=st.floats(0.0, 50.0), length=st.floats(0.05, 20.0), share=st.floats(0.1, 0.9))
def test_the_mean_over_a_step_of_travel_is_the_integral(listed, start, length, share):
    schedule, end = schedule_from(listed, "yaw"), start + length
    middles = start + length * (np.arange(FINE) + 0.5) / FINE
    at, over, change = (np.asarray(x)[:, None] for x in (schedule.at, schedule.over, schedule.change))
    risen = np.where(over > 0, np.clip((middles - at) / np.where(over > 0, over, 1.0), 0.0, 1.0), middles >= at)
    assert float(mean_angle(schedule, start, end)) == pytest.approx((change * risen).sum(axis=0).mean(), abs=INTEGRATED)
    middle = start + share * length
    parts = share * mean_angle(schedule, start, middle) + (1.0 - share) * mean_angle(schedule, middle, end)
    assert float(mean_angle(schedule, start, end)) == pytest.approx(float(parts), abs=1e-9)  # differences of areas


@settings(max_examples=40, deadline=None)
@given(listed=entries())
def test_a_schedule_that_is_written_into_a_summary_is_read_back(listed):
    schedule = schedule_from(listed, "yaw")
    case = make_case(yaw=schedule, travel=1e4)
    found = Simulation(case=case, model="ritzinger", effects=(), travel=1e4, curves=None, steady_rate=0.0)
    again = schedule_from(json.loads(json.dumps(summary_json(found, {})["yaw_deg"])), "yaw")
    for name in ("at", "over", "change"):
        assert np.allclose(getattr(again, name), getattr(schedule, name), rtol=1e-9, atol=1e-11)  # 12 digits are kept


@settings(max_examples=20, deadline=None)
@given(listed=entries(), early=st.floats(0.001, 5.0))
def test_entries_that_overlap_are_refused(listed, early):
    end = listed[-1]["at"] + listed[-1]["over"]
    if end > early:
        with pytest.raises(InputError, match="follow one another"):
            schedule_from([*listed, {"at": end - early, "yaw": 0.0}], "yaw")


def test_the_adjustment_of_the_axis_is_a_yaw_by_equation_1():
    """tan(yaw) = 2 dx / d, here of 45 urad and with the sign of dx, alone and in a list."""
    adjusted = {"dx": -18e-6, "d": 0.8}
    assert float(schedule_from(adjusted, "yaw").last()) == pytest.approx(np.arctan(-45e-6), rel=ROUNDING)
    listed = schedule_from([{"at": 0, "yaw": 0.01}, {"at": 5, "over": 2, "yaw": adjusted}], "yaw")
    assert float(listed.last()) == pytest.approx(np.arctan(-45e-6), rel=1e-9)


@pytest.mark.parametrize(
    "wrong", [{"dx": 1e-4}, {"dx": 1e-4, "d": 0.0}, {"dx": 1e-4, "d": 0.8, "yaw": 0.01}, {"dx": 0.1, "d": 0.8}]
)
def test_an_adjustment_that_is_none_is_refused_by_its_name(wrong):
    """Half of it, an axis without length, an angle as well, 14 degrees."""
    with pytest.raises(InputError, match=r"^yaw"):
        schedule_from(wrong, "yaw")
