"""Every unmodelled fault does what its first line says: the blind ones, then those that a fitter may know."""

import numpy as np
import pytest
from virtual_bench import ARC, SPAN, YAW, measured, plan_of
from virtual_bench import late_rate as rate

from belt_sim.virtual_rig.hidden import BLIND_FAULTS, DEVELOPMENT_FAULTS, SPAN_FAULTS, UNMODELLED, fault_class
from belt_sim.virtual_rig.march import TrueErrors, observe, true_line
from belt_sim.virtual_rig.plan import TEST_BELT, RunSetting

BELT = 2 * (SPAN + ARC)
#: what a fault may call itself (see ``Fault``)
PLACES = "yaw_tail yaw_head runup_tail runup_head runup_both wrap span span_bending span_torsion span_tension tension"
PLACES += " travel sensor_all sensor_y1"
VARIABLES = "travel time_since_step yaw curvature contact_angle y belt_phase pulley_phase wave speed tension"
FORMS = "constant linear power saturating threshold exponential periodic random"


def faulty(name: str, **parameters):
    return fault_class(name)(**parameters)


def change(name: str, parameters: dict, **run) -> tuple[np.ndarray, np.ndarray]:
    """Travel [m] and what the unmodelled fault adds to points 1-4, shape (4, n) [m]."""
    s, y = measured(faulty(name, **parameters), **run)
    return s, y - measured(**run)[1]


def test_there_are_blind_ones_for_every_place_and_each_has_its_words():
    assert len(BLIND_FAULTS) >= 14
    assert len(SPAN_FAULTS) >= 8
    assert sorted([*BLIND_FAULTS, *DEVELOPMENT_FAULTS, *SPAN_FAULTS]) == sorted(UNMODELLED)
    assert {UNMODELLED[name].place for name in BLIND_FAULTS + SPAN_FAULTS} >= set(PLACES.split())
    for cls in UNMODELLED.values():
        assert cls.place in PLACES.split()
        for variable, form in ((cls.variable, cls.form), *cls.also):
            assert variable in VARIABLES.split()
            assert form in FORMS.split()


@pytest.mark.parametrize(
    ("name", "parameters", "hook", "extra", "period"),
    [
        ("thermostat_head", {"amplitude": 1e-4, "period": 20.0}, "yaw", (), 10.0),
        ("bald_patch", {"kappa": 1e-4}, "turn", (np.zeros((2, 1)), np.zeros((2, 1))), 2 * ARC),
        ("tension_beat", {"share": 0.1}, "span_state", (True, np.zeros((4, 1))), BELT),
    ],
)
def test_what_swings_comes_again(name, parameters, hook, extra, period):
    line, fault = line_from(), faulty(name, **parameters)
    once, again, between = (getattr(fault, hook)(s, line, *extra) for s in (3.0, 3.0 + period, 3.0 + 0.37 * period))
    np.testing.assert_allclose(once, again, atol=1e-12)
    assert np.max(np.abs(once - between)) > 1e-6


def line_from(**setting):
    return true_line(plan_of(RunSetting(**{"tension": 40e6, "yaw": YAW} | setting)), "beam_th2", TrueErrors())


def test_the_fan_strokes_straight_to_and_fro():
    line, fan = line_from(), faulty("thermostat_head", amplitude=1e-4, period=20.0)
    course = [fan.yaw(s, line)[1].item() for s in np.linspace(0.0, 2.5, 11)]
    np.testing.assert_allclose(np.diff(course), 1e-5, rtol=1e-9)  # a quarter period: up to the amplitude
    assert course[-1] == pytest.approx(1e-4)


def test_beats_come_and_go():
    line, gears = line_from(), faulty("beating_head", amplitude=1e-4, wavelength=4.0, ratio=1.25)
    s = np.arange(0.0, 20.0, 0.05)
    course = np.abs([gears.yaw(x, line)[1] for x in s])
    assert course.max() > 1.8e-4
    assert course[np.abs(s - 10.0) < 1.5].max() < 0.8e-4  # half a beat: 4 m against 5 m


def test_a_ringing_yaw_dies_out_in_time():
    run = {"length": 300.0, "spacing": 1.0}
    s, y = change("ringing_yaw", {"share": 0.5, "time": 20.0, "period": 15.0}, **run)
    assert np.abs(y[0, 20:60]).max() > 1e-4
    late = rate(s, y, 100.0)
    assert abs(late) < 1e-3 * abs(rate(*measured(**run), 100.0))


