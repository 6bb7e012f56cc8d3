"""Whatever a logger writes, the same campaign comes out."""

import numpy as np
import pytest
from logger_files import MAPPING, log, table, truth

from belt_sim.campaign import read_campaign
from belt_sim.importing import read, understand, write

RUN = {"tension": "10 N/mm2", "yaw": "-0.73 mrad"}
L = log()


def plain() -> bytes:
    return table(["travel [m]", "y1 [mm]", "y4 [mm]"], [L.travel, L.y1, L.y4]).encode()


def german() -> bytes:
    text = table(["Bandweg (m)", "Kante Umlenk oben (mm)", "Kante Antrieb oben (mm)"], [L.travel, L.y1, L.y4], ";", ",")
    return ("Gerät: Logger Ä7\nSeriennummer;4711\n\n" + text).encode("cp1252")


def timed() -> bytes:
    return table(
        ["Zeit [s]", "v [m/min]", "y1 [mm]", "y4 [mm]"], [L.time, 0 * L.time + 30.0, L.y1, L.y4], "\t"
    ).encode()


def units_row() -> bytes:
    text = table(["t", "v", "y1", "y4"], [1e3 * L.time, 0 * L.time + 500, 1e3 * L.y1, 1e3 * L.y4], ";", ",", 1)
    return text.replace("\n", "\nms;mm/s;µm;µm\n", 1).encode("utf-8-sig")


def clock() -> bytes:
    clocks = [f"13:{int(t // 60):02d}:{t % 60:06.3f}".replace(".", ",") for t in L.time]
    header = ["Zeitstempel", "Geschwindigkeit [m/s]", "y1 [mm]", "y4 [mm]"]
    columns = [[f"12.05.2024 {c}" for c in clocks], 0 * L.time + 0.5, L.y1, L.y4]
    return table(header, columns, ";", ",").encode()


def utf16() -> bytes:
    return table(["travel [m]", "y1 [mm]", "y4 [mm]"], [L.travel, L.y1, L.y4], "\t", ",").encode("utf-16")


def utf16_bare() -> bytes:
    return table(["travel [m]", "y1 [mm]", "y4 [mm]"], [L.travel, L.y1, L.y4], "\t", ",").encode("utf-16-le")


def quoted() -> bytes:
    return table(['"travel [m]"', '"y1, edge [mm]"', '"y4, edge [mm]"'], [L.travel, L.y1, L.y4], ",").encode()


def blanks() -> bytes:
    return table(["travel_m", "y1_mm", "y4_mm"], [L.travel, L.y1, L.y4], "  ").encode()


def windows() -> bytes:
    text = table(["travel [m]", "y1 [mm]", "y4 [mm]"], [L.travel, L.y1, L.y4], ";", ",")
    return text.replace("\n", ";\r\n").encode()  # every line ends with a separator


def backwards() -> bytes:
    return table(["Weg [mm]", "y1 [mm]", "y4 [mm]"], [7e4 - 1e3 * L.travel, L.y1, L.y4], ";").encode()


def date_and_clock() -> bytes:
    clocks = [
        f"{(23 + int(t + 3590) // 3600) % 24:02d}:{int(t + 3590) // 60 % 60:02d}:{(t + 3590) % 60:06.3f}"
        for t in L.time
    ]
    dates = ["31.12.2024" if t < 10.0 else "01.01.2025" for t in L.time]  # over midnight
    columns = [dates, [c.replace(".", ",") for c in clocks], 0 * L.time + 0.5, L.y1, L.y4]
    return table(["Datum", "Uhrzeit", "v [m/s]", "y1 [mm]", "y4 [mm]"], columns, ";", ",").encode()


def commas_in_quotes() -> bytes:
    columns = [[f'"{x:.4f}"'.replace(".", ",") for x in c] for c in (L.travel, L.y1, L.y4)]
    return table(['"Weg [m]"', '"y1 [mm]"', '"y4 [mm]"'], columns, ",").encode()


