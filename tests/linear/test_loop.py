"""A controller on the plant: margins, what drive and sensor add, and what is refused."""

import control
import numpy as np
import pytest

import belt_sim as bs
from belt_sim.linear.loop import margins_of

SPEED, SAMPLE = 0.5, 0.02  # [m/s], [s]
HELD = 2e-2  # of the largest y: yaw is held over a sample, and the reference solution is continuous
READ = 1e-3  # margins of a curve that is interpolated between 4,000 frequencies


@pytest.fixture(scope="module")
def plant():
    return bs.linearise(model="strip", rig="test_rig", tension=12, speed=SPEED)


def lead():
    s = control.tf("s")
    return 0.2 * (1 + 10 * s) / (1 + s)


def test_without_faults_it_is_the_textbook_loop(plant):
    made = bs.close_loop(plant, lead(), askew=1e-4, sample=SAMPLE, travel=40.0)
    belt = plant.to_control(order=6)[0, 0]
    _, y = control.step_response(control.feedback(belt, lead()), made.time)
    assert np.abs(made.y[0] - 1e-4 * y).max() < HELD * np.abs(1e-4 * y).max()
    np.testing.assert_allclose(made.yaw - made.command, 1e-4)


@pytest.mark.parametrize(("gain", "poles"), [(4.0, [-1.0, -2.0]), (30.0, [-1.0, -10.0]), (0.5, [-0.2, -0.3])])
def test_margins_are_those_of_python_control(gain, poles):
    """An integrator and two lags: both margins are finite."""
    system = control.zpk([], [0.0, *poles], gain * np.prod(poles))
    w = np.geomspace(1e-3, 1e3, 4000)
    gain_margin, phase_margin, _, crossover = control.margin(system)
    found = margins_of(w, system(1j * w))
    assert found.gain_margin == pytest.approx(gain_margin if gain_margin > 1 else np.inf, rel=READ)
    assert np.rad2deg(found.phase_margin) == pytest.approx(phase_margin, abs=0.1)
    assert found.crossover == pytest.approx(crossover, rel=READ)
    if phase_margin > 0:
        assert found.delay_margin == pytest.approx(np.deg2rad(phase_margin) / crossover, rel=1e-2)


def test_a_delay_beyond_the_margin_destabilises(plant):
    margin = bs.close_loop(plant, lead(), travel=10.0).margins.delay_margin
    inside, beyond = (
        bs.close_loop(plant, lead(), y_start=1e-3, delay=share * margin, travel=400.0) for share in (0.5, 1.2)
    )
    late = inside.time > 0.7 * inside.time[-1]
    assert np.abs(inside.y[0, late]).max() < 2e-4
    assert np.abs(beyond.y[0, late]).max() > 2e-3


def test_limits_backlash_and_noise(plant):
    limited = bs.close_loop(plant, lead(), y_start=5e-3, limits=1e-3, travel=20.0)
    assert np.abs(limited.yaw).max() == pytest.approx(1e-3)
    assert np.abs(limited.command).max() > 5e-3
    loose = bs.close_loop(plant, lead(), y_start=5e-3, backlash=1e-3, travel=20.0)
    assert np.abs(loose.yaw - loose.command).max() == pytest.approx(5e-4)
    turned = np.flatnonzero(np.diff(loose.yaw) == 0.0)
    assert len(turned) > 10  # the pulley stands while the drive crosses its play
    noisy = bs.close_loop(plant, lambda time, error: 0.0, noise=1e-4, travel=200.0, seed=3)
    assert np.std(noisy.measured) == pytest.approx(1e-4, rel=0.05)
    assert np.abs(noisy.y).max() == 0.0


def test_a_function_steers_at_another_point(plant):
    made = bs.close_loop(plant, lambda time, error: 0.05 * error, point=4, reference=1e-3, travel=600.0)
    assert made.margins is None
    assert made.y[3, -1] == pytest.approx(1e-3, rel=0.05)


