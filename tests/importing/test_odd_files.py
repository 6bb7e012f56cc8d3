# ruff: noqa: E501 (files as they are written)
"""Some forty odd files: every question has an answer that works, and the numbers that come out are those that were meant.

Each is the record of one run of 30 m at 10 N/mm2 and 0.5 m/s, one reading of y1 every metre, as one logger or another
would write it. Wrong readings of the same cells were once taken in silence, each with the word "sure".
"""

import sys
from datetime import datetime, timedelta

import numpy as np
import pytest
import yaml

from belt_sim.app.session import Import
from belt_sim.campaign import read_campaign
from belt_sim.commands.cli import run_command
from belt_sim.importing import read, understand, write
from belt_sim.importing.mapping import parse_mapping

S = np.arange(31.0)  # [m]
T = S / 0.5  # [s]
Y = -6.0 * (1.0 - np.exp(-S / 8.0))  # [mm]
GIVEN = {
    "machine": "test_rig",
    "belt": "paper_belt",
    "all_runs": {"tension": "10 N/mm2", "yaw": "-0.042 deg"},
    "columns": {},
}
START = datetime(2024, 5, 12, 23, 59, 30)


def stamps(pattern: str) -> list[str]:
    return [(START + timedelta(seconds=t)).strftime(pattern) for t in T]


def text(columns: dict[str, list], separator: str = ";") -> str:
    rows = zip(*columns.values(), strict=True)
    lines = [separator.join(columns), *(separator.join(str(c) for c in row) for row in rows)]
    return "\n".join([*lines, ""])


