"""Numbers that a machine hardly has are asked about, and so is a counter that falls."""

import numpy as np
import pytest
from logger_files import MAPPING, log, table

from belt_sim.campaign import Campaign, CampaignError, read_campaign, write_campaign
from belt_sim.errors import InputError
from belt_sim.importing import read, understand

RUN = {"tension": "10 N/mm2", "yaw": "-0.73 mrad"}
L = log(length=30.0)


def proposal(path, header, rows, **mapping):
    path.write_text(table(header, rows, digits=7))
    return understand(read([path]), MAPPING | {"all_runs": RUN} | mapping)


def test_metres_under_a_header_of_mm_are_asked_about(tmp_path):
    """30 m after 0.73 mrad the belt has moved by millimetres, not by micrometres."""
    columns = [L.travel, 1e-3 * L.y1, 1e-3 * L.y4]
    made = proposal(tmp_path / "a.csv", ["travel [m]", "y1 [mm]", "y4 [mm]"], columns)
    asked = {q.path: q for q in made.missing}
    assert ("columns", "y1 [mm]", "unit") in asked
    assert "of yaw times travel" in asked["columns", "y1 [mm]", "unit"].text
    answers = {"columns": {"y1 [mm]": {"unit": "m"}, "y4 [mm]": {"unit": "m"}}}
    run = proposal(tmp_path / "a.csv", ["travel [m]", "y1 [mm]", "y4 [mm]"], columns, **answers).complete().runs[0]
    assert np.ptp(run.signals["y1"]) == pytest.approx(1e-3 * np.ptp(L.y1), rel=0.05)
    plain = proposal(tmp_path / "b.csv", ["travel [m]", "y1 [mm]", "y4 [mm]"], [L.travel, L.y1, L.y4])
    assert plain.missing == ()


@pytest.mark.parametrize(("rise", "scatter", "is_asked"), [(0.1, 0.02, True), (0.0, 0.2, False), (0.02, 0.02, False)])
def test_a_tension_that_moves_within_a_run_is_asked_about(tmp_path, rise, scatter, is_asked):
    noise = scatter * np.random.default_rng(1).standard_normal(len(L.travel))
    tension = 10.0 * (1.0 + rise * L.travel / L.travel[-1] + noise)
    header, columns = ["travel [m]", "tension [N/mm2]", "y1 [mm]"], [L.travel, tension, L.y1]
    only = {"all_runs": {"yaw": "-0.73 mrad"}}
    made = proposal(tmp_path / "a.csv", header, columns, **only)
    assert [q.path for q in made.missing] == ([("trust", "steady_tension")] if is_asked else [])
    if is_asked:
        assert "from 10.0" in made.missing[0].text
        run = proposal(tmp_path / "a.csv", header, columns, trust={"steady_tension": "yes"}, **only).complete().runs[0]
        assert run.tension == pytest.approx(10.5e6, rel=0.01)


def test_a_counter_that_rolls_over_is_asked_about_and_counted_on(tmp_path):
    file, columns = tmp_path / "a.csv", [(83.2 + L.travel) % 100.0, L.y1]
    (question,) = proposal(file, ["Weg [m]", "y1 [mm]"], columns).missing
    assert question.key == "format.counter"
    made = proposal(file, ["Weg [m]", "y1 [mm]"], columns, format={"counter": "goes_on"})
    (run,) = made.complete().runs
    assert run.travel[-1] == pytest.approx(L.travel[-1], abs=1e-6)
    assert any("counted on there" in n.text for n in made.notes)


def test_a_counter_that_was_reset_is_two_runs_and_one_that_jumps_is_refused(tmp_path):
    twice = np.concatenate([L.travel, L.travel])
    text = table(["Weg [m]", "y1 [mm]"], [twice, np.tile(L.y1, 2)], digits=7)
    (tmp_path / "a.csv").write_text(text)
    twice = understand(read([tmp_path / "a.csv"]), MAPPING | {"all_runs": RUN})
    assert len(twice.complete().runs) == 2
    assert any(f"(line {len(L.travel) + 2}): a new run begins there" in n.text for n in twice.notes)
    jumps = np.where(L.travel > 20.0, L.travel - 7.3, L.travel)
    with pytest.raises(CampaignError, match="travel runs backwards"):
        proposal(tmp_path / "b.csv", ["Weg [m]", "y1 [mm]"], [jumps, L.y1])


