"""Loggers in the field: codes for no reading, words for directions, odd scales, clocks, columns without a name."""

import io

import numpy as np
import pandas as pd
import pytest
import yaml
from logger_files import MAPPING, log, table, truth
from rich.console import Console
from rich.prompt import Confirm, Prompt

from belt_sim.api.campaigns import draft_text
from belt_sim.campaign import read_campaign
from belt_sim.commands.campaigns import ask_in_terminal
from belt_sim.diagnosis.foresight import find_doubts
from belt_sim.errors import BeltError
from belt_sim.importing import read, understand, write
from belt_sim.model import MODELS

RUN = {"tension": "10 N/mm2", "yaw": "-0.73 mrad"}
L = log(length=10.0)
NOISE = 0.12e-3  # m: six times the white noise of the records, after which no reading is a code


def campaign(path, **mapping):
    return understand(read([path], mapping.get("format")), MAPPING | {"all_runs": RUN} | mapping).complete()


@pytest.mark.parametrize("code", [-9999.0, 32767.0])
def test_a_code_for_no_reading_is_left_out_and_told(tmp_path, code):
    y1 = L.y1.copy()
    y1[[20, 21, 77]] = code
    path = tmp_path / "a.csv"
    path.write_text(table(["travel [m]", "y1 [mm]", "y4 [mm]"], [L.travel, y1, L.y4]))
    proposal = understand(read([path]), MAPPING | {"all_runs": RUN})
    (run,) = proposal.complete().runs
    assert np.isnan(run.signals["y1"]).sum() == 3
    assert any(f"{code:g} stands for no reading (line 22, 23, 79)" in n.text for n in proposal.notes)
    assert np.isfinite(run.signals["y4"]).all()
    kept = campaign(path, format={"missing": []}, spikes="keep").runs[0]
    assert abs(np.nanmax(np.abs(kept.signals["y1"]))) > 9.0  # m: the code as a reading, as asked for


def test_codes_that_are_stated_are_left_out_however_near_they_are(tmp_path):
    y1 = L.y1.copy()
    y1[[5, 6]] = 0.0
    path = tmp_path / "a.csv"
    path.write_text(table(["travel [m]", "y1 [mm]"], [L.travel, y1]))
    assert np.isnan(campaign(path, format={"missing": [0.0]}).runs[0].signals["y1"]).sum() == 2


@pytest.mark.parametrize(("word", "sign"), [("fwd", 1.0), ("rev", -1.0), ("vorwärts", 1.0), ("Rückwärts", -1.0)])
def test_directions_may_be_words(tmp_path, word, sign):
    path = tmp_path / "a.csv"
    columns = [L.travel, L.y1, [word] * len(L.travel)]
    path.write_text(table(["Weg [m]", "y1 [mm]", "Richtung"], columns, ";", ","), encoding="utf-8")
    assert campaign(path).runs[0].direction == sign


def test_factor_and_millidegrees(tmp_path):
    path = tmp_path / "a.csv"
    yaw = np.rad2deg(-0.73e-3) * 1e3  # millidegrees
    columns = [L.travel, L.y1 * 40.0, 0 * L.travel + yaw]
    path.write_text(table(["travel [m]", "y1 [mm]", "yaw [mdeg]"], columns))
    mapping = MAPPING | {"all_runs": {"tension": 10}, "columns": {"y1 [mm]": {"factor": 0.025}}}
    (run,) = understand(read([path]), mapping).complete().runs
    assert run.yaw == pytest.approx(-0.73e-3, rel=1e-3)
    assert np.abs(run.signals["y1"] - 1e-3 * truth(run.travel, -0.73, 1)).max() < NOISE


def test_clock_times_are_kept(tmp_path):
    for day in (12, 13):
        stamps = [f"2024-05-{day}T13:{int(t // 60):02d}:{t % 60:06.3f}" for t in L.time]
        columns = [stamps, 0 * L.time + 0.5, L.y1]
        (tmp_path / f"d{day}.csv").write_text(table(["Zeitstempel", "v [m/s]", "y1 [mm]"], columns))
    proposal = understand(read(sorted(tmp_path.glob("d*.csv"))), MAPPING | {"all_runs": RUN})
    write(proposal, tmp_path / "out")
    assert [r.started for r in read_campaign(tmp_path / "out").runs] == ["2024-05-12T13:00:00", "2024-05-13T13:00:00"]
    runs = (tmp_path / "out" / "runs.csv").read_text()
    (tmp_path / "out" / "runs.csv").write_text(runs.replace("2024-05-13T", "Monday "))
    with pytest.raises(BeltError, match=r"runs\.csv:3: started = Monday 13:00:00: write a date"):
        read_campaign(tmp_path / "out")