def told_to_excel() -> bytes:
    return b"sep=;\n" + table(["Weg [m]", "y1 [mm]", "y4 [mm]"], [L.travel, L.y1, L.y4], ";", ",").encode()


FORMATS = [plain, german, timed, units_row, clock, utf16, utf16_bare, quoted, blanks, windows, backwards]
FORMATS += [date_and_clock, commas_in_quotes, told_to_excel]


@pytest.mark.parametrize("make", FORMATS, ids=lambda f: f.__name__)
def test_every_format_gives_the_same_campaign(make, tmp_path):
    file = tmp_path / "Lauf Nr. 1 schräg.csv"
    file.write_bytes(make())
    proposal = understand(read([file]), MAPPING | {"all_runs": RUN})
    assert proposal.missing == ()
    campaign = write(proposal, tmp_path / "campaign")
    assert [s.at for s in campaign.signals] == ["point_1", "point_4"]
    (run,) = campaign.runs
    assert run.travel[0] == 0.0
    assert run.travel[-1] == pytest.approx(L.travel[-1], abs=0.06)
    for name, point in (("y1", 1), ("y4", 4)):
        expected = truth(run.travel, -0.73, point) * 1e-3
        assert np.abs(run.signals[name] - expected).max() < 0.12e-3
    assert run.direction == (-1.0 if make is backwards else 1.0)


def test_a_workbook_with_a_sheet_a_run(tmp_path):
    import openpyxl

    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, yaw in (("10 Nmm2 rechts", -0.73), ("10 Nmm2 links", 0.73)):
        sheet, own = book.create_sheet(name), log(yaw)
        sheet.append(["Prüfstand 3"])
        sheet.append([])
        sheet.append(["Weg [m]", "Kante 1 [mm]", "Kante 4 [mm]", "Bemerkung"])
        for row in zip(own.travel, own.y1, own.y4, strict=True):
            sheet.append([*map(float, row), None])
    notes = book.create_sheet("Notizen")
    notes.append(["nur Text"])
    book.save(tmp_path / "läufe.xlsx")
    runs = {"r10 Nmm2 rechts": {"yaw": "-0.73 mrad"}, "r10 Nmm2 links": {"yaw": "0.73 mrad"}}
    campaign = write(understand(read([tmp_path / "läufe.xlsx"]), MAPPING | {"runs": runs}), tmp_path / "out")
    assert [r.tension for r in campaign.runs] == [10e6, 10e6]  # from the names of the sheets
    assert campaign.runs[0].signals["y1"][-1] == pytest.approx(-campaign.runs[1].signals["y1"][-1], abs=2e-4)


def test_all_runs_in_one_file_with_the_settings_in_a_table_of_their_own(tmp_path):
    logs = {"1": log(-0.73, seed=1), "2": log(0.73, seed=2), "3": log(-0.73, seed=3)}
    columns = [[n for n, own in logs.items() for _ in own.time]]
    columns += [np.concatenate([getattr(own, k) for own in logs.values()]) for k in ("travel", "y1", "y4")]
    (tmp_path / "all.csv").write_text(table(["Lauf", "Weg [m]", "y1 [mm]", "y4 [mm]"], columns, ";", ","))
    plan = "Lauf;Bandzug [N];Winkel [mrad];v [m/s]\n1;600;-0,73;0,5\n2;600;0,73;0,5\n3;600;-0,73;0,5\n"
    (tmp_path / "plan.csv").write_text(plan)
    proposal = understand(read([tmp_path / "all.csv", tmp_path / "plan.csv"]), MAPPING)
    assert [q.key for q in proposal.missing] == []
    campaign = write(proposal, tmp_path / "out")
    assert [r.name for r in campaign.runs] == ["r1", "r2", "r3"]
    assert campaign.runs[0].tension == pytest.approx(10e6)  # 600 N over 200 x 0.3 mm2
    assert campaign.runs[2].repeat_of == "r1"
    assert campaign.signals[0].white == pytest.approx(0.02e-3, rel=0.2)