def test_a_gap_of_the_clock_and_a_travel_that_falls_throughout_are_told(tmp_path):
    time = np.where(L.travel > 10.0, L.time + 600.0, L.time)
    made = proposal(tmp_path / "a.csv", ["time [s]", "v [m/s]", "y1 [mm]"], [time, 0 * time + 0.5, L.y1])
    assert any("no rows for 600" in n.text and "(300" in n.text for n in made.notes)
    made = proposal(tmp_path / "b.csv", ["travel [m]", "y1 [mm]"], [L.travel[::-1], L.y1[::-1]])
    assert any("newest row first" in n.text for n in made.notes)


def test_a_file_without_readings_is_refused(tmp_path):
    columns, stated = [L.travel, [""] * len(L.travel)], {"columns": {"y1 [mm]": {"at": "point_1"}}}
    with pytest.raises(InputError, match="no column of a signal holds numbers"):
        proposal(tmp_path / "a.csv", ["travel [m]", "y1 [mm]"], columns, **stated)


def test_a_machine_that_ran_before_its_record(tmp_path):
    """run_in, known or not, and a yaw that was on before the record; both are in the folder that is written."""
    header, columns = ["travel [m]", "y1 [mm]", "y4 [mm]"], [L.travel, L.y1, L.y4]
    unknown = proposal(tmp_path / "a.csv", header, columns, all_runs=RUN | {"run_in": "unknown"}).complete()
    assert np.isnan(unknown.runs[0].run_in)
    assert unknown.runs[0].travel[0] == 0.0
    known = proposal(
        tmp_path / "a.csv", header, columns, all_runs=RUN | {"run_in": "12 m", "yaw_at": "-12 m"}
    ).complete()
    assert (known.runs[0].yaw_at, known.runs[0].travel[0]) == (0.0, 12.0)
    for campaign in (unknown, known):
        back: Campaign = write_campaign(campaign, tmp_path / "c", overwrite=True)
        assert back.runs == read_campaign(tmp_path / "c").runs
        assert back.runs[0].run_in == pytest.approx(campaign.runs[0].run_in, nan_ok=True)
        assert (back.runs[0].yaw_at, *back.runs[0].travel[:2]) == (
            campaign.runs[0].yaw_at,
            *campaign.runs[0].travel[:2],
        )
        assert back.runs[0].runs_already
    text = (tmp_path / "c" / "runs.csv").read_text()
    (tmp_path / "c" / "runs.csv").write_text(text.replace("-12.0,12.0", "-13.0,12.0"))
    with pytest.raises(CampaignError, match="yaw_at_m = -13 m: is before the record: state run_in_m of at least 13"):
        read_campaign(tmp_path / "c")
    with pytest.raises(InputError, match="is before the record: state run_in too"):
        proposal(tmp_path / "a.csv", header, columns, all_runs=RUN | {"yaw_at": "-12 m"})


def test_a_place_far_off_the_pulleys_is_asked_about_and_one_found_by_the_middle_is_told(tmp_path):
    """100 mm is half the belt's width; 9 m of a mistyped middle is no place of a belt."""
    rows, header = [L.travel, L.y1 - L.y1[0] + 158.6], ["travel [m]", "y1 [mm]"]
    for given, shown in (("9000 mm", "y0 -884"), ("150 mm", "")):
        columns = {"y1 [mm]": {"role": "signal", "at": "point_1", "middle": given}}
        made = proposal(tmp_path / "a.csv", header, rows, columns=columns)
        assert [q.path for q in made.missing] == ([("trust", "y0")] if shown else [])
        assert all(shown in q.text for q in made.missing)
        assert any(n.text.startswith("y0 by middle: ") for n in made.notes)
    made = proposal(tmp_path / "a.csv", header, rows, all_runs=RUN | {"y0": "9000 mm"})
    assert [q.path for q in made.missing] == [("trust", "y0")]
    trusted = proposal(tmp_path / "a.csv", header, rows, all_runs=RUN | {"y0": "150 mm"}, trust={"y0": True})
    assert trusted.complete().runs[0].y0 == pytest.approx(0.15)


