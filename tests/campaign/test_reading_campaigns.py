"""A right campaign folder becomes SI numbers, whatever program saved it."""

from dataclasses import replace

import numpy as np
import pytest
from roped_campaign import roped_campaign

import belt_sim as bs
from belt_sim.campaign import CampaignError, Quantity, case_of, read_campaign

#: Numbers pass through one decimal conversion and one factor: a few last bits.
ROUNDING = 1e-14


def test_values_arrive_in_si(folder):
    campaign = read_campaign(folder.path)
    belt, machine = campaign.belt, campaign.machine
    assert belt.width.value == pytest.approx(0.2, rel=ROUNDING)
    assert belt.youngs_modulus == Quantity(value=210e9, u=4e9)
    assert belt.density == Quantity(value=7850.0, u=0.0)
    assert machine.head_radius == machine.tail_radius == Quantity(value=0.17, u=0.0005)
    assert campaign.settings.yaw_u == pytest.approx(3e-6, rel=ROUNDING)
    y1, y4, tilt = campaign.signals
    assert (y1.wander_sd, y1.wander_length, y1.zero) == pytest.approx((5e-5, 3.0, 1e-4), rel=ROUNDING)
    assert (y4.zero, y4.gain, y4.wander_sd) == (0.0, 0.0, 0.0)
    assert (tilt.kind, tilt.at) == ("tilt", "upper_mid_span")
    assert tilt.white == pytest.approx(1e-4, rel=ROUNDING)


def test_runs_arrive_with_their_records(folder):
    first, repeat, third = read_campaign(folder.path).runs
    assert first.tension == pytest.approx(10e6, rel=ROUNDING)
    assert first.yaw == pytest.approx(-0.042 * np.pi / 180.0, rel=ROUNDING)
    assert (repeat.repeat_of, repeat.use) == ("r01", "hold_out")
    assert (repeat.speed, repeat.direction, repeat.yaw_at, repeat.yaw_head) == (0.5, 1.0, 0.0, 0.0)
    assert (third.direction, third.speed, third.yaw_at) == (-1.0, 0.25, 0.1)
    np.testing.assert_allclose(first.signals["y1"], [12e-6, 13e-6], rtol=ROUNDING)
    np.testing.assert_array_equal(np.isnan(first.signals["y4"]), [False, True])
    np.testing.assert_array_equal(first.time, [0.0, 0.2])
    assert repeat.time is None
    assert "tilt" not in third.signals


def test_a_place_on_the_belt_is_known_of_every_run_or_of_none(folder):
    """Of runs with a record: a place on the belt changes no rate, so that a run of rates alone needs none."""
    folder.write("runs.csv", "run,tension_N_per_mm2,yaw_deg,start_m\nr01,10,-0.042,3\nr02,10,-0.042,\nr03,40,0.042,\n")
    with pytest.raises(CampaignError, match=r"runs.csv:3: start_m: is blank, but stated of 1 other \(r01\)"):
        read_campaign(folder.path)
    folder.edit("runs.csv", "r02,10,-0.042,", "r02,10,-0.042,0")
    folder.edit("signals.csv", "r03,0.0,,0.02,0.003,\nr03,0.2,,0.03,0.004,\n", "")
    assert [r.start for r in read_campaign(folder.path).runs[:2]] == [3.0, 0.0]


def test_steady_rates_arrive_as_slopes(folder):
    first, third = read_campaign(folder.path).steady
    np.testing.assert_allclose(first.rates, [-0.094e-3, np.nan, np.nan, -0.095e-3], rtol=ROUNDING)
    assert (third.run, third.u) == ("r03", pytest.approx(2e-6, rel=ROUNDING))


def test_steady_rates_alone_make_a_campaign(folder):
    (folder.path / "signals.csv").unlink()
    folder.edit("runs.csv", "r02,10,-0.042,,,,,r01,hold_out\n", "")
    campaign = read_campaign(folder.path)
    assert all(len(run.travel) == 0 and run.signals == {} for run in campaign.runs)


def test_optional_sheet_parts_have_neutral_defaults(folder):
    folder.edit("campaign.yaml", "  poisson_ratio: {value: 0.3}\n", "")
    folder.edit("campaign.yaml", "settings: {tension_rel: 0.01, yaw: {u: 3, unit: urad}}\n", "")
    campaign = read_campaign(folder.path)
    assert campaign.belt.poisson_ratio == Quantity(value=0.3)
    assert (campaign.settings.tension_rel, campaign.settings.yaw_u) == (0.0, 0.0)