def test_a_progressive_lever_is_a_larger_yaw_by_its_square():
    np.testing.assert_allclose(
        measured(faulty("progressive_yaw", share=0.5), yaw=2e-4)[1], measured(yaw=2.2e-4)[1], atol=1e-12
    )
    mirrored = measured(faulty("progressive_yaw", share=0.5), yaw=-2e-4)[1]
    np.testing.assert_allclose(mirrored, measured(yaw=-2.2e-4)[1], atol=1e-12)


def test_a_square_moment_counts_fourfold_at_twice_the_yaw():
    half, one = (change("square_moment", {"c": 1.0}, yaw=y, length=10.0)[1] for y in (YAW / 2, YAW))
    np.testing.assert_allclose(one, 4 * half, atol=1e-3 * np.abs(one).max())
    assert one[0, 4] > 0.0  # as a soft cover: a faster start


def test_grip_is_whole_for_small_angles_and_bounded_for_large_ones():
    limited = faulty("grip_limit", inverse_angle=1e4)
    angles = np.array([[1e-7], [1e-3]])
    climbs = angles * limited.slide(0.0, None, angles)
    np.testing.assert_allclose(climbs[:, 0], [1e-7, 1e-4], rtol=1e-5)


def test_the_power_of_following_is_alike_at_a_tenth_of_a_milliradian():
    angles = np.array([[1e-4, 4e-4], [1e-4, 4e-4]])
    factor = faulty("follow_power", p=0.5).slide(0.0, None, angles)
    np.testing.assert_allclose(factor, [[1.0, 2.0], [1.0, 1.0]], rtol=3e-3)


def test_a_rut_is_felt_one_revolution_later_and_at_the_tail():
    s, y = change("rut", {"c": 1e-2}, spacing=0.25)
    assert np.all(y[0, s < BELT] == 0.0)
    assert np.abs(y[0, s > BELT + 5.0]).min() > 1e-6
    expected = -faulty("rut", c=1e-2).c * measured()[1][0]  # a turn towards the side where it lay, once later
    slope = np.gradient(np.gradient(y[0], s), s)
    early = (s > BELT + 1.0) & (s < BELT + 3.0)
    assert np.all(np.sign(slope[early]) == np.sign(-expected[np.searchsorted(s, s[early] - BELT)]))


def test_a_beating_tension_swings_the_response_and_not_its_mean():
    _, y = change("tension_beat", {"share": 0.1}, tension=10e6, length=100.0)
    up, down = (measured(tension=t)[1][0, -1] for t in (11e6, 9e6))
    assert 0.01 < np.abs(y[0]).max() / abs(up - down) < 2.0


def test_after_the_ratchet_slipped_the_belt_runs_as_one_of_less_tension():
    run = {"length": 450.0, "spacing": 1.0}
    slipped = rate(*measured(faulty("ratchet_slip", share=0.3, at=10.0), **run), 100.0)
    assert slipped == pytest.approx(rate(*measured(tension=28e6, **run), 100.0), rel=2e-3)
    s, y = change("ratchet_slip", {"share": 0.3, "at": 10.0})
    assert np.abs(y[:, s <= 10.0]).max() < 1e-9  # the parabola through three tensions


def test_the_bow_is_a_yaw_by_the_square_of_the_speed():
    fast = measured(faulty("speed_bow", c=1e-4), speed=2.0)[1]
    np.testing.assert_allclose(fast, measured(yaw=YAW + 4e-4)[1], atol=1e-12)


def test_the_twist_is_a_head_yaw_by_the_square_of_the_tension():
    twisted = measured(faulty("frame_twist", c=1e-5), tension=20e6, yaw=0.0)[1]
    np.testing.assert_allclose(twisted, measured(tension=20e6, yaw=0.0, yaw_head=4e-5)[1], atol=1e-12)


def test_a_rest_that_never_slides_is_a_spring_and_a_weak_one_a_force():
    spring, stuck = (
        change("sticky_rest", {"force": force, "stiffness": k})[1] for force, k in ((1e6, 1e-3), (1e6, 2e-3))
    )
    np.testing.assert_allclose(stuck, 2 * spring, atol=1e-3 * np.abs(stuck).max())
    weak, twice = (change("sticky_rest", {"force": f, "stiffness": 1e7})[1] for f in (1e-4, 2e-4))
    np.testing.assert_allclose(twice, 2 * weak, atol=0.02 * np.abs(twice).max())
    assert spring[0, -1] < 0 > weak[0, -1]  # it holds the belt back


def test_a_bent_idler_pushes_with_its_wavelength():
    _, y = measured(faulty("bent_idler", force=5.0, wavelength=3.2), yaw=0.0, length=64.0)
    assert np.argmax(np.abs(np.fft.rfft(np.diff(y[2])))[4:]) + 4 == 20