EDGE = {"edge 1 [mm]": [f"{y:.4f}" for y in Y]}
V = {"speed [mm/s]": ["500"] * 31}
TRAVEL = {"travel [m]": [f"{s:.1f}" for s in S]}
CLOCKS = {
    "us_date": "%m/%d/%Y %H:%M:%S", "us_dashes": "%m-%d-%Y %H:%M:%S", "german": "%d.%m.%Y %H:%M:%S",
    "british": "%d/%m/%Y %H:%M:%S", "iso": "%Y-%m-%d %H:%M:%S", "iso_t_z": "%Y-%m-%dT%H:%M:%SZ",
    "iso_zone": "%Y-%m-%dT%H:%M:%S+02:00", "iso_zone_short": "%Y-%m-%dT%H:%M:%S+0200", "slashes": "%Y/%m/%d %H:%M:%S",
    "am_pm": "%m/%d/%Y %I:%M:%S %p", "month_name": "%d-%b-%Y %H:%M:%S", "month_first": "%b %d, %Y %H:%M:%S",
    "dense": "%Y%m%dT%H%M%S", "clock": "%H:%M:%S", "clock_am_pm": "%I:%M:%S %p", "fractions": "%H:%M:%S.%f",
    "two_digits": "%m/%d/%y %H:%M:%S", "iso_fractions_z": "%Y-%m-%dT%H:%M:%S.%fZ",
}  # fmt: skip
#: name -> (the file, what its user answers)
FILES: dict[str, tuple[str, dict[str, str]]] = {
    name: (text({"time": stamps(p)} | V | EDGE), {"format.date": "mdy"}) for name, p in CLOCKS.items()
}
GROUPED = [f"{1e3 * (100 + y):,.0f}" for y in Y]
FILES |= {
    "one_date_us": (text({"time": [f"05/12/2024 10:{int(t) // 60:02d}:{int(t) % 60:02d}" for t in T]} | V | EDGE),
                    {"format.date": "mdy"}),
    "date_beside_clock": (text({"Date": stamps("%m/%d/%Y"), "Time": stamps("%H:%M:%S")} | V | EDGE), {"format.date": "mdy"}),
    "minutes_seconds": (text({"time": [f"{int(t) // 60:02d}:{int(t) % 60:02d}" for t in T]} | V | EDGE), {"format.time": "mm:ss"}),
    "days_to_seconds": (text({"time": [f"0:00:{int(t) // 60:02d}:{int(t) % 60:02d}" for t in T]} | V | EDGE), {"format.time": "d:hh:mm:ss"}),
    "hours_to_hundredths": (text({"time": [f"00:{int(t) // 60:02d}:{int(t) % 60:02d}:00" for t in T]} | V | EDGE), {"format.time": "hh:mm:ss:cc"}),
    "days_that_are_certain": (text({"time": [f"25:23:{58 + int(t) // 60:02d}:{int(t) % 60:02d}" for t in T]} | V | EDGE), {}),
    "hundredths_that_are_certain": (text({"time": [f"10:59:{int(t / 3):02d}:{int(100 * (t / 3)) % 100:02d}" for t in T], "speed [mm/s]": ["1500"] * 31} | EDGE), {}),
    "minutes_seconds_tenths": (text({"time": [f"{int(t) // 60:02d}:{t % 60:04.1f}" for t in T]} | V | EDGE), {}),
    "serial_days": (text({"time": [f"{45424.99 + t / 86400:.9f}" for t in T]} | V | EDGE), {"columns.time.unit": "d"}),
    "milliseconds": (text({"time": [f"{1e3 * t:.0f}" for t in T]} | V | EDGE), {"columns.time.unit": "ms"}),
    "epoch_milliseconds": (text({"time [ms]": [f"{1.7e12 + 1e3 * t:.0f}" for t in T]} | V | EDGE), {}),
    "thousands": (text(TRAVEL | {"edge 1 [um]": GROUPED}), {}),
    "thousands_of_speed": (text({"time [s]": [f"{t / 3:.0f}" for t in T]} | {"speed [mm/s]": ["1,500", "1,499", "1,501"] * 10 + ["1,500"],
                            "edge 1 [um]": [f"{1e3 * y:.0f}" for y in Y]}), {"format.decimal": "."}),
    "thousands_quoted": (text({"time [s]": [f"{t:.0f}" for t in T], "speed [mm/s]": ["500"] * 31,
                               "edge 1 [um]": [f'"{c}"' for c in GROUPED]}, ","), {"format.decimal": "."}),
    "points_of_thousands": (text({"travel [mm]": [f"{1e3 * s:,.0f}".replace(",", ".") for s in S], "edge 1 [mm]": [f"{y:.2f}".replace(".", ",") for y in Y]}), {}),
    "apostrophes": (text({"travel [mm]": [f"{1e3 * s:,.0f}".replace(",", "'") for s in S]} | EDGE), {}),
    "hundredths": (text(TRAVEL | {"edge 1 [0.01 mm]": [f"{100 * y:.2f}" for y in Y]}), {}),
    "fraction_of_a_mm": (text(TRAVEL | {"edge 1 [1/100 mm]": [f"{100 * y:.2f}" for y in Y]}), {}),
    "resolution": (text(TRAVEL | {"edge 1 [0.01 mm]": [f"{y:.2f}" for y in Y]}), {"columns.edge 1 [0.01 mm].unit": "mm"}),
    "set_and_actual": (text(TRAVEL | {"tension set [N/mm2]": ["12"] * 31, "tension actual [N/mm2]": ["10"] * 31} | EDGE), {}),
    "soll_ist": (text(TRAVEL | {"Bandzug Soll [N/mm2]": ["12"] * 31, "Bandzug Ist [N/mm2]": ["10"] * 31} | EDGE), {}),
    "left_and_right": (text(TRAVEL | {"load cell left [N]": ["300"] * 31, "load cell right [N]": ["300"] * 31} | EDGE), {"use.tension": "sum"}),
    "axle": (text(TRAVEL | {"axle load [kN]": ["1.2"] * 31} | EDGE), {"columns.axle load [kN].factor": "0.5"}),
    "both_strands": (text(TRAVEL | {"Bandzug gesamt [N]": ["1200"] * 31} | EDGE), {"columns.Bandzug gesamt [N].factor": "0.5"}),
    "line_load": (text(TRAVEL | {"tension [PLI]": [f"{10 * 0.3 * 25.4 / 4.4482216152605:.6f}"] * 31} | EDGE), {}),
    "newtons_a_millimetre": (text(TRAVEL | {"tension [N/mm]": ["3.0"] * 31} | EDGE), {}),
    "decanewtons": (text(TRAVEL | {"tension [daN]": ["60"] * 31} | EDGE), {}),
    "kiloponds": (text(TRAVEL | {"tension [kp]": [f"{600 / 9.80665:.7f}"] * 31} | EDGE), {}),
    "millipascal": (text(TRAVEL | {"tension [mPa]": ["10"] * 31} | EDGE), {"columns.tension [mPa].unit": "MPa"}),
    "no_unit_of_tension": (text(TRAVEL | {"tension": ["600"] * 31} | EDGE), {"columns.tension.unit": "N"}),
    "arc_minutes": (text(TRAVEL | {"yaw [arcmin]": ["-2.52"] * 31} | EDGE), {}),
    "odometer": (text({"odometer [m]": [f"{s:.1f}" for s in S]} | EDGE), {}),
    "four_of_one_name": (text(TRAVEL | {"edge [mm]": EDGE["edge 1 [mm]"]}).replace("edge [mm]", "edge [mm];edge [mm]", 1).replace("\n", ";0.5\n").replace(";edge [mm];0.5", ";edge [mm]"),
                         {"columns.edge [mm].at": "point_1", "columns.edge [mm] (b).at": "point_4"}),
    "numbered_sensors": (text(TRAVEL | {"S1 tail upper [mm]": EDGE["edge 1 [mm]"], "S4 head upper [mm]": ["0.1"] * 31}), {}),
    "a_thousandth_travel": (text({"travel [mm]": [f"{s:.1f}" for s in S]} | EDGE), {"columns.travel [mm].unit": "m"}),
    "a_thousand_times_y": (text(TRAVEL | {"edge 1 [mm]": [f"{1e3 * y:.1f}" for y in Y]}), {"columns.edge 1 [mm].unit": "um"}),
    "tension_too_small": (text(TRAVEL | {"tension [N/mm2]": ["0.01"] * 31} | EDGE), {"columns.tension [N/mm2].unit": "kN/mm2"}),
    "counter_set_back": (text({"odometer [m]": [f"{s + 100 if s < 12 else s - 12:.1f}" for s in S]} | EDGE), {"format.counter": "goes_on"}),
    "clock_set_back": (text({"time [s]": [f"{t if t < 30 else t - 30:.1f}" for t in T]} | V | EDGE), {"format.counter": "goes_on"}),
    "counter_sticks": (text({"time [s]": [f"{t:.1f}" for t in T], "travel [m]": [f"{s - 8 if s > 18 else min(s, 10):.1f}" for s in S]} | EDGE), {"format.standstill": "belt_ran"}),
    "counter_jumps_up": (text({"travel [m]": [f"{1500.0 if s == 12 else s:.1f}" for s in S]} | EDGE), {}),
    "counter_jumps_up_twice": (text({"travel [m]": [f"{45.0 if s in (7, 8, 20) else s:.1f}" for s in S]} | EDGE), {}),
    "counter_drops_out": (text({"travel [m]": [f"{0.0 if 9 < s < 13 else s:.1f}" for s in S]} | EDGE), {}),
    "total_in_the_last_row": (text(TRAVEL | EDGE) + f"{S.sum():.1f};{Y.sum():.4f}\n", {}),
    "stroke_of_the_yaw": (text(TRAVEL | {"yaw [mm]": ["-0.15"] * 31} | EDGE), {"columns.yaw [mm].factor": "4.887"}),
    "sign_in_the_header": (text(TRAVEL | {"edge 1 [mm] (positive to the right)": EDGE["edge 1 [mm]"]}), {"columns.edge 1 [mm] (positive to the right).sign": "-1"}),
    "fortran": (text(TRAVEL | {"edge 1 [mm]": [f"{y:.5E}".replace("E", "D") for y in Y]}), {}),
    "yards": (text({"travel (yd)": [f"{s / 0.9144:.4f}" for s in S]} | EDGE), {}),
    "accounting": (text(TRAVEL | {"edge 1 [mm]": [f"({-y:.4f})" for y in Y]}), {}),
    "minus_behind": (text(TRAVEL | {"edge 1 [mm]": [f"{-y:.4f}-" for y in Y]}), {}),
    "full_width": (text(TRAVEL | EDGE).translate({ord(c): ord(c) + 0xFEE0 for c in "0123456789.-"}), {}),
    "row_names": ("travel [m]\tedge 1 [mm]\n" + "".join(f"{k}\t{s:.1f}\t{y:.4f}\n" for k, (s, y) in enumerate(zip(S, Y, strict=True), 1)), {}),
    "hour_24": (text({"time": ["24:00:00" if c == "00:00:00" else c for c in stamps("%H:%M:%S")]} | V | EDGE), {}),
    "blank_behind_the_sign": (text(TRAVEL | {"edge 1 [mm]": [f"- {-y:.4f}" for y in Y]}), {}),
    "comment_between": (text(TRAVEL | EDGE).replace("\n12.0;", "\n# pause\n12.0;"), {}),
}  # fmt: skip