def test_a_start_of_some_runs_only_is_refused(tmp_path):
    files = [tmp_path / f"{name}.csv" for name in "ab"]
    for path in files:
        path.write_text(table(["travel [m]", "y1 [mm]"], [L.travel, L.y1], digits=7))
    with pytest.raises(InputError, match=r"runs\.b\.start.*that of a is; state it of every run, or of none"):
        understand(read(files), MAPPING | {"all_runs": RUN, "runs": {"a": {"start": "3 m"}}})
    made = understand(read(files), MAPPING | {"all_runs": RUN | {"start": "2 m"}, "runs": {"a": {"start": "3 m"}}})
    assert [r.start for r in made.complete().runs] == [3.0, 2.0]


def test_a_load_cell_of_one_side_is_asked_about_unless_both_are_there(tmp_path):
    force = 600.0 + 0.0 * L.travel
    header, rows = ["travel [m]", "load cell left [N]", "y1 [mm]"], [L.travel, force, L.y1]
    only = {"all_runs": {"yaw": "-0.73 mrad"}}
    (asked,) = proposal(tmp_path / "a.csv", header, rows, **only).missing
    assert asked.path == ("columns", "load cell left [N]", "factor")
    assert "the other side's has no column" in asked.text
    twice = proposal(tmp_path / "a.csv", header, rows, columns={"load cell left [N]": {"factor": 2}}, **only)
    assert twice.complete().runs[0].tension == pytest.approx(20e6)
    header, rows = [*header, "load cell right [N]"], [*rows, force]
    both = proposal(tmp_path / "a.csv", header, rows, use={"tension": "sum"}, **only)
    assert both.complete().runs[0].tension == pytest.approx(20e6)


@pytest.mark.parametrize("times", [0.1, 3.0, 10.0])
@pytest.mark.parametrize("told", ["speed [m/s]", "the mapping"])
def test_travel_time_and_speed_that_contradict_are_asked_about(tmp_path, told, times):
    header, rows = ["time [s]", "travel [m]", "y1 [mm]"], [L.time, times * L.travel, L.y1]
    if told == (logged := "speed [m/s]"):
        header, rows = [*header, logged], [*rows, 0.0 * L.time + 0.5]
    given = {"all_runs": RUN | ({} if told == logged else {"speed": "0.5 m/s"})}
    asked = {q.key: q.text for q in proposal(tmp_path / "a.csv", header, rows, **given).missing}
    starts = f"run a travels {times * L.travel[-1]:.4g} m in {L.time[-1]:.4g} s, at {0.5 * times:g} m/s"
    assert asked["trust.speed"].startswith(f"{starts}, but {told} says 0.5 m/s; mend travel, time or speed")
    trust = {"speed": "yes", "travel": "yes", "y": "yes"}
    run = proposal(tmp_path / "a.csv", header, rows, trust=trust, **given).complete().runs[0]
    assert run.travel[-1] == pytest.approx(times * L.travel[-1], rel=0.01)
    rows[1] = 1.05 * L.travel
    assert proposal(tmp_path / "a.csv", header, rows, **given).missing == ()


@pytest.mark.parametrize(("speed", "is_asked"), [("30", True), ("30 m/s", False), ("0.5", False)])
def test_a_number_without_a_unit_is_judged_as_one_that_was_logged(tmp_path, speed, is_asked):
    made = proposal(tmp_path / "a.csv", ["travel [m]", "y1 [mm]"], [L.travel, L.y1], all_runs=RUN | {"speed": speed})
    assert [q.text.split(";")[0] for q in made.missing] == (["speed 30 m/s in run a"] if is_asked else [])


def test_two_signals_of_one_place_are_told(tmp_path):
    made = proposal(tmp_path / "a.csv", ["travel [m]", "y1 [mm]", "y1 [mm]"], [L.travel, L.y1, L.y4])
    assert "y1 [mm] (b): measures at point_1, as y1 [mm] does: is y1b" in [str(n) for n in made.notes]
    plain = proposal(tmp_path / "a.csv", ["travel [m]", "y1 [mm]", "y4 [mm]"], [L.travel, L.y1, L.y4])
    assert not any("measures at" in n.text for n in plain.notes)


def two_files(folder, header, columns, *later):
    """Two files of a run 7: columns, and later ones with their header."""
    files = [folder / "day1.csv", folder / "day2.csv"]
    for path, (names, own) in zip(files, ((header, columns), later), strict=True):
        path.write_text(table(["run", *names], [["7"] * len(own[0]), *own], digits=7))
    return lambda: understand(read(files), MAPPING | {"all_runs": RUN})