def test_what_other_programs_add_does_not_matter(folder):
    plain = read_campaign(folder.path)
    text = (folder.path / "signals.csv").read_text()
    spread = text.replace("r01,", '"r01" , ').replace("\n", "\r\n")
    folder.write("signals.csv", b"\xef\xbb\xbf" + spread.encode() + b"\r\n,,,,,\r\n  \r\n")
    dressed = read_campaign(folder.path)
    for before, after in zip(plain.runs, dressed.runs, strict=True):
        np.testing.assert_array_equal(before.travel, after.travel)
        for name in before.signals:
            np.testing.assert_array_equal(before.signals[name], after.signals[name])
    assert dressed.sha256 != plain.sha256


def test_yaml_words_that_look_like_other_types_stay_names(folder):
    folder.edit("campaign.yaml", "  y4: {", "  y: {")
    folder.edit("campaign.yaml", "title: slack belt", "title: 2024")
    folder.edit("signals.csv", "y4", "y")
    campaign = read_campaign(folder.path)
    assert campaign.title == "2024"
    assert campaign.signals[1].name == "y"


def test_rows_of_runs_may_interleave(folder):
    folder.write("signals.csv", "run,travel_m,y1\nr01,0,1\nr03,0,2\nr02,0,3\nr01,1,4\nr03,1,5\nr02,1,6\n")
    found = {run.name: run.signals["y1"] for run in read_campaign(folder.path).runs}
    for name, values in {"r01": [1, 4], "r03": [2, 5], "r02": [3, 6]}.items():
        np.testing.assert_allclose(found[name], np.array(values) * 1e-3, rtol=ROUNDING)


def test_the_case_of_a_run_is_its_nominal_state(folder):
    campaign = read_campaign(folder.path)
    run = campaign.runs[2]
    case = case_of(campaign, run)
    assert case.settings.direction == -1.0
    assert case.settings.tension == run.tension
    assert (case.settings.yaw.at[0], case.settings.yaw.last()) == (run.yaw_at, run.yaw)
    assert (case.settings.yaw_head.at[0], case.settings.yaw_head.last()) == (run.yaw_at, run.yaw_head)
    assert (case.rig.head_radius, case.belt.thickness) == (0.17, campaign.belt.thickness.value)


def test_unequal_pulleys_are_told_apart(folder):
    old = "pulley_radius: {value: 0.170, u: 0.0005, unit: m}"
    folder.edit("campaign.yaml", old, "head_radius: {value: 170, unit: mm}\n  tail_radius: {value: 0.2, unit: m}")
    machine = read_campaign(folder.path).machine
    assert (machine.head_radius.value, machine.tail_radius.value) == pytest.approx((0.17, 0.2), rel=ROUNDING)


def test_thirty_thousand_rows_are_read(folder):
    rows = (f"r0{k},{n / 100!r},,{n * 1e-3!r},{n * 2e-3!r},\n" for k in (1, 2, 3) for n in range(10_000))
    folder.write("signals.csv", "run,travel_m,time_s,y1,y4,tilt\n" + "".join(rows))
    campaign = read_campaign(folder.path)
    assert sum(len(run.travel) for run in campaign.runs) == 30_000


def test_a_campaign_is_a_table_in_si():
    campaign = read_campaign("slack_belt")
    table = campaign.to_pandas()
    first = campaign.runs[0]
    mine = table[table["run"] == first.name]
    assert len(table) == sum(len(r.travel) for r in campaign.runs)
    assert set(mine["tension"]) == {first.tension}
    for name, values in first.signals.items():
        assert mine[name].tolist() == pytest.approx(values.tolist(), nan_ok=True)


def test_a_run_and_a_campaign_are_equal_to_themselves_read_again(folder):
    """Guard: == of arrays raised."""
    first, again = read_campaign(folder.path), read_campaign(folder.path)
    assert first == again
    assert first.runs[0] == again.runs[0] != first.runs[1]
    assert first.steady == again.steady
    assert len({*first.runs, *again.runs}) == len(first.runs)


def test_where_the_belt_stood_reaches_what_depends_on_it():
    """A crown acts by the absolute place: its size is found where y0 is stated, and badly where it is left out."""
    base, crown, runs = roped_campaign(1), 0.02, []
    case = case_of(base, base.runs[0])
    for k, y0 in enumerate((8e-3, -8e-3)):
        curves = bs.simulate(
            replace(case, settings=replace(case.settings, y0=y0)),
            model="strip",
            effects=[{"id": "crown", "c": crown}],
            travel=30.0,
        ).curves
        signals = {f"y{point}": np.asarray(curves.y)[point - 1] for point in (1, 2, 3, 4)}
        travel = np.asarray(curves.travel)
        runs.append(replace(base.runs[k], tension=10e6, yaw=base.runs[0].yaw, y0=y0, travel=travel, signals=signals))
    found = bs.fit(replace(base, runs=tuple(runs)), ["crown"], "strip").effects[0]
    assert found.c == pytest.approx(crown, rel=0.02)
    lost = bs.fit(replace(base, runs=tuple(replace(r, y0=None) for r in runs)), ["crown"], "strip").effects[0]
    assert lost.c != pytest.approx(crown, rel=0.1)