@pytest.mark.parametrize("header_again", [False, True])
def test_runs_one_below_the_other(tmp_path, header_again):
    a, b = log(-0.73, seed=1), log(0.73, seed=2)
    one, two = (table(["Weg [m]", "y1 [mm]", "y4 [mm]"], [x.travel, x.y1, x.y4], ";", ",") for x in (a, b))
    (tmp_path / "x.csv").write_text(one + (two if header_again else two.split("\n", 1)[1]))
    runs = {"x_1": RUN, "x_2": RUN | {"yaw": "0.73 mrad"}}
    campaign = write(understand(read([tmp_path / "x.csv"]), MAPPING | {"runs": runs}), tmp_path / "out")
    assert [r.name for r in campaign.runs] == ["x_1", "x_2"]
    assert campaign.runs[1].signals["y1"][-1] > 0.0 > campaign.runs[0].signals["y1"][-1]


def test_a_thousand_hertz_are_averaged_and_it_says_so(tmp_path):
    own = log(spacing=0.0005, length=20.0)  # 1 kHz at 0.5 m/s
    columns = [own.time, 0 * own.time + 0.5, own.y1, own.y4]
    (tmp_path / "fast.csv").write_text(table(["time [s]", "speed [m/s]", "y1 [mm]", "y4 [mm]"], columns))
    proposal = understand(read([tmp_path / "fast.csv"]), MAPPING | {"all_runs": RUN})
    assert any("averaged over steps of 0.05 m" in n.text for n in proposal.notes)
    campaign = write(proposal, tmp_path / "out")
    assert 350 < len(campaign.runs[0].travel) <= 402
    assert campaign.signals[0].white == pytest.approx(0.02e-3 / 10.0, rel=0.25)  # a hundred rows a step


def test_the_import_can_be_repeated_from_the_mapping_that_it_leaves(tmp_path):
    (tmp_path / "a.csv").write_bytes(german())
    first = write(understand(read([tmp_path / "a.csv"]), MAPPING | {"all_runs": RUN}), tmp_path / "one")
    again = understand(read([tmp_path / "a.csv"]), tmp_path / "one" / "mapping.yaml")
    second = write(again, tmp_path / "two")
    assert first.sha256 == second.sha256
    assert read_campaign(tmp_path / "two").sha256 == first.sha256


def test_yaw_and_tension_are_read_off_columns_and_the_record_may_begin_before_the_yaw(tmp_path):
    own = log(length=35.0)
    before = own.travel < 5.0
    rng = np.random.default_rng(1)
    y1 = 103.2 + truth(own.travel - 5.0, -0.73, 1) + 0.01 * rng.standard_normal(len(own.travel))
    yaw = np.where(before, 0.0, -0.73) + 0.001 * rng.standard_normal(len(own.travel))
    columns = [own.travel, y1, yaw, 10.0 + 0.05 * rng.standard_normal(len(own.travel))]
    header = ["Weg [m]", "Kante 1 [mm]", "Schwenkwinkel [mrad]", "Bandspannung [N/mm²]"]
    (tmp_path / "a.csv").write_text(table(header, columns, ";", ","), encoding="utf-8")
    campaign = write(understand(read([tmp_path / "a.csv"]), MAPPING), tmp_path / "out")
    (run,) = campaign.runs
    assert run.yaw_at == pytest.approx(5.0, abs=0.06)
    assert run.yaw == pytest.approx(-0.73e-3, rel=0.01)
    assert run.tension == pytest.approx(10e6, rel=0.01)
    settled = run.travel < 4.9
    assert abs(np.mean(run.signals["y1"][settled])) < 5e-6