def test_a_run_that_two_files_have_with_other_readings_is_refused(tmp_path):
    """Guard: of two days' files with a run 7 each, the readings of the second day took the place of the first's; of a
    run that goes on in a second file, a second run was made, and of its sensors some were of another day."""
    header, first = ["travel [m]", "y1 [mm]"], [L.travel, L.y1]
    told = r"day2\.csv:2: run = 7: stands already in day1\.csv with other readings of y1; join them if the run goes on"
    both = [*header, "y4 [mm]"]
    for names, later in ((header, [L.travel, -2.0 * L.y1]), (both, [L.travel, L.y1 + 0.1, L.y4])):
        with pytest.raises(CampaignError, match=told):
            two_files(tmp_path, header, first, names, later)()
    half = len(L.travel) // 2
    with pytest.raises(CampaignError, match=told):
        two_files(tmp_path, header, [x[:half] for x in first], header, [x[half:] for x in first])()


def test_a_run_whose_sensors_two_files_have_is_one_a_common_one_and_a_copy_included(tmp_path):
    header, first = ["travel [m]", "y1 [mm]", "y4 [mm]"], [L.travel, L.y1, L.y4]
    other, again = ["travel [m]", "y3 [mm]"], [L.travel, L.y4]
    for names, later, signals in (
        (other, again, "y1 y3 y4"), ([*other, "y1 [mm]"], [*again, L.y1], "y1 y3 y4"), (header, first, "y1 y4")
    ):  # fmt: skip
        (run,) = two_files(tmp_path, header, first, names, later)().complete().runs
        assert {*run.signals} == {*signals.split()}
        assert np.ptp(run.signals["y1"]) == pytest.approx(1e-3 * np.ptp(L.y1), rel=0.1)


def test_tables_of_runs_that_contradict_are_refused(tmp_path):
    """Guard: the last of them counted."""
    record = tmp_path / "a.csv"
    record.write_text(table(["travel [m]", "y1 [mm]"], [L.travel, L.y1]))
    for name, tension in (("t", 10), ("u", 15)):
        (tmp_path / f"{name}.csv").write_text(f"run,tension [N/mm2],yaw [deg]\na,{tension},-0.042\n")
    with pytest.raises(CampaignError, match=r"u\.csv:2: tension = 15 N/mm2: t\.csv:2 says 10 N/mm2 of run a; mend one"):
        understand(read([record, tmp_path / "t.csv", tmp_path / "u.csv"]), MAPPING)
    (tmp_path / "u.csv").write_text("run,tension [N/mm2],speed [m/s]\na,10.0,0.7\n")
    made = understand(read([record, tmp_path / "t.csv", tmp_path / "u.csv"]), MAPPING)
    assert (made.complete().runs[0].tension, made.complete().runs[0].speed) == (10e6, 0.7)


@pytest.mark.parametrize("runs", [("a", "b"), ("1", "2")])
def test_remarks_under_a_table_of_runs_or_rates_are_left_out_and_told(tmp_path, runs):
    """Guard: two of them were refused as a run that stands twice, or the table was taken for a record."""
    names = [run if run.isalpha() else f"r{run}" for run in runs]
    rows = [["run", "tension [N/mm2]", "yaw [deg]", "rate1", "u_rate"], [runs[0], *"7111"], [runs[1], *"9131"]]
    rows += [["", "8", "", "", ""], ["", "1", "", "", "1"]]
    (tmp_path / "rates.csv").write_text("\n".join(";".join(row) for row in rows))
    made = understand(read([tmp_path / "rates.csv"]), MAPPING)
    assert "rates: run is blank in line 4, 5: left out, as of no run" in [str(n) for n in made.notes]
    assert [(s.run, s.rates[0]) for s in made.complete().steady] == [(names[0], 1e-3), (names[1], 3e-3)]
    (tmp_path / "runs.csv").write_text("\n".join(";".join(row[:3]) for row in rows))
    record = tmp_path / "log.csv"
    columns = [list(np.repeat(runs, len(L.travel))), *(np.tile(x, 2) for x in (L.travel, L.y1))]
    record.write_text(table(["run", "travel [m]", "y1 [mm]"], columns))
    made = understand(read([record, tmp_path / "runs.csv"]), MAPPING)
    assert "runs: run is blank in line 4, 5: left out, as of no run" in [str(n) for n in made.notes]
    assert [(r.name, r.tension) for r in made.complete().runs] == [(names[0], 7e6), (names[1], 9e6)]