def nested(key: str, answer: str) -> dict:
    """{a: {b: answer}} of a.b; the middle of columns.NAME.unit may hold dots."""
    first, _, rest = key.partition(".")
    middle, _, last = rest.rpartition(".")
    return {first: {middle: {last: answer}} if middle else {last: answer}}


def merge(a: dict, b: dict) -> dict:
    return {
        k: merge(a[k], b[k]) if k in a and k in b and isinstance(a[k], dict) else b.get(k, a.get(k)) for k in {**a, **b}
    }


def given_for(name: str) -> dict:
    settings = {"tension": "10 N/mm2", "yaw": "-0.042 deg"}
    header = FILES[name][0].split("\n")[0].lower()
    logged = {"tension": ("tension", "load cell", "bandzug", "axle"), "yaw": ("yaw",)}
    own = {k: v for k, v in settings.items() if not any(w in header for w in logged[k])}
    return GIVEN | {"all_runs": own}


@pytest.mark.parametrize("name", FILES)
def test_every_question_of_an_odd_file_has_an_answer_that_works(name, tmp_path):
    content, answers = FILES[name]
    (tmp_path / "a.csv").write_text(content, encoding="utf-8")
    given = parse_mapping(yaml.safe_dump(given_for(name), allow_unicode=True), "mapping.yaml").tree
    made, asked = Import([tmp_path / "a.csv"], given), list[str]()
    while made.proposal.missing:
        question = made.proposal.missing[0]
        assert question.key not in asked, question.text
        asked.append(question.key)
        written = yaml.safe_load(str(question.problem).rpartition("give it as  ")[2])  # what the question proposes
        for key in question.path:
            written = written[key]
        made.note(question.path, answers.get(question.key, str(written)))
        made.understand()
        assert not made.errors
    assert set(answers) - set(asked) <= {"format.date"}, asked
    assert not made.lacks
    first = write(made.proposal, tmp_path / "c").runs[0]
    assert first.tension == pytest.approx(10e6, rel=2e-3)
    assert first.yaw == pytest.approx(-7.33e-4, rel=2e-3)
    assert first.travel[-1] == pytest.approx(30.0, rel=2e-3)
    assert np.ptp(first.signals["y1"]) == pytest.approx(1e-3 * np.ptp(Y), rel=0.02)
    if name in CLOCKS and "clock" not in name and name != "fractions":
        assert first.started.startswith("2024-05-12T23:59:30")