@pytest.mark.parametrize(("tail", "head"), [("point_1", "point_2"), ("point_3", "point_4")])
def test_creep_moves_the_belt_on_the_wraps(tail, head):
    """What leaves differs from what ran up one wrap before by the share of the contact angle times the wrap."""
    plan = plan_of(RunSetting(tension=40e6, yaw=YAW), spacing=ARC / 4)
    y = dict(
        zip(
            plan.signals.values(),
            observe(plan, true_line(plan, "beam_th2", TrueErrors()), [faulty("wrap_creep", share=0.5)]),
            strict=True,
        )
    )
    up, off = y[tail][:, 0], y[head][:, 0]
    climb = np.gradient(up, plan.travel)  # dy/ds = -alpha
    np.testing.assert_allclose(off[8:] - up[4:-4], 0.5 * ARC * climb[4:-4], atol=1e-6)


def test_the_tail_wrap_slides_only_beyond_its_limit():
    assert np.all(change("wrap_slide", {"length": 1.0, "limit": 1.0})[1] == 0.0)
    assert np.abs(change("wrap_slide", {"length": 1.0, "limit": 1e-4})[1]).max() > 1e-5


def test_shoulders_hold_by_no_more_than_their_size():
    turn = faulty("soft_shoulder", kappa=1e-4, width=1e-3).turn(0.0, None, np.array([[1.0], [1.0]]), None)
    np.testing.assert_allclose(turn, [[0.0], [-1e-4]])
    near = faulty("soft_shoulder", kappa=1e-4, width=1e-3).turn(0.0, None, np.array([[0.0], [1e-6]]), None)
    np.testing.assert_allclose(near, [[0.0], [-1e-7]], rtol=1e-4)


def test_grease_goes_round_with_the_belt():
    line, grease = line_from(), faulty("greasy_stretch", share=0.5, at=0.0, stretch=0.2)
    tail = grease.slide(0.0, line, None)[0]
    head = grease.slide(SPAN + ARC, line, None)[1]
    np.testing.assert_allclose([tail, head], 0.5)
    assert np.all(grease.slide(0.5 * BELT, line, None)[0] == 1.0)


def test_the_gauge_sticks_until_it_is_half_behind():
    _, clean = measured()
    _, y = measured(faulty("sticky_gauge", half=2e-4))
    assert np.abs(y[0] - clean[0]).max() == pytest.approx(2e-4)
    assert np.all(y[0, clean[0] < 2e-4] == 0.0)
    np.testing.assert_array_equal(y[1:], clean[1:])


def test_a_short_range_ends_at_one_over_c():
    _, clean = measured(length=200.0)
    _, y = measured(faulty("short_range", c=100.0), length=200.0)
    np.testing.assert_allclose(y, np.tanh(100.0 * clean) / 100.0, atol=1e-15)


def test_the_wheel_shows_more_and_more():
    s, y = measured(faulty("wearing_wheel", c=1e-3), length=40.0, spacing=0.5)
    true = np.linspace(0.0, s[-1], 4001)
    long, clean = measured(length=40.0, spacing=0.01)
    shown = long + 1e-3 * long**2
    np.testing.assert_allclose(y[0], np.interp(s, shown, clean[0]), atol=1e-8)
    assert true[-1] == s[-1]


def test_the_rubber_turns_the_belt_only_for_a_while_and_with_the_step():
    s, y = change("lagging_set", {"kappa": 1e-4, "time": 5.0}, length=400.0, spacing=1.0)
    assert abs(rate(s, y, 100.0)) < 2e-5  # [mm/m]
    assert np.sign(y[0, 10]) == np.sign(measured()[1][0, 10])
    other = change("lagging_set", {"kappa": 1e-4, "time": 5.0}, yaw=-YAW, length=400.0, spacing=1.0)[1]
    np.testing.assert_allclose(other, -y, atol=1e-12)


def test_after_a_loss_of_adhesion_the_belt_climbs_faster():
    s, more = change("adhesion_loss", {"share": 0.2, "after": 20.0})
    assert np.all(more[:, s <= 20.0] == 0.0)
    assert np.all(more[0, s >= 20.5] > 0.0)


def test_quadratic_contact_drives_to_one_side_whatever_the_yaw():
    (_, plus), (_, minus) = (change("quadratic_contact", {"c": 1e-3}, yaw=yaw) for yaw in (YAW, -YAW))
    assert plus[0, -1] > 1e-6  # [m], as a taper does
    np.testing.assert_allclose(minus, plus, atol=2e-2 * plus.max())


