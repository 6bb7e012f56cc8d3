"""Every violation of the campaign format is one line with file, line, name, value, unit and remedy."""

import ast
from pathlib import Path

import pytest

from belt_sim.campaign import CampaignError, read_campaign
from belt_sim.errors import BeltError


def _violations() -> list[tuple[str, str, str, str]]:
    """violations.txt: FILE 'old text' -> 'new text', then the lines that the reader must say."""
    cases: list[tuple[str, str, str, str]] = []
    for line in Path(__file__).with_name("violations.txt").read_text().splitlines():
        if line.startswith("   "):
            file, old, new, says = cases.pop()
            cases.append((file, old, new, f"{says}\n{line.strip()}".strip()))
        else:
            file, edit = line.split(" ", 1)
            old, new = (ast.literal_eval(part) for part in edit.split(" -> "))
            cases.append((file, old, new, ""))
    return cases


@pytest.mark.parametrize(("file", "old", "new", "says"), _violations())
def test_each_violation_says_where_what_and_what_to_do(folder, file, old, new, says):
    folder.edit(file, old, new)
    with pytest.raises(CampaignError) as caught:
        read_campaign(folder.path)
    assert str(caught.value) == says
    assert len(caught.value.problems) == len(says.splitlines())
    assert isinstance(caught.value, BeltError)


def test_problems_of_all_files_come_together(folder):
    folder.edit("campaign.yaml", "value: 200,", "value: 0.2,")
    folder.edit("runs.csv", "-0.042", "-733")
    folder.edit("signals.csv", "0.012", "x")
    folder.edit("steady.csv", "0.152", "x")
    with pytest.raises(CampaignError) as caught:
        read_campaign(folder.path)
    files = [problem.file for problem in caught.value.problems]
    assert files == ["campaign.yaml", "runs.csv", "steady.csv"]


def test_only_twenty_problems_are_printed_and_the_rest_counted(folder):
    rows = "".join(f"r01,{k},,x,,\n" for k in range(30))
    folder.write("signals.csv", "run,travel_m,time_s,y1,y4,tilt\n" + rows)
    with pytest.raises(CampaignError) as caught:
        read_campaign(folder.path)
    lines = str(caught.value).splitlines()
    assert len(lines) == 21
    assert lines[-1] == "... and 10 more"


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("campaign.yaml", None, "campaign.yaml: the file is missing in {folder}; add it"),
        ("runs.csv", None, "runs.csv: the file is missing in {folder}; add it"),
        ("campaign.yaml", b"", "campaign.yaml: the file is empty; state schema, title, machine, belt"),
        (
            "campaign.yaml",
            b"- a\n",
            "campaign.yaml:1: must be a mapping that begins with schema: belt-campaign/1",
        ),
        (
            "campaign.yaml",
            b"title: \x07\n",
            "campaign.yaml:1: \\x07: remove this character",
        ),
        ("runs.csv", b"", "runs.csv: the file is empty; begin with the line run,tension_N_per_mm2,yaw_deg"),
        ("runs.csv", b"run,tension_N_per_mm2,yaw_deg\n", "runs.csv: has a header but no rows; add them"),
        (
            "runs.csv",
            b"run;tension_N_per_mm2;yaw_deg\nr01;10;0\n",
            "runs.csv:1: columns are separated by semicolons; separate them by commas and write decimals with a point",
        ),
        (
            "signals.csv",
            b"run,travel_m\nr01,\xff\n",
            "signals.csv:2: byte 0xff: not UTF-8; save the file as UTF-8 text",
        ),
        (
            "signals.csv",
            "run,travel_m\n".encode("utf-16-le"),
            "signals.csv:1: holds bytes that are no UTF-8 text (binary, a spreadsheet, or UTF-16); "
            "save it as UTF-8 text",
        ),
    ],
)
def test_broken_files_are_named(folder, name, content, says):
    if content is None:
        (folder.path / name).unlink()
    else:
        folder.write(name, content)
    with pytest.raises(CampaignError) as caught:
        read_campaign(folder.path)
    assert str(caught.value) == says.format(folder=folder.path)


def test_a_run_without_rows_is_named(folder):
    folder.edit("runs.csv", "r03,40", "r04,40,0,,,,,,\nr03,40")
    with pytest.raises(CampaignError) as caught:
        read_campaign(folder.path)
    remedy = "has no rows in signals.csv or steady.csv; add them or remove the run"
    assert str(caught.value) == f"runs.csv:4: run = r04: {remedy}"


def test_a_run_of_blanks_is_named(folder):
    folder.edit("signals.csv", "r03,0.0,,0.02,0.003,\nr03,0.2,,0.03,0.004,", "r03,0.0,,,,\nr03,0.2,,,,")
    with pytest.raises(CampaignError) as caught:
        read_campaign(folder.path)
    remedy = "has rows but no readings; fill them in or remove the run"
    assert str(caught.value) == f"signals.csv:6: run = r03: {remedy}"


def test_without_any_data_a_file_is_asked_for(folder):
    (folder.path / "signals.csv").rename(folder.path / "signal.csv")
    (folder.path / "steady.csv").unlink()
    with pytest.raises(CampaignError) as caught:
        read_campaign(folder.path)
    assert str(caught.value) == (
        f"signals.csv: the file (or steady.csv) is missing in {folder.path}; add it; did you mean signal.csv? Rename it"
    )


@pytest.mark.parametrize("name", ["absent", "slack/runs.csv", "a\0b"])
def test_what_is_not_a_folder_is_refused(folder, name):
    with pytest.raises(CampaignError) as caught:
        read_campaign(folder.path.parent / name)
    assert len(str(caught.value).splitlines()) == 1
    assert str(caught.value).endswith("; name a folder with campaign.yaml and runs.csv")


def test_a_folder_in_place_of_a_file_is_refused(folder):
    (folder.path / "runs.csv").unlink()
    (folder.path / "runs.csv").mkdir()
    with pytest.raises(CampaignError) as caught:
        read_campaign(folder.path)
    assert str(caught.value) == ("runs.csv: cannot be read (not a plain file); replace it by a readable text file")


def test_yaml_aliases_and_depth_do_not_blow_up(folder):
    folder.edit("campaign.yaml", "settings:", "bomb: &a [x, x]\nbang: [*a, *a]\nsettings:")
    with pytest.raises(CampaignError, match="anchors and aliases are not read here"):
        read_campaign(folder.path)
    folder.write("campaign.yaml", "[" * 50_000)
    with pytest.raises(CampaignError, match="not valid YAML"):
        read_campaign(folder.path)