@pytest.mark.parametrize("name", ["left_and_right", "days_to_seconds"])
def test_the_command_asks_until_the_answers_are_in_its_mapping(name, tmp_path, monkeypatch, capsys):
    content, answers = FILES[name]
    (tmp_path / "a.csv").write_text(content, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["belt-sim"])
    command, mapping = (
        ["import", "a.csv", "mapping=m.yaml", "out=c", "pictures=false", "hydra.run.dir=run"],
        given_for(name),
    )
    for _ in range(4):
        (tmp_path / "m.yaml").write_text(yaml.safe_dump(mapping, allow_unicode=True))
        if run_command(command) == 0:
            break
        lines = [line for line in capsys.readouterr().err.splitlines() if "give it as" in line]
        written = yaml.safe_load(lines[0].rpartition("give it as  ")[2])
        key = lines[0].split("mapping: ")[1].split(": ")[0]
        mapping = merge(mapping, nested(key, answers[key]) if key in answers else written)
    assert read_campaign(tmp_path / "c").runs[0].travel[-1] == pytest.approx(30.0, rel=2e-3)


FINE, FINE_T = np.arange(0.0, 30.05, 0.1), np.arange(0.0, 60.1, 0.2)  # [m], [s], of the same run


def fine(travel, time, s=FINE) -> str:
    """The file of a logger that writes every 0.1 m; s [m]: the belt's true travel."""
    edge = [f"{y:.4f}" for y in -6.0 * (1.0 - np.exp(-s / 8.0))]
    return text(
        {"time [s]": [f"{t:.2f}" for t in time], "travel [m]": [f"{x:.5f}" for x in travel], "edge 1 [mm]": edge}
    )


