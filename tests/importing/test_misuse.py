"""What cannot be imported says where, what and what to do, in one line, and leaves nothing behind."""

import numpy as np
import pytest
from logger_files import MAPPING, log, table

from belt_sim.errors import BeltError
from belt_sim.importing import read, understand, write
from belt_sim.importing.mapping import mapping_of

RUN = {"tension": "10", "yaw": "-0.042"}
L = log(length=5.0)
GOOD = table(["travel [m]", "y1 [mm]", "y4 [mm]"], [L.travel, L.y1, L.y4], ";", ",")
LINES = GOOD.splitlines()


def changed(line: int, text: str) -> bytes:
    return "\n".join([*LINES[: line - 1], text, *LINES[line:], ""]).encode()


TIMED = table(["time [s]", "v [m/s]", "y1 [mm]"], [L.time, 0 * L.time + 0.5, L.y1]).splitlines()


def timed(line: int, text: str) -> bytes:
    return "\n".join([*TIMED[: line - 1], text, *TIMED[line:], ""]).encode()


#: name -> (content, words that the message must hold)
BROKEN = {
    "empty": (b"", ["is empty"]),
    "only_a_mark": (b"\xef\xbb\xbf", ["is empty"]),
    "binary": (bytes(range(256)) * 40, ["binary", "export"]),
    "binary_later": (GOOD.encode() + b"\0\0\1\2", ["binary", ":102"]),
    "old_excel": (b"\xd0\xcf\x11\xe0" + b"\1" * 600, [".xls", "save it as .xlsx"]),
    "no_workbook": (b"PK\x03\x04" + b"\1" * 600, ["no Excel workbook"]),
    "picture": (b"\x89PNG\r\n" + b"\1" * 600, ["a picture"]),
    "prose": (b"Dear all,\nplease find the data in the other file.\n" * 9, ["no table of numbers"]),
    "header_only": (b"a;b;c\n", ["no table"]),
    "ragged": (changed(40, "1,95;103,2"), ["a.csv:40", "cells = 2", "3"]),
    "too_many": (changed(40, "1,95;103,2;48;7"), ["a.csv:40", "cells = 4"]),
    "mixed_marks": (changed(40, "1,95;103.2;48,1"), ["a.csv:40", "103.2", "decimal marks are mixed"]),
    "word": (changed(40, "1,95;kaputt;48,1"), ["a.csv:40", "y1 [mm] = kaputt", "no number"]),
    "travel_back": (changed(40, "0,95;103,2;48,1"), ["a.csv:40", "travel runs backwards", "cut the record"]),
    "time_back": (timed(40, "2.1,0.5,103.2"), ["a.csv:40", "time runs backwards"]),
    "reversal": (timed(40, TIMED[39].replace("0.5000", "-0.5")), ["a.csv:40", "reverses within a run"]),
    "stands_still": (table(["time [s]", "v [m/s]", "y1 [mm]"], [L.time, 0 * L.time, L.y1]).encode(), ["stands still"]),
    **{
        name: (
            table(
                ["Weg [m]", "y1 [mm]", "yaw [mrad]"],
                [L.travel, L.y1, np.select([L.travel < 1, L.travel < 2, L.travel < 3], yaws[:3], yaws[3])],
            ).encode(),
            ["moves more than once", "cut the record into runs"],
        )
        for name, yaws in {
            "two_yaws": (0.0, 0.7, 0.0, 0.7),
            "yaw_and_back": (0.0, 0.7, 0.7, 0.0),
            "yaw_both_ways": (0.0, -0.7, -0.7, 0.7),
        }.items()
    },
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_file_that_cannot_be_read_is_refused_in_one_line(name, tmp_path):
    content, words = BROKEN[name]
    file = tmp_path / "a.csv"
    file.write_bytes(content)
    settings = RUN if "yaw" not in name else {"tension": "10"}
    with pytest.raises(BeltError) as error:
        write(understand(read([file]), MAPPING | {"all_runs": settings}), tmp_path / "out")
    message = str(error.value)
    assert message.count("\n") == 0
    assert "a.csv" in message
    for word in words:
        assert word in message
    assert [p.name for p in tmp_path.iterdir()] == ["a.csv"]


def test_blank_cells_and_words_for_nothing_are_left_out(tmp_path):
    lines = list(LINES)
    for k, nothing in enumerate(["", "NaN", "---", "#NV", "n/a"]):
        lines[10 + k] = ";".join([lines[10 + k].split(";")[0], nothing, "48,1"])
    (tmp_path / "a.csv").write_text("\n".join(lines))
    campaign = write(understand(read([tmp_path / "a.csv"]), MAPPING | {"all_runs": RUN}), tmp_path / "out")
    (run,) = campaign.runs
    assert np.isnan(run.signals["y1"]).sum() == 5
    assert np.isfinite(run.signals["y4"]).all()


def test_a_last_line_that_is_cut_short_is_left_out_and_told(tmp_path):
    (tmp_path / "a.csv").write_text("\n".join([*LINES[:-1], "4,9"]))
    proposal = understand(read([tmp_path / "a.csv"]), MAPPING | {"all_runs": RUN})
    assert any("line 101 is cut short" in n.text for n in proposal.notes)
    assert len(proposal.complete().runs[0].travel) == len(L.travel) - 1


def test_a_header_that_stands_there_twice(tmp_path):
    (tmp_path / "a.csv").write_text("\n".join([LINES[0], *LINES]))
    assert len(understand(read([tmp_path / "a.csv"]), MAPPING | {"all_runs": RUN}).complete().runs) == 1


def test_columns_of_one_name_are_told_apart(tmp_path):
    (tmp_path / "a.csv").write_text(table(["travel [m]", "y [mm]", "y [mm]"], [L.travel, L.y1, L.y4]))
    logged = read([tmp_path / "a.csv"])
    assert [c.name for c in logged[0].columns] == ["travel [m]", "y [mm]", "y [mm] (b)"]
    proposal = understand(logged, MAPPING | {"all_runs": RUN})
    assert [q.key for q in proposal.missing] == ["columns.y [mm].at", "columns.y [mm] (b).at"]
    places = {"y [mm]": {"at": "point_1"}, "y [mm] (b)": {"at": "point_4"}}
    campaign = understand(logged, MAPPING | {"all_runs": RUN, "columns": places}).complete()
    assert [s.name for s in campaign.signals] == ["y1", "y4"]


def test_what_is_missing_is_named_with_how_to_give_it(tmp_path):
    (tmp_path / "a.csv").write_text(GOOD)
    proposal = understand(read([tmp_path / "a.csv"]))
    with pytest.raises(BeltError) as error:
        write(proposal, tmp_path / "out")
    lines = str(error.value).splitlines()
    assert len(lines) == len(proposal.missing) == 8
    assert any("runs.a.yaw" in line and "give it as  runs: {a: {yaw: -0.042 deg}}" in line for line in lines)
    assert not (tmp_path / "out").exists()


WRONG = {
    "unknown_column": ({"columns": {"y9": {"at": "point_1"}}}, ["columns.y9", "no file has such a column"]),
    "unknown_key": ({"machin": "test_rig"}, ["machin", "did you mean machine?"]),
    "unknown_number": ({"belt": {"widht": "0.2 m"}}, ["mapping: belt.widht: unknown key; did you mean width?"]),
    "neither_name_nor_numbers": ({"machine": 3}, ["mapping: machine = 3: give a name, or a mapping of numbers"]),
    "unknown_role": ({"columns": {"y1 [mm]": {"role": "tim"}}}, ["did you mean time?"]),
    "unknown_place": ({"columns": {"y1 [mm]": {"at": "point1"}}}, ["did you mean point_1?"]),
    "unit_of_another_kind": ({"columns": {"y1 [mm]": {"unit": "s"}}}, ["columns.y1 [mm].unit = s", "mm"]),
    "unknown_rig": ({"machine": "my_rig"}, ["machine = my_rig", "test_rig"]),
    "unknown_run": ({"runs": {"b": RUN}}, ["runs.b", "no file has such a run; use one of a"]),
    "tension_too_large": ({"runs": {"a": {"tension": "10 GPa"}}}, ["runs.a.tension = 10 GPa", "must be"]),
    "width_in_metres": ({"belt": MAPPING["belt"] | {"width": "200 m"}}, ["belt.width = 200 m", "must be"]),
    "no_number": ({"runs": {"a": {"yaw": "left"}}}, ["runs.a.yaw = left", "no number"]),
    "one_radius": ({"machine": {"centre_distance": "10 m", "head_radius": "0.2 m"}}, ["both head_radius and tail"]),
    "pulleys_overlap": ({"machine": {"centre_distance": "0.3 m", "pulley_radius": "170 mm"}}, ["overlap"]),
    "direction": ({"runs": {"a": {"direction": 2}}}, ["direction = 2", "1 "]),
    "signal_name": ({"columns": {"y1 [mm]": {"name": "run"}}}, ["choose another name"]),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_mapping_that_cannot_be_meant_is_refused_in_one_line(name, tmp_path):
    asked, words = WRONG[name]
    (tmp_path / "a.csv").write_text(GOOD)
    with pytest.raises(BeltError) as error:
        understand(read([tmp_path / "a.csv"]), MAPPING | {"all_runs": RUN} | asked)
    message = str(error.value)
    assert message.count("\n") == 0
    for word in words:
        assert word in message


def test_a_mapping_file_names_the_line(tmp_path):
    (tmp_path / "a.csv").write_text(GOOD)
    (tmp_path / "m.yaml").write_text("schema: belt-mapping/1\nruns:\n  a: {tensoin: 10}\n")
    with pytest.raises(BeltError, match=r"m\.yaml:3: runs\.a\.tensoin: unknown key; did you mean tension\?"):
        understand(read([tmp_path / "a.csv"]), tmp_path / "m.yaml")


def test_a_mapping_that_is_a_folder_asks_for_the_file_in_it(tmp_path):
    with pytest.raises(BeltError, match=r"is a folder; name the file in it, as mapping=FOLDER/mapping\.yaml$"):
        mapping_of(tmp_path)


def test_a_mapping_that_is_a_bomb_is_refused(tmp_path):
    (tmp_path / "a.csv").write_text(GOOD)
    (tmp_path / "m.yaml").write_text("a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]\n")
    with pytest.raises(BeltError, match="aliases are not read"):
        understand(read([tmp_path / "a.csv"]), tmp_path / "m.yaml")


def test_a_folder_that_is_not_empty_is_left_alone(tmp_path):
    (tmp_path / "a.csv").write_text(GOOD)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "notes.txt").write_text("mine")
    proposal = understand(read([tmp_path / "a.csv"]), MAPPING | {"all_runs": RUN})
    with pytest.raises(BeltError, match="not empty"):
        write(proposal, tmp_path / "out")
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["notes.txt"]


@pytest.mark.parametrize("files", [[], ["nowhere.csv"], ["."], ["a.csv", "a.csv"]])
def test_files_that_are_not_there(files, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.csv").write_text(GOOD)
    with pytest.raises(BeltError):
        read(files)


#: Readings [mm] that no belt takes from one row to the next, and the lines of the file at which they stand.
SPIKES = {20: 180.0, 45: -35.0, 46: -35.0}


def spiky(tmp_path, mapping: dict):
    y1 = L.y1.copy()
    for line, value in SPIKES.items():
        y1[line - 2] = value
    text = table(["travel [m]", "y1 [mm]", "y4 [mm]"], [L.travel, y1, L.y4])
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    return understand(read([tmp_path / "a.csv"]), MAPPING | {"runs": {"a": RUN}, "step_m": "0.05"} | mapping)


def test_spikes_are_left_out_and_their_lines_listed(tmp_path):
    proposal = spiky(tmp_path, {})
    assert any("y1: 3 readings jump away and back, left out (line 20, 45, 46)" in n.text for n in proposal.notes)
    run = proposal.complete().runs[0]
    assert np.isnan(run.signals["y1"]).sum() == len(SPIKES)
    assert np.isfinite(run.signals["y4"]).all()


def test_spikes_are_kept_where_the_mapping_says_so(tmp_path):
    proposal = spiky(tmp_path, {"spikes": "keep"})
    assert not any("left out" in n.text for n in proposal.notes)
    assert np.isfinite(proposal.complete().runs[0].signals["y1"]).all()


@pytest.mark.parametrize(
    ("entry", "words"), [({"factor": 1e300}, "between 1e-12 and 1e12"), ({"sign": 2}, "must be 1 or -1")]
)
def test_a_scale_that_no_sensor_has(entry, words, tmp_path):
    with pytest.raises(BeltError, match=words):
        spiky(tmp_path, {"columns": {"y1 [mm]": entry}})


def test_a_run_without_speeds_in_a_file_that_has_them_is_asked_for_its_speed(tmp_path):
    rows = [f"a,{k},0.5,{k % 7}" for k in range(30)] + [f"b,{k},,{k % 7}" for k in range(30)]
    (tmp_path / "a.csv").write_text("\n".join(["run,time [s],v [m/s],y1 [mm]", *rows, ""]), encoding="utf-8")
    proposal = understand(read([tmp_path / "a.csv"]), MAPPING | {"all_runs": RUN})
    assert [q.key for q in proposal.missing] == ["all_runs.speed"]


def test_a_run_that_is_skipped_may_be_broken(tmp_path):
    broken = [*LINES]
    broken[39] = "0,95;103,2;48,1"  # travel runs backwards
    for name, lines in (("a", LINES), ("b", broken)):
        (tmp_path / f"{name}.csv").write_text("\n".join([*lines, ""]), encoding="utf-8")
    logged = read([tmp_path / "a.csv", tmp_path / "b.csv"])
    proposal = understand(logged, MAPPING | {"all_runs": RUN, "runs": {"b": {"skip": True}}})
    assert [run.name for run in proposal.complete().runs] == ["a"]