def test_a_run_that_stands_twice_in_a_table_of_settings_is_refused(tmp_path):
    """Guard: the table was taken for a record without time or travel."""
    (tmp_path / "a.csv").write_text(table(["travel [m]", "y1 [mm]"], [L.travel, L.y1]))
    (tmp_path / "t.csv").write_text("run,tension [N/mm2],yaw [deg]\na,10,-0.042\na,20,0.042\n")
    with pytest.raises(
        CampaignError, match=r"t\.csv:3: run = a: stands already in line 2; give every run its own name"
    ):
        understand(read([tmp_path / "a.csv", tmp_path / "t.csv"]), MAPPING)


def test_a_run_that_stands_twice_in_a_table_of_rates_is_refused(tmp_path):
    """Guard: every run behind it was given the rates of the row before its own."""
    (tmp_path / "a.csv").write_text("run;tension [N/mm2];yaw [deg];rate1;u_rate\na;7;1;1;1\na;7;1;2;1\nb;9;1;3;1\n")
    with pytest.raises(
        CampaignError, match=r"a\.csv:3: run = a: stands already in line 2; give every run its own name"
    ):
        understand(read([tmp_path / "a.csv"]), MAPPING)


@pytest.mark.parametrize(("name", "value", "key", "is_then"), [
    ("speed [m/s]", 2.0, "speed", 2.0), ("yaw at [m]", 5.0, "yaw_at", 5.0), ("direction", -1.0, "direction", -1.0),
    ("speed [m/s]", -2.0, "direction", -1.0),
])  # fmt: skip
def test_a_setting_that_a_column_of_the_record_holds_is_that_of_the_run(tmp_path, name, value, key, is_then):
    """Guard: a speed beside a travel without a time, and a column of where the yaw was set, went unsaid."""
    columns = [L.travel, 0.0 * L.travel + value, L.y1]
    (run,) = proposal(tmp_path / "a.csv", ["travel [m]", name, "y1 [mm]"], columns).complete().runs
    assert getattr(run, key) == pytest.approx(is_then)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_speed_beside_a_travel_is_that_of_the_running_belt(tmp_path, sign):
    """Guard: of a belt that stands first, for longer than it runs, the speed was 0 and refused."""
    stands = np.zeros(len(L.travel) + 100)
    columns = [np.r_[stands, L.travel], np.r_[stands, 0.0 * L.travel + 0.7 * sign], np.r_[stands + L.y1[0], L.y1]]
    columns[1][: len(stands) : 2] -= 0.02 * sign  # of a tachometer at rest
    columns[1][-3] = -90.0 * sign  # a reading that is wrong
    (run,) = proposal(tmp_path / "a.csv", ["travel [m]", "speed [m/s]", "y1 [mm]"], columns).complete().runs
    assert (run.speed, run.direction) == (0.7, sign)


def test_the_speed_of_the_wind_is_not_the_belts(tmp_path):
    columns = [L.travel, 0.0 * L.travel + 2.0, L.y1]
    made = proposal(tmp_path / "a.csv", ["travel [m]", "wind speed [m/s]", "y1 [mm]"], columns)
    assert [q.key for q in made.unknown] == ["columns.wind speed [m/s].at"]
    assert made.complete().runs[0].speed == 0.5


def test_a_direction_that_turns_within_a_run_is_refused_unless_it_is_stated(tmp_path):
    columns = [L.travel, np.where(L.travel < 20.0, 1.0, -1.0), L.y1]
    header = ["travel [m]", "direction", "y1 [mm]"]
    row = int(np.argmax(columns[1] < 0.0))
    with pytest.raises(CampaignError, match=rf"a\.csv:{row + 2}: direction = -1: the belt reverses within a run"):
        proposal(tmp_path / "a.csv", header, columns)
    stated = proposal(tmp_path / "a.csv", header, columns, all_runs=RUN | {"direction": "1"})
    assert stated.complete().runs[0].direction == 1.0


def test_rows_without_a_run_or_a_travel_are_told(tmp_path):
    header, gap = ["run", "travel [m]", "y1 [mm]"], (L.travel > 10.0) & (L.travel < 12.0)
    made = proposal(tmp_path / "a.csv", header, [np.where(gap, "", "a"), L.travel, L.y1])
    assert any("run is blank in line" in n.text for n in made.notes)
    made = proposal(tmp_path / "b.csv", header, [["a"] * len(gap), np.where(gap, np.nan, L.travel), L.y1])
    assert any(f"{gap.sum()} rows without time or travel were left out (line " in n.text for n in made.notes)