@pytest.mark.parametrize("row", [3e-6, 1e-4], ids=["3 um a row", "0.1 mm a row"])
def test_a_counter_that_creeps_while_the_belt_runs_is_one_stretch_and_asked_about(row, tmp_path):
    lost = np.clip(FINE - 10.0, 0.0, 10.0)
    (tmp_path / "a.csv").write_text(fine(FINE - lost * (1.0 - row / 0.1), FINE_T), encoding="utf-8")
    logged = read([tmp_path / "a.csv"])
    (question,) = understand(logged, GIVEN).missing
    assert question.key == "format.standstill"
    assert "creeps on by" in question.text
    made = understand(logged, GIVEN | {"format": {"standstill": "belt_ran"}})
    assert made.campaign.runs[0].travel[-1] == pytest.approx(30.0, abs=0.2)
    assert made.campaign.runs[0].speed == pytest.approx(0.5, rel=0.01)
    assert sum("carried on at 0.5 m/s" in n.text for n in made.notes) == 1


def test_the_speed_of_a_belt_that_stood_for_a_while_is_that_at_which_it_ran(tmp_path):
    s = np.concatenate([FINE[:150], np.full(100, FINE[150]), FINE[150:]])
    (tmp_path / "a.csv").write_text(fine(s, 0.2 * np.arange(len(s)), s), encoding="utf-8")
    (run,) = understand(read([tmp_path / "a.csv"]), GIVEN).campaign.runs
    assert run.speed == pytest.approx(0.5, rel=1e-3)


def test_several_stands_are_one_question(tmp_path):
    counted = FINE - np.clip(FINE - 5.0, 0.0, 4.0) - np.clip(FINE - 15.0, 0.0, 4.0)
    (tmp_path / "a.csv").write_text(fine(counted, FINE_T), encoding="utf-8")
    assert [q.key for q in understand(read([tmp_path / "a.csv"]), GIVEN).missing] == ["format.standstill"]


STUCK = {
    "and_goes_on_from_there": lambda s: np.where(s > 18, s - 8, np.minimum(s, 10)),
    "and_catches_up": lambda s: np.where((s > 10) & (s < 18), 10, s),
    "to_the_end": lambda s: np.minimum(s, 20),
}


@pytest.mark.parametrize("how", STUCK)
def test_a_counter_that_sticks_while_the_belt_runs_is_asked_about_and_carried_on(how, tmp_path):
    """The belt's true travel is S: by the answer, or by a speed that was logged; one that stood is told, not asked."""
    travel, name = STUCK[how](S), "travel [m]"
    table = {"time [s]": [f"{t:.0f}" for t in T], name: [f"{s:.1f}" for s in travel]} | EDGE
    (tmp_path / "a.csv").write_text(text(table), encoding="utf-8")
    logged = read([tmp_path / "a.csv"])
    (question,) = understand(logged, GIVEN).missing
    assert question.key == "format.standstill"
    (told,) = understand(logged, GIVEN | {"format": {"standstill": "belt_ran"}}).campaign.runs
    assert told.travel == pytest.approx(S)
    stood = understand(logged, GIVEN | {"format": {"standstill": "belt_stood"}})
    assert "one row is left, their mean" in " ".join(n.text for n in stood.notes)
    for speed, ends in (("0.5", 30.0), ("0.0", float(travel[-1]))):
        speeds = np.where(np.gradient(travel) > 0, "0.5", speed)
        (tmp_path / "b.csv").write_text(text(table | {"speed [m/s]": speeds}), encoding="utf-8")
        (run,) = understand(read([tmp_path / "b.csv"]), GIVEN).campaign.runs
        assert run.travel[-1] == pytest.approx(ends)
    at_rest = table | {"edge 1 [mm]": [f"{y:.4f}" for y in -6.0 * (1.0 - np.exp(-travel / 8.0))]}
    (tmp_path / "c.csv").write_text(text(at_rest), encoding="utf-8")
    assert understand(read([tmp_path / "c.csv"]), GIVEN).missing == ()