def test_a_column_says_where_on_the_belt_a_run_starts(tmp_path):
    for k, mark in enumerate((3.25, 17.5)):
        columns = [L.travel, L.y1, (L.travel + mark) % 23.0]
        (tmp_path / f"r{k}.csv").write_text(table(["travel [m]", "y1 [mm]", "Belt start [m]"], columns))
    logged = read(sorted(tmp_path.glob("r*.csv")))
    write(understand(logged, MAPPING | {"all_runs": RUN}), tmp_path / "out")
    assert [r.start for r in read_campaign(tmp_path / "out").runs] == [3.25, 17.5]
    stated = MAPPING | {"all_runs": RUN, "runs": {"r1": {"start": "1200 mm"}}}
    assert understand(logged, stated).complete().runs[1].start == pytest.approx(1.2)


def test_a_run_of_more_white_noise_is_told(tmp_path):
    for k, white in enumerate((0.02, 0.08, 0.02)):
        one = log(yaw=0.5 + k, white=white, seed=k)
        (tmp_path / f"r{k}.csv").write_text(table(["travel [m]", "y1 [mm]"], [one.travel, one.y1]))
    runs = {f"r{k}": {"yaw": f"{0.5 + k} mrad"} for k in range(3)}
    mapping = MAPPING | {"all_runs": {"tension": "10"}, "runs": runs, "step_m": "0.05"}
    proposal = understand(read(sorted(tmp_path.glob("r*.csv"))), mapping)
    doubts = find_doubts(proposal.complete(), MODELS["strip"], planned=True)
    (said,) = [d.sentence for d in doubts if d.kind == "noise"]
    assert "y1 scatters more in r1 (" in said