def test_creep_ends_at_a_larger_yaw_and_takes_time_not_travel():
    run = {"length": 350.0, "spacing": 1.0}
    s, y = measured(fault_class("yaw_creep")(share=0.2), **run)
    assert rate(s, y, 100.0) == pytest.approx(1.2 * rate(*measured(**run), 100.0), rel=1e-2)
    slow = change("yaw_creep", {"share": 0.2, "time": 50.0})[1]
    fast = change("yaw_creep", {"share": 0.2, "time": 25.0}, speed=1.0)[1]
    np.testing.assert_allclose(fast, slow, atol=1e-12)
    assert np.abs(change("yaw_creep", {"share": 0.2}, speed=1e4)[1]).max() < 1e-6


def test_the_cubic_sensor_stands_at_point_1():
    _, clean = measured()
    _, more = change("sensor_cubic", {"c": 1000.0})
    np.testing.assert_allclose(more[0], 1000.0 * clean[0] ** 3, atol=1e-15)
    assert np.all(more[1:] == 0.0)


def test_the_strange_wave_has_its_own_wavelength():
    _, y = measured(fault_class("strange_wave")(amplitude=1e-4, wavelength=6.4), yaw=0.0, length=64.0, spacing=0.25)
    assert np.argmax(np.abs(np.fft.rfft(np.diff(y[0])))[4:]) + 4 == 10


def test_tension_decays_by_e_over_its_length():
    """So slowly that the belt settles at every tension: its rate is that of a belt at what is left."""
    run = {"length": 350.0, "spacing": 1.0}
    decaying = rate(*measured(fault_class("tension_decay")(share=0.6, length=1000.0), **run), 100.0)
    left = 1 - 0.6 * (1 - np.exp(-0.3))  # in the middle of the last 100 m
    settled = rate(*measured(tension=40e6 * left, **run), 100.0)
    assert settled < 0.97 * rate(*measured(**run), 100.0)
    assert decaying == pytest.approx(settled, rel=5e-3)


def test_the_stand_moves_with_the_root_of_time():
    s, more = change("warming_stand", {"c": 3e-5}, yaw_at=10.0)
    expected = 3e-5 * np.sqrt(np.maximum(s - 10.0, 0.0) / 0.5)
    np.testing.assert_allclose(more, np.broadcast_to(expected, more.shape), atol=1e-15)


@pytest.mark.parametrize("name", ["walking_angle", "wind_steps"])
def test_chance_is_another_in_every_run_and_the_same_for_a_seed(name):
    cls = fault_class(name)
    size = next(iter(cls.sizes))
    plan = plan_of(RunSetting(tension=40e6, yaw=0.0), RunSetting(tension=40e6, yaw=0.0), length=20.0, spacing=1.0)
    y, again, other, double = (
        observe(
            plan, true_line(plan, "beam_th2", TrueErrors()), [cls(**{size: k * cls.sizes[size].typical, "seed": seed})]
        )
        for k, seed in ((1, 5), (1, 5), (1, 6), (2, 5))
    )
    assert np.all(y == again)
    assert np.all(y[0, 2:] != other[0, 2:])
    assert np.abs(y[:, :, 0] - y[:, :, 1]).max() > 0.3 * np.abs(y).max()
    np.testing.assert_allclose(double, 2 * y, atol=1e-12)


def test_the_belt_that_sticks_runs_straight_for_a_while():
    s, y = measured(fault_class("mid_stick")(share=1.0, begin=20.0, length=6.0))
    held = (s >= 21.0) & (s <= 26.0)
    assert np.ptp(y[0, held]) < 3e-8  # [m], in a step of the march that began before
    assert np.ptp(measured()[1][0, held]) > 1e-4


def test_wind_bends_both_run_ups_as_on_a_clamped_span():
    """In the first 0.5 m the run-up turns by k s, k = p L^2/(12 EI), and moves by -k s^2/2."""
    pressure, seed = 0.5, 3
    gust = np.random.default_rng(seed).standard_normal()
    s, y = measured(fault_class("wind_steps")(pressure=pressure, seed=seed), yaw=0.0, length=0.5, spacing=0.05)
    belt = TEST_BELT
    bending = belt.youngs_modulus.value * belt.width.value**3 * belt.thickness.value / 12
    expected = pressure * gust * SPAN**2 / (12 * bending) * s**2 / 2
    np.testing.assert_allclose(y[[0, 2]], np.stack([expected, expected]), rtol=0.15, atol=1e-9)


def test_in_the_dead_zone_the_belt_does_not_turn():
    _, y = measured(fault_class("dead_zone")(kappa_d=5e-4))
    np.testing.assert_allclose(y, 0.0, atol=1e-15)