def test_a_column_that_is_named_otherwise_is_asked_for_and_answered(tmp_path):
    (tmp_path / "a.csv").write_text(table(["Kanal 1", "Kanal 2"], [L.time, L.y1], ";", ","))
    logged = read([tmp_path / "a.csv"])
    columns = {"Kanal 1": {"role": "time", "unit": "s"}}
    asked = [understand(logged, MAPPING | {"all_runs": RUN, "columns": c}).missing for c in ({}, columns)]
    assert [q.key for q in asked[0]] == ["columns.Kanal 1.role", "columns.Kanal 2.at"]
    assert [q.key for q in asked[1]] == ["columns.Kanal 2.at", "all_runs.speed"]
    columns["Kanal 2"] = {"at": "point_1", "unit": "mm", "sign": -1}
    answers = {"all_runs": RUN | {"speed": "30 m/min"}, "columns": columns}
    campaign = write(understand(logged, MAPPING | answers), tmp_path / "out")
    assert campaign.runs[0].travel[-1] == pytest.approx(L.travel[-1], abs=0.06)
    assert campaign.runs[0].signals["y1"][-1] == pytest.approx(-truth(L.travel, -0.73, 1)[-1] * 1e-3, abs=1e-4)


def test_a_number_that_begins_with_nought_has_no_thousands(tmp_path):
    """0,042 shows a decimal comma, so that 1.000 ms after 500 is a second and time does not run backwards."""
    shown = [[f"{x:,.0f}".replace(",", ".") for x in 1e3 * values] for values in (L.time, L.y1 + 100.0, L.y4 + 50.0)]
    yaw = ["-0,042"] * len(L.time)
    header = ["Zeit [ms]", "v [mm/s]", "Schwenkwinkel [°]", "Kante 1 [µm]", "Kante 4 [µm]"]
    text = table(header, [shown[0], ["500"] * len(yaw), yaw, *shown[1:]], ";", ",")
    (tmp_path / "a.csv").write_text(text)
    columns = {name: {"at": f"point_{name[6]}"} for name in header[3:]}
    run = understand(read([tmp_path / "a.csv"]), MAPPING | {"all_runs": {"tension": "10 N/mm2"}, "columns": columns})
    (run,) = run.complete().runs
    assert np.degrees(run.yaw) == pytest.approx(-0.042)
    assert run.time[-1] == pytest.approx(L.time[-1], abs=1.0)


def test_days_of_stamps_are_seconds_whatever_their_size(tmp_path):
    from datetime import datetime, timedelta

    import openpyxl

    book = openpyxl.Workbook()
    book.active.append(["Zeitstempel", "y1 [mm]"])
    for k in range(200):
        book.active.append([datetime(2024, 5, 1) + timedelta(hours=k), 0.01 * k])
    book.save(tmp_path / "a.xlsx")
    column = read([tmp_path / "a.xlsx"])[0].columns[0]
    assert (column.role, column.unit) == ("time", "s")
    assert np.diff(column.values) == pytest.approx(3600.0)


def test_a_run_whose_column_is_called_otherwise_is_named(tmp_path):
    for name, edge in (("a", "y4 [mm]"), ("b", "Kante 9")):
        made = log(length=5.0)
        (tmp_path / f"{name}.csv").write_text(table(["travel [m]", "y1 [mm]", edge], [made.travel, made.y1, made.y4]))
    stated = {"columns": {"y1 [mm]": {"at": "point_1"}, "y4 [mm]": {"at": "point_4"}, "Kante 9": {"role": "ignore"}}}
    runs = {"a": {"tension": "10", "yaw": "-0.042"}, "b": {"tension": "20", "yaw": "-0.042"}}
    proposal = understand(read(sorted(tmp_path.glob("*.csv"))), MAPPING | stated | {"runs": runs})
    said = [str(n) for n in proposal.notes if "which other runs have" in n.text]
    assert said == ["b: has no y4, which other runs have; is its column called otherwise there?"]