def test_what_is_refused(plant):
    with pytest.raises(bs.InputError, match="diverges"):
        bs.close_loop(plant, lambda time, error: -5.0 * error, y_start=1e-3, travel=400.0)
    for wrong in (
        {"point": 5},
        {"noise": -1.0},
        {"limits": 0.0},
        {"sample": 0.0},
        {"delay": np.nan},
        {"y_start": 5.0},
        {"reference": -0.3},
        {"backlash": 1.0},
        {"askew": 0.1},
        {"limits": 2.0},
    ):
        with pytest.raises(bs.InputError, match=next(iter(wrong))):
            bs.close_loop(plant, lead(), **wrong)
    with pytest.raises(bs.InputError, match="linearise"):
        bs.close_loop(plant, lead(), tension=20)
    with pytest.raises(bs.InputError, match="use one of"):
        bs.close_loop("strp", lead())
    with pytest.raises(bs.InputError, match="controller"):
        bs.close_loop(plant, "PID")


def test_a_model_by_its_name_is_its_plant():
    plant = bs.linearise(model="strip_lift_off", tension=12, speed=0.8)
    by_plant = bs.close_loop(plant, lead(), y_start=1e-3, travel=20.0)
    by_name = bs.close_loop("strip_lift_off", lead(), y_start=1e-3, travel=20.0, tension=12, speed=0.8)
    np.testing.assert_array_equal(by_name.y, by_plant.y)


def test_a_loop_is_a_picture_in_a_notebook(plant):
    assert bs.plot(bs.close_loop(plant, lambda time, error: 0.0, travel=20.0))._repr_png_()[:4] == b"\x89PNG"


@pytest.mark.parametrize(("gain", "delay", "stable"), [(0.05, 0.2, True), (-0.05, 0.0, False), (2.0, 0.2, False)])
def test_an_unstable_loop_is_called_so_and_has_no_margins(plant, gain, delay, stable):
    """Limits hold the swing of an unstable loop, and a slow one looks at rest: the eigenvalues of the loop tell."""
    control = pytest.importorskip("control")
    point = 4 if gain == 2.0 else 1
    loop = bs.close_loop(plant, control.tf([gain], [1]), point=point, y_start=5e-3, delay=delay, limits=2e-3)
    assert loop.unstable is not stable
    assert (loop.margins is not None) is stable
    assert ("UNSTABLE" in str(loop)) is not stable
    assert "not settled" in str(loop)


def test_a_loop_without_limits_that_diverges_ends_there(plant):
    """A number is a gain, and of a run that swings up to the sky the loop is told as of any that is unstable."""
    pytest.importorskip("control")
    loop = bs.close_loop(plant, -5.0, y_start=1e-3, travel=400.0)
    assert loop.unstable
    assert loop.margins is None
    assert "UNSTABLE: any disturbance grows 2.7 times every" in str(loop)
    assert loop.travel[-1] < 400.0
    assert loop.y.shape == (4, len(loop.travel))
    assert 1.0 < np.abs(loop.y).max() <= 10.0
    assert bs.plot(loop)._repr_png_()[:4] == b"\x89PNG"
    with pytest.raises(bs.InputError, match="finite gain"):
        bs.close_loop(plant, np.nan)
    with pytest.raises(bs.InputError, match="give one, a number or a function"):
        bs.close_loop(plant, "PID")


def test_the_growth_of_a_loop_is_that_of_its_run(plant):
    control = pytest.importorskip("control")
    loop = bs.close_loop(plant, control.tf([0.05], [1]), y_start=5e-3, delay=0.5, travel=600.0)
    late = np.searchsorted(loop.travel, [300.0, 400.0])
    assert np.log(loop.y[0, late[1]] / loop.y[0, late[0]]) / 100.0 == pytest.approx(loop.growth, rel=0.02)


def test_a_loop_that_a_lead_would_upset_says_so(plant):
    """At point 4 a gain of 0.2 has three crossovers: the loop is stable, and bears some 12 deg of lead."""
    loop = bs.close_loop(plant, 0.2, point=4, y_start=5e-3, travel=600.0)
    m = loop.margins
    assert np.isfinite(loop.settled)
    assert m.by_lead
    assert 0.0 < np.rad2deg(m.phase_margin) < 15.0
    assert "against a lead" in str(loop)
    late = [bs.close_loop(plant, 0.2, point=4, delay=share * m.delay_margin, sample=0.2) for share in (0.97, 1.03)]
    assert [x.unstable for x in late] == [False, True]
    turned = loop.loop * np.exp(1j * m.phase_margin)  # at its crossover the curve then goes through -1
    assert np.abs(turned + 1.0).min() < 5e-3


def test_a_loop_with_nothing_to_do_is_settled(plant):
    loop = bs.close_loop(plant, 0.2, point=4)
    assert loop.settled == 0.0
    assert "not settled" not in str(loop)