def test_a_stress_and_a_force_have_no_mean(tmp_path):
    """Guard: their mean was that of N/m2 and N, half the stress."""
    header = ["travel [m]", "tension left [N/mm2]", "tension right [N]", "y1 [mm]"]
    columns = [L.travel, 0.0 * L.travel + 10.0, 0.0 * L.travel + 600.0, L.y1]
    with pytest.raises(InputError, match=r"use\.tension = mean: tension left .* are in units of several kinds"):
        proposal(tmp_path / "a.csv", header, columns, use={"tension": "mean"})


def test_tables_of_runs_may_differ_as_their_digits_are_rounded(tmp_path):
    """Guard: 10 beside 10.04 was refused, 10 beside 10.4 and 11 was not. Nothing is no rounded number."""
    record, tables = tmp_path / "a.csv", [tmp_path / "t.csv", tmp_path / "u.csv"]
    record.write_text(table(["travel [m]", "y1 [mm]"], [L.travel, L.y1]))
    rows = "run,tension [N/mm2],yaw [deg]\na,10.04,-0.0403\n", "run,tension [N/mm2],yaw [mrad]\na,10,-0.703\n"
    for texts in (rows, rows[::-1]):
        for path, text in zip(tables, texts, strict=True):
            path.write_text(text)
        (run,) = understand(read([record, *tables]), MAPPING).complete().runs
        assert (run.tension, run.yaw) == (10.04e6, pytest.approx(np.radians(-0.0403), rel=1e-3))
    for tension in (10.4, 11):
        tables[1].write_text(f"run,tension [N/mm2]\na,{tension}\n")
        with pytest.raises(CampaignError, match=rf"tension = {tension} N/mm2: t\.csv:2 says 10 N/mm2 of run a"):
            understand(read([record, *tables]), MAPPING)
    tables[1].write_text("run,yaw [deg]\na,0\n")
    with pytest.raises(CampaignError, match=r"u\.csv:2: yaw = 0 deg: t\.csv:2 says -0\.0402"):
        understand(read([record, *tables]), MAPPING)


def test_a_copy_in_other_units_or_of_fewer_rows_is_no_other_run(tmp_path):
    """Guard: both were refused as other readings."""
    header, first = ["travel [m]", "y1 [mm]"], [L.travel, L.y1]
    for names, later in (
        (["travel [mm]", "y1 [m]", "y4 [mm]"], [1e3 * L.travel, 1e-3 * L.y1, L.y4]),
        ([*header, "y4 [mm]"], [L.travel[::4], L.y1[::4], L.y4[::4]]),
    ):
        (run,) = two_files(tmp_path, header, first, names, later)().complete().runs
        assert {*run.signals} == {"y1", "y4"}
        assert np.ptp(run.signals["y1"]) == pytest.approx(1e-3 * np.ptp(L.y1), rel=0.1)


def test_settings_of_records_that_contradict_are_refused(tmp_path):
    """Guard: that of the first file counted."""
    columns = [L.travel, L.y1, 0.0 * L.travel + 10.0]
    header, other = ["travel [m]", "y1 [mm]", "tension [N/mm2]"], ["travel [m]", "y4 [mm]", "tension [MPa]"]
    only = {"all_runs": {"yaw": "-0.73 mrad"}}
    two_files(tmp_path, header, columns, other, [L.travel, L.y4, 0.0 * L.travel + 20.0])
    files = [tmp_path / "day1.csv", tmp_path / "day2.csv"]
    told = r"day2\.csv:2: tension = 20 N/mm2: day1\.csv says 10 N/mm2 of run 7; mend one, or state it in the mapping"
    with pytest.raises(CampaignError, match=told):
        understand(read(files), MAPPING | only)
    assert understand(read(files), MAPPING | {"all_runs": RUN}).complete().runs[0].tension == 10e6
    two_files(tmp_path, header, columns, other, [L.travel, L.y4, 0.0 * L.travel + 10.01])
    assert understand(read(files), MAPPING | only).complete().runs[0].tension == 10e6


