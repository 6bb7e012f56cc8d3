"""Drive, engine, sensor: effects before, in and after a 3D run do to it what they do to every model."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from belt_sim.curves import curves_columns
from belt_sim.effects.pulley import Crown, Taper
from belt_sim.effects.sensors import EncoderScale, SensorGain
from belt_sim.effects.span import Camber, EdgeGuide, Weld
from belt_sim.effects.yaw import Cant, TensionBias, YawOffsetTail
from belt_sim.space import Options
from belt_sim.space.model import SpaceModel
from belt_sim.space.native import run_native

TRAVEL, SLOW = 0.3, 0.9  # [m]; the encoder shows so much of the belt's travel
READ = 1e-3  # of the largest value: cubics through records 25 mm apart, where landings shake the spans
COARSE = Options(dx=0.04, dt=2e-3, run_in=0.3, settle=0.2, acceleration=3.0)

pytestmark = pytest.mark.filterwarnings("ignore:flex")


@pytest.fixture(scope="module")
def shown_and_true(short_rig):
    """A belt tighter than displayed, read by a stretched encoder and one sensor that shows too much; and as it is."""
    effects = [TensionBias(gain=0.1), EncoderScale(e=SLOW - 1.0), SensorGain(g1=0.5)]
    shown = SpaceModel(options=COARSE).run(short_rig, effects, travel=TRAVEL)
    tighter = replace(short_rig, settings=replace(short_rig.settings, tension=1.1 * short_rig.settings.tension))
    return shown, run_native(tighter, travel=TRAVEL / SLOW, options=COARSE)


def test_the_record_ends_where_the_encoder_says(shown_and_true):
    shown, true = shown_and_true
    np.testing.assert_allclose(shown.travel, SLOW * true.travel, atol=1e-9)
    assert true.travel[-1] > TRAVEL


@pytest.mark.parametrize(("point", "gain"), [(0, 1.5), (1, 1.0), (2, 1.0), (3, 1.0)])
def test_it_is_the_tighter_belt_further_on_and_one_sensor_shows_more(shown_and_true, point, gain):
    shown, true = shown_and_true
    wanted = gain * CubicSpline(true.travel, true.y[point])(shown.travel / SLOW)
    np.testing.assert_allclose(shown.y[point], wanted, atol=READ * np.abs(true.y).max())
    assert np.abs(true.y[0]).max() > 2e-5


def test_what_a_3d_run_tells_beside_the_curves_is_stretched_alike(shown_and_true):
    shown, true = shown_and_true
    assert set(shown.extra) == set(true.extra)
    for name in ("tension", "steps"):
        assert shown.extra[name].shape == shown.travel.shape
    columns = curves_columns(shown)
    assert columns["tension_N_per_mm2"] == pytest.approx(shown.extra["tension"] / 1e6)
    assert set(columns) > {"tail_x_m", "belt_speed_m_per_s", "slip_head_mm", "sliding_head", "steps"}
    inside = shown.travel > 0.04  # the yaw takes 600 steps at travel 0
    steps = np.interp(shown.travel / SLOW, true.travel, true.extra["steps"])
    np.testing.assert_allclose(shown.extra["steps"][inside], steps[inside], rtol=0.01)
    assert shown.extra["tension"].mean() == pytest.approx(1.1 * 60e6, rel=0.03)


def test_effects_on_one_scene_add(short_rig):
    """Whichever is asked first: bends of the belt add up, rollers stand side by side, a pulley has all its faults."""
    guides = EdgeGuide(stiffness=1e5, gap=1e-3, at=0.5), EdgeGuide(stiffness_lower=2e5, gap=2e-3, at=0.7)
    effects = [Camber(kappa_c=1e-4), Weld(angle=1e-3, at=1.0), *guides, Taper(kappa_t=1e-5), Crown(c=0.1)]
    effects += [Cant(gamma=1e-4), YawOffsetTail(beta_0=2e-4)]
    s = np.linspace(0.0, 5.0, 101)
    alone = [e.scene(SpaceModel().parts(short_rig, []), short_rig).camber for e in effects[:2]]
    for order in (effects, effects[::-1]):
        parts = SpaceModel().parts(short_rig, order)
        np.testing.assert_allclose(parts.camber(s), alone[0](s) + alone[1](s), rtol=1e-12)
        tail = parts.tail
        assert (tail.taper, tail.crown, tail.cant, tail.yaw_offset) == (1e-5, 0.1, 1e-4, 2e-4)
        assert {(g.span, g.side, g.stiffness) for g in parts.edge_guides} == {
            (span, side, size) for span, size in (("upper", 1e5), ("lower", 2e5)) for side in (1.0, -1.0)
        }
    assert np.ptp(alone[1](s)) > 0.0