def test_a_unit_that_is_not_the_files_is_told(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("travel;y1\nm;mm\n" + table(["", ""], [L.travel, L.y1], ";").split("\n", 1)[1])
    mapping = MAPPING | {"all_runs": RUN, "columns": {"y1": {"unit": "um"}}}
    notes = [str(n) for n in understand(read([path]), mapping).notes]
    assert "y1: the file says mm, the mapping um; the mapping is taken" in notes


def test_a_yaw_without_a_place_is_told(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(table(["travel [m]", "EdgeTailUpper [mm]", "BandkanteAntriebOben [mm]"], [L.travel, L.y1, L.y4]))
    proposal = understand(read([path]), MAPPING | {"all_runs": RUN})
    assert {s.at for s in proposal.complete().signals} == {"point_1", "point_4"}  # words without blanks are read
    assert any("taken to act from the first reading on" in n.text for n in proposal.notes)
    stated = understand(read([path]), MAPPING | {"all_runs": RUN | {"yaw_at": "0 m"}})
    assert not any("first reading" in n.text for n in stated.notes)


def test_a_sensor_may_stand_inside_a_span(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(table(["travel [m]", "y1 [mm]", "Kanal 7"], [L.travel, L.y1, L.y4]))
    for at in ({"span": "lower", "distance": "2.5 m"}, "lower_span at 2.5 m"):
        proposal = understand(
            read([path]), MAPPING | {"all_runs": RUN, "columns": {"Kanal 7": {"at": at, "unit": "mm"}}}
        )
        assert [s.at for s in proposal.complete().signals] == ["point_1", "lower_span at 2.5 m"]
    write(proposal, tmp_path / "out")
    assert read_campaign(tmp_path / "out").signals[1].at == "lower_span at 2.5 m"
    with pytest.raises(BeltError, match=r"or \{span: upper"):
        understand(read([path]), MAPPING | {"columns": {"Kanal 7": {"at": "middle"}}})


STRANGE = table(["travel [m]", "y1 [mm]", "BK_US [mm]", "Kanal 7"], [L.travel, L.y1, L.y4, L.y4], ";", ",")


def test_a_draft_has_no_dead_end(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(STRANGE)
    logged = read([path])
    proposal = understand(logged, MAPPING | {"all_runs": RUN})
    assert [q.path[1] for q in proposal.unknown] == ["BK_US [mm]", "Kanal 7"]
    assert {s.name for s in proposal.complete().signals} == {"y1"}  # left out as long as nobody says
    text = draft_text(proposal)
    assert "BK_US [mm]: {at: null}" in text
    assert "upper span" in text  # where the points are
    draft = tmp_path / "draft.yaml"
    draft.write_text(text.replace("BK_US [mm]: {at: null}", "BK_US [mm]: {at: point_4}"))
    assert {s.at for s in understand(logged, draft).complete().signals} == {"point_1", "point_4"}
    draft.write_text(text.replace("BK_US [mm]: {at: null}", "BK_US [mm]: {role: ignore, at: point_4}"))
    with pytest.raises(BeltError, match=r"columns\.BK_US \[mm\]\.role = ignore: leave it out"):
        understand(logged, draft)


def test_the_dialogue_asks_for_every_unknown_column(tmp_path, monkeypatch):
    path = tmp_path / "a.csv"
    path.write_text(STRANGE)
    answers = iter(["4", "ignore"])
    monkeypatch.setattr(Prompt, "ask", lambda *a, **k: next(answers))
    monkeypatch.setattr(Confirm, "ask", lambda *a, **k: True)
    out = Console(file=io.StringIO(), width=200, highlight=False)
    proposal = ask_in_terminal(read([path]), MAPPING | {"all_runs": RUN}, out)
    assert {s.at for s in proposal.complete().signals} == {"point_1", "point_4"}
    said = out.file.getvalue()
    assert "where does the column BK_US [mm] measure?" in said  # its unit is no markup
    assert said.count("upper span") == 1
    assert proposal.unknown == ()


#: a date of each of ten runs, in a table of runs
DATES = {
    "days": [f"2026-03-{k:02d}" for k in range(1, 11)],
    "one_day": ["2026-03-01"] * 10,
    "date_and_clock": [f"01.03.2026 {8 + k // 2:02d}:{30 * (k % 2):02d}" for k in range(10)],
}


@pytest.mark.parametrize("dates", DATES.values(), ids=DATES)
def test_a_date_in_a_table_of_runs_is_no_time_axis(tmp_path, dates):
    names = [f"T{k}" for k in range(1, 11)]
    for name in names:
        (tmp_path / f"{name}.csv").write_text(table(["travel [m]", "y1 [mm]"], [L.travel, L.y1]))
    settings = [names, dates, ["10"] * 10, ["-0.042"] * 10]
    (tmp_path / "tests.csv").write_text(table(["Test", "Date", "Tension (MPa)", "Yaw (deg)"], settings, ";"))
    logged = read(sorted(tmp_path.glob("*.csv")))
    for mapping in (MAPPING, MAPPING | {"columns": {"Date": {"role": "ignore"}}}):
        found = understand(logged, mapping).complete()
        assert {run.name for run in found.runs} == {*names}
        assert found.title == "imported from T1.csv, T10.csv, T2.csv, T3.csv, T4.csv ..."


@pytest.mark.parametrize("minus", ["\u2212", "\u2013"])
def test_a_minus_of_typesetting_is_a_minus(tmp_path, minus):
    columns = [L.travel, L.y1, [f"{minus}0,042"] * len(L.travel)]
    path = tmp_path / f"lauf_10Nmm2_{minus}0,07grad.csv"
    path.write_text(table(["Weg [m]", "y1 [mm]", "Schwenkwinkel [°]"], columns, ";", ","), encoding="utf-8")
    mapping = MAPPING | {"all_runs": {"tension": "10"}}
    assert understand(read([path]), mapping).complete().runs[0].yaw == pytest.approx(np.deg2rad(-0.042), rel=1e-3)
    ignored = mapping | {"columns": {"Schwenkwinkel [°]": {"role": "ignore"}}}  # then the name of the file tells
    assert understand(read([path]), ignored).complete().runs[0].yaw == pytest.approx(np.deg2rad(-0.07))


#: header of a signal, its unit in a row of units -> the unit taken, "?unit" for one that is asked for, "?" where none
#: is stated
STATED = {
    "inch": ("Idler edge [in]", "", "in"), "mils": ("Edge tail (thou)", "", "mil"), "ft": ("Edge / ft", "", "ft"),
    "zoll": ("Kante in Zoll", "", "in"), "row": ("Kante", "in", "in"), "row_of_others": ("Kante", "V", "?V"),
    "kind": ("Edge [N]", "", "?N"), "no_name": ("Kanal 7 [cm]", "", "cm"), "second": ("Zeit 2 [mm]", "", "mm"),
    "volts": ("Edge [V]", "", "?V"), "parentheses": ("Edge (ells)", "", "?ells"), "by_in": ("Edge in ell", "", "?ell"),
    "slash": ("Kante / Elle", "", "?Elle"), "place": ("Kante (oben)", "", "?"), "remark": ("Edge (raw)", "", "?"),
    "sensor": ("Edge [CH 3]", "", "?"), "number": ("Edge [2]", "", "?"), "inward": ("Edge sensor in", "", "?"),
}  # fmt: skip


@pytest.mark.parametrize(("header", "row", "unit"), STATED.values(), ids=STATED)
def test_a_unit_that_is_stated_is_never_guessed(tmp_path, header, row, unit):
    path, units = tmp_path / "a.csv", f"s;{row};{row}\n" if row else ""
    text = table(["Zeit" if row else "Zeit [s]", header, header], [L.time, L.y1, L.y4], ";", ",")
    path.write_text(text.replace("\n", f"\n{units}", 1), encoding="utf-8")
    columns = {header: {"at": "point_1"}, f"{header} (b)": {"at": "point_4"}}
    proposal = understand(
        read([path]), MAPPING | {"all_runs": RUN | {"speed": "0.5"}, "columns": columns, "trust": {"y": "yes"}}
    )
    if unit.startswith("?"):
        assert [q.path for q in proposal.missing] == [("columns", name, "unit") for name in columns]
        said = f"states {unit[1:]} as the unit" if unit[1:] else "states no unit"
        assert all(said in q.text for q in proposal.missing)
        assert yaml.safe_load(draft_text(proposal))["columns"][header]["unit"] is None
    else:
        assert proposal.missing == ()
        assert all(u.unit == unit for u in proposal.columns[1:])


def test_a_unit_that_nobody_states_is_asked_for_whatever_the_size_of_the_numbers(tmp_path):
    """Guard: numbers that would be likely in one unit only were once taken to be in it."""
    path, draft = tmp_path / "a.csv", tmp_path / "draft.yaml"
    path.write_text(table(["travel", "y1"], [L.travel, L.y1]))
    logged = read([path])
    proposal = understand(logged, MAPPING | {"all_runs": RUN})
    assert [q.key for q in proposal.missing] == ["columns.travel.unit", "columns.y1.unit"]
    text = draft_text(proposal)
    assert "y1: {role: signal, at: point_1, name: y1, unit: null}" in text
    draft.write_text(text.replace("name: y1, unit: null", "name: y1, unit: mm").replace("unit: null", "unit: m"))
    again = understand(logged, draft)
    assert again.complete().runs[0].travel[-1] == pytest.approx(L.travel[-1])
    assert [u.why for u in again.columns] == ["the mapping"] * 2


@pytest.mark.parametrize("sign", [1, -1])
def test_where_the_belt_stood_across_the_pulleys_is_kept(tmp_path, sign):
    """What is taken off at the yaw is the belt's place: 158.6 mm on a sensor that reads 150 mm in the middle."""
    path = tmp_path / "a.csv"
    path.write_text(table(["travel [m]", "y1 [mm]"], [L.travel, sign * (L.y1 - L.y1[0]) + 158.6]))
    column = {"y1 [mm]": {"role": "signal", "at": "point_1", "middle": "150 mm", "sign": sign}}
    run = campaign(path, columns=column).runs[0]
    assert run.y0 == pytest.approx(sign * 8.6e-3, abs=NOISE)
    written = write(understand(read([path]), MAPPING | {"all_runs": RUN, "columns": column}), tmp_path / "c")
    assert written.runs[0].y0 == pytest.approx(run.y0)
    del column["y1 [mm]"]["middle"]
    proposal = understand(read([path]), MAPPING | {"all_runs": RUN, "columns": column})
    assert proposal.complete().runs[0].y0 is None
    assert any("middle" in n.text and "158" in n.text for n in proposal.notes)


def test_on_a_belt_that_runs_off_readings_count_from_the_yaw_not_from_the_mean_before_it(tmp_path):
    """One zero: the line through the last rows before the yaw, by which the checks and the diagnosis count too."""
    travel, rate, at = 0.1 * np.arange(121), 0.5, 6.0  # m, mm/m, m
    yaw = np.where(travel >= at, -0.73, 0.0)
    path = tmp_path / "a.csv"
    path.write_text(table(["travel [m]", "yaw [mrad]", "y1 [mm]"], [travel, yaw, rate * travel]))
    run = understand(read([path]), MAPPING | {"all_runs": {"tension": "10 N/mm2"}}).complete().runs[0]
    assert np.interp(run.yaw_at, run.travel, run.signals["y1"]) == pytest.approx(0.0, abs=1e-6)


def test_texts_where_a_name_tells_of_numbers_are_asked_about(tmp_path):
    path = tmp_path / "a.csv"
    texts = [f"{y:.3f}mm" for y in L.y1]
    path.write_text(
        table(["travel [m]", "edge 1 [mm]", "edge 4 [mm]", "note"], [L.travel, texts, L.y4, ["ok"] * len(texts)])
    )
    (question,) = understand(read([path]), MAPPING | {"all_runs": RUN}).missing
    assert question.key == "columns.edge 1 [mm].role"
    assert campaign(path, columns={"edge 1 [mm]": {"role": "ignore"}}).signals[0].at == "point_4"


def test_a_workbook_of_texts_with_decimal_commas_is_read(tmp_path):
    rows = [[f"{x:.4f}".replace(".", ",") for x in row] for row in zip(L.travel, L.y1, strict=True)]
    pd.DataFrame(rows, columns=["Weg [m]", "y1 [mm]"]).to_excel(tmp_path / "a.xlsx", index=False)
    assert campaign(tmp_path / "a.xlsx").runs[0].travel[-1] == pytest.approx(L.travel[-1])