def test_a_speed_without_wind_is_the_belts(tmp_path):
    columns = [L.travel, 0.0 * L.travel + 2.0, L.y1]
    for name, speed in (("belt speed (no wind) [m/s]", 2.0), ("fan belt speed [m/s]", 0.5)):
        made = proposal(tmp_path / "a.csv", ["travel [m]", name, "y1 [mm]"], columns)
        assert made.complete().runs[0].speed == speed
        assert [q.key for q in made.unknown] == ([] if speed == 2.0 else [f"columns.{name}.at"])


def test_a_table_of_runs_states_starts_and_yaws_as_the_travel_counts(tmp_path):
    """Guard: start went unsaid; a yaw at 1008 m of an odometer was beyond the record, one at 8 m 3 m too late."""
    (tmp_path / "t.csv").write_text("run,tension [N/mm2],yaw [deg],start [m],yaw at [m]\na,10,-0.042,2.5,8\n")
    for first, at in ((3.0, 5.0), (0.0, 8.0)):
        (tmp_path / "a.csv").write_text(table(["travel [m]", "y1 [mm]"], [first + L.travel, L.y1]))
        (run,) = understand(read([tmp_path / "a.csv", tmp_path / "t.csv"]), MAPPING).complete().runs
        assert (run.start, run.yaw_at) == (2.5, at)
    columns = [1038.0 - L.travel, L.y1, 0.0 * L.travel + 1026.0]
    (run,) = proposal(tmp_path / "b.csv", ["odometer [m]", "y1 [mm]", "yaw at [m]"], columns).complete().runs
    assert run.yaw_at == 12.0
    run = proposal(tmp_path / "b.csv", ["odometer [m]", "y1 [mm]"], columns[:2], all_runs=RUN | {"yaw_at": "5 m"})
    assert run.complete().runs[0].yaw_at == 5.0


def test_parts_that_begin_or_count_otherwise_are_refused(tmp_path):
    """Guard: the second was laid over the first from its own first row on."""
    header, first, other = ["odometer [m]", "y1 [mm]"], [L.travel + 100.0, L.y1], ["odometer [m]", "y4 [mm]"]
    late, clock = L.travel > 4.0, ["odometer [m]", "time [s]"]
    for names, columns, told in (
        (other, [L.travel[late] + 100.0, L.y4[late]], r"odometer \[m\] = begins: \S+ m behind the first of day1"),
        (["travel [m]", "y4 [mm]"], [200.0 - L.travel, L.y4], r"direction = -1: its travel or speed has another sign"),
        (other, [L.travel + 130.0, L.y4], r"odometer \[m\] = begins: 30 m behind the first of day1"),
    ):
        with pytest.raises(CampaignError, match=told):
            two_files(tmp_path, header, first, names, columns)()
    twice = [[L.travel, pace * L.travel, y] for pace, y in ((2.0, L.y1), (1.0, L.y4))]
    with pytest.raises(CampaignError, match=r"time = \S+ s: \S+ m last \S+ s in day1\.csv"):
        two_files(tmp_path, [*clock, "y1 [mm]"], twice[0], [*clock, "y4 [mm]"], twice[1])()
    yawed = [np.where(L.travel > at, -0.042, 0.0) for at in (5.0, 6.0)]
    names = ["y1 [mm]", "yaw [deg]"], ["y4 [mm]", "yaw [deg]"]
    two_files(
        tmp_path,
        ["odometer [m]", *names[0]],
        [L.travel, L.y1, yawed[0]],
        ["way [m]", *names[1]],
        [L.travel, L.y4, yawed[1]],
    )
    files, columns = [tmp_path / "day1.csv", tmp_path / "day2.csv"], {"way [m]": {"role": "travel"}}
    with pytest.raises(CampaignError, match=r"yaw_at = .* day1\.csv shows the step at"):
        understand(read(files), MAPPING | {"columns": columns, "all_runs": {"tension": "10 N/mm2"}})


def test_of_two_copies_the_finer_one_counts_and_what_is_no_rounding_is_refused(tmp_path):
    header, first = ["travel [m]", "y1 [mm]"], [L.travel, np.round(L.y1, 4)]
    (run,) = two_files(tmp_path, header, first, header, [L.travel, np.round(L.y1, 1)])().complete().runs
    y = run.signals["y1"] - run.signals["y1"][0]
    assert np.abs(1e3 * y - (first[1] - first[1][0])).max() < 1e-3
    with pytest.raises(CampaignError, match="with other readings of y1"):
        two_files(tmp_path, header, first, header, [L.travel[::10], 1.004 * first[1][::10]])()
