"""Where the yaw was applied is known no better than a logger's rows; a delay of the sensors is not named for that."""

from dataclasses import replace

import numpy as np
from small_campaign import MODEL, SPREAD

from belt_sim.api.simulate import candidates_of
from belt_sim.campaign import Campaign
from belt_sim.diagnosis.examine import examine
from belt_sim.diagnosis.forward import NUISANCES
from belt_sim.diagnosis.samples import samples_of
from belt_sim.diagnosis.workbench import workbench
from belt_sim.model import analytic_model
from belt_sim.units import DEGREE, MM, N_PER_MM2
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import Noise, Plan, RunSetting

ROWS = 0.25  # [m] between the readings of a coarse logger
STRIP = analytic_model("strip")
DELAY = candidates_of(("sensor_delay",), STRIP)
U = ROWS / np.sqrt(12.0)  # [m], of a place anywhere between two rows
BEFORE = 5.0  # [m] of travel before the first row that shows the yaw


def coarse(known_to: float) -> Campaign:
    """Runs without any fault, whose yaw always came just before the row that shows it; stated to be midway."""
    settings = [(t, s) for t in (10.0, 20.0, 40.0) for s in (-1, 1)]
    runs = [RunSetting(tension=t * N_PER_MM2, yaw=0.042 * s * DEGREE, yaw_at=BEFORE - 1e-3) for t, s in settings]
    runs += [replace(runs[k], repeat_of=k) for k in (2, 5)]
    noise = Noise(white=0.01 * MM, wander_sd=0.02 * MM, zero=0.0, tension_rel=0.005)
    plan = Plan(runs=tuple(runs), length=45.0, spacing=ROWS)
    made = make_campaign(seed=3, base="strip", plan=plan, noise=noise)[0]
    stated = {"yaw_at": BEFORE - 0.5 * ROWS, "yaw_at_u": known_to}
    return replace(made, runs=tuple(replace(r, **stated) for r in made.runs))


def gain_of_delay(campaign: Campaign) -> float:
    """What a delay of the sensors alone takes off chi2, in the linear range."""
    bench = workbench(campaign, STRIP, DELAY)
    null = bench.forward.null()
    (column,) = bench.metric.whiten(bench.forward.expand(null, bench.forward.index("sensor_delay"))[1])
    left = bench.metric.whiten(bench.fitted.y - bench.forward.values(null[None])[0])
    return float((column @ left) ** 2 / (column @ column))


def test_a_place_taken_as_exact_would_look_like_a_delay():
    exact, known = (gain_of_delay(coarse(u)) for u in (0.0, U))
    assert exact > 100.0
    assert known < 6.0


def test_coarse_rows_are_no_delay_of_the_sensors():
    found = examine(coarse(U), STRIP, DELAY, seed=5)
    assert (found.decision.verdict, found.named.ids) == ("adequate", ())


def test_the_shape_is_what_a_later_yaw_does():
    """One sigma of the place moves the predictions as another place does."""
    made = make_campaign(seed=1, plan=replace(SPREAD, runs=tuple(replace(r, yaw_at=2.0) for r in SPREAD.runs)))[0]
    u = 0.1
    bench = workbench(replace(made, runs=tuple(replace(r, yaw_at_u=u) for r in made.runs)), MODEL, [])
    late = np.eye(len(NUISANCES))[NUISANCES.index("yaw_at")]
    moved = bench.forward.values(np.array([u * late, -u * late]))
    np.testing.assert_allclose(bench.shapes[-1], 0.5 * (moved[0] - moved[1]), atol=0.05 * np.abs(moved[0]).max() * u)
    assert np.abs(bench.shapes[-1]).max() > 0.01 * MM
    np.testing.assert_array_equal(bench.shared[1], bench.shapes[-1])  # and once more in all runs alike
    exact = workbench(made, MODEL, [])
    assert (len(exact.shared), len(exact.shapes)) == (len(bench.shared) - 1, len(bench.shapes) - 1)


def test_a_tilt_is_not_judged_where_the_yaw_may_have_come():
    signals = {"y1": "point_1", "phi": "upper_mid_span"}
    runs = tuple(RunSetting(tension=2e7, yaw=yaw, yaw_at=2.0) for yaw in (-7e-4, 7e-4))
    made = make_campaign(seed=1, plan=Plan(runs=runs, length=10.0, spacing=0.25, signals=signals))[0]
    samples = samples_of(replace(made, runs=tuple(replace(r, yaw_at_u=0.2) for r in made.runs)))
    unknown = np.abs(samples.travel[0] - 2.0) <= 0.4
    unknown[0] = True  # where a tilt jumps
    np.testing.assert_array_equal(np.isnan(samples.y[0, 1]), unknown)
