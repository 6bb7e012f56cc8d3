"""What is written is read back, all at once or not at all."""

import dataclasses
import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from belt_sim.campaign import CampaignError, Quantity, Run, SteadyRate, read_campaign, write_campaign
from belt_sim.errors import InputError
from belt_sim.io import CAMPAIGNS

#: Numbers are written with 15 digits: half a unit of the last one, and the rounding of two factors.
WRITTEN = 6e-15
NUMBERS = st.floats(min_value=-1e3, max_value=1e3)


def assert_same(a, b):
    """The same campaign to 15 digits, hash aside."""
    if dataclasses.is_dataclass(a):
        for field in dataclasses.fields(a):
            if field.name != "sha256":
                assert_same(getattr(a, field.name), getattr(b, field.name))
    elif isinstance(a, tuple | list):
        assert len(a) == len(b)
        for one, other in zip(a, b, strict=True):
            assert_same(one, other)
    elif isinstance(a, dict):
        assert sorted(a) == sorted(b)
        for key in a:
            assert_same(a[key], b[key])
    elif isinstance(a, np.ndarray | float):
        np.testing.assert_allclose(a, b, rtol=WRITTEN, atol=0.0)
    else:
        assert a == b


def test_a_campaign_survives_the_round_trip(folder, tmp_path):
    campaign = read_campaign(folder.path)
    back = write_campaign(campaign, tmp_path / "again")
    assert_same(back, campaign)
    assert back.sha256 == read_campaign(tmp_path / "again").sha256
    assert sorted(path.name for path in tmp_path.iterdir()) == ["again", "slack"]


def test_decimals_written_by_people_stay_as_they_are(folder, tmp_path):
    write_campaign(read_campaign(folder.path), tmp_path / "again")
    assert "r01,0.0,0.0,0.012,-0.003,\n" in (tmp_path / "again" / "signals.csv").read_text()
    assert "r01,10.0,-0.042,0.0,0.5,1,0.0,,fit\n" in (tmp_path / "again" / "runs.csv").read_text()


def test_the_second_writing_equals_the_first(folder, tmp_path):
    first = write_campaign(read_campaign(folder.path), tmp_path / "one")
    second = write_campaign(first, tmp_path / "two")
    assert second.sha256 == first.sha256


@settings(max_examples=25, deadline=None)
@given(
    values=st.lists(NUMBERS | st.just(math.nan), min_size=2, max_size=6).filter(lambda v: not all(map(math.isnan, v))),
    steps=st.lists(st.floats(min_value=1e-3, max_value=10.0), min_size=6, max_size=6),
    tension=st.floats(min_value=1e5, max_value=1e9),
    yaw=st.floats(min_value=-0.03, max_value=0.03),
    title=st.text(min_size=1).map(lambda t: " ".join(t.split())).filter(lambda t: t and t.isprintable()),
)
def test_any_valid_campaign_survives(tmp_path_factory, values, steps, tension, yaw, title):
    campaign = _small(title, values, np.cumsum(steps[: len(values)]), tension, yaw)
    back = write_campaign(campaign, tmp_path_factory.mktemp("any") / "c")
    assert_same(back, campaign)


def _small(title, values, travel, tension, yaw):
    from belt_sim.campaign import BeltSheet, Campaign, Machine, SettingsSheet, SignalSheet, Source

    run = Run(name="a", tension=tension, yaw=yaw, travel=travel, signals={"y1": np.array(values)})
    rate = SteadyRate(run="a", rates=np.array([1e-4, math.nan, math.nan, 2e-4]), u=1e-6)
    return Campaign(
        title=title,
        source=Source(kind="synthetic"),
        machine=Machine(
            centre_distance=Quantity(value=2.0),
            head_radius=Quantity(value=0.1),
            tail_radius=Quantity(value=0.2),
        ),
        belt=BeltSheet(
            width=Quantity(value=0.2),
            thickness=Quantity(value=0.0003, u=1e-6),
            youngs_modulus=Quantity(value=2.1e11),
            density=Quantity(value=7850.0),
        ),
        signals=(SignalSheet(name="y1", at="point_1", kind="lateral", unit="m", white=1e-5),),
        settings=SettingsSheet(yaw_u=1e-6),
        runs=(run,),
        steady=(rate,),
    )


def test_an_existing_folder_is_not_touched(folder):
    campaign = read_campaign(folder.path)
    with pytest.raises(InputError, match="exists and is not empty; choose another name or overwrite it"):
        write_campaign(campaign, folder.path)
    with pytest.raises(InputError, match="a file of that name exists"):
        write_campaign(campaign, folder.path / "runs.csv", overwrite=True)
    assert read_campaign(folder.path).sha256 == campaign.sha256


def test_overwriting_replaces_the_campaign_and_keeps_other_files(folder):
    campaign = read_campaign(folder.path)
    (folder.path / "notes.txt").write_text("mine")
    back = write_campaign(dataclasses.replace(campaign, title="new", steady=()), folder.path, overwrite=True)
    assert back.title == "new"
    assert not (folder.path / "steady.csv").exists()
    assert (folder.path / "notes.txt").read_text() == "mine"
    assert [path.name for path in folder.path.parent.iterdir()] == ["slack"]


def test_what_the_reader_would_refuse_is_never_written(folder, tmp_path):
    campaign = read_campaign(folder.path)
    wrong = dataclasses.replace(campaign.runs[0], tension=-1.0)
    with pytest.raises(CampaignError, match="tension_N_per_mm2 = -1e-06 N/mm2"):
        write_campaign(dataclasses.replace(campaign, runs=(wrong, *campaign.runs[1:])), tmp_path / "bad")
    assert [path.name for path in tmp_path.iterdir()] == ["slack"]


def test_a_run_of_a_running_machine_and_its_place_come_back(tmp_path):
    campaign = read_campaign(CAMPAIGNS / "slack_belt")
    first, *others = campaign.runs
    moved = replace(first, run_in=80.0, travel=first.travel + 80.0, yaw_at=first.yaw_at + 80.0, y0=-0.008, start=-76.8)
    others = [replace(r, repeat_of=None) if r.repeat_of == first.name else r for r in others]
    others = [replace(r, start=1.0) for r in others]
    back = write_campaign(replace(campaign, runs=(moved, *others)), tmp_path / "c")
    table = pandas.read_csv(tmp_path / "c" / "runs.csv")
    assert (table.run_in_m[0], table.start_m[0], table.start_m[1]) == (80.0, 3.2, 1.0)  # where the record begins
    assert (back.runs[0].run_in, back.runs[0].y0) == (80.0, pytest.approx(-0.008))
    assert (back.runs[0].start, back.runs[1].start) == (pytest.approx(-76.8), 1.0)
    assert back.runs[0].yaw_at == pytest.approx(first.yaw_at + 80.0)
    assert back.runs[0].travel == pytest.approx(first.travel + 80.0)
    assert back.runs[1].y0 is None


def test_the_old_folder_comes_back_where_the_new_cannot_be_put(tmp_path, monkeypatch):
    campaign = read_campaign(CAMPAIGNS / "slack_belt")
    write_campaign(campaign, tmp_path / "c")
    before = (tmp_path / "c" / "runs.csv").read_bytes()
    rename = os.rename

    def fails(source, target):
        if Path(target) == tmp_path / "c" and not str(source).endswith(".old"):
            raise OSError(28, "No space left on device")
        rename(source, target)

    monkeypatch.setattr(os, "rename", fails)
    with pytest.raises(InputError, match="No space left"):
        write_campaign(campaign, tmp_path / "c", overwrite=True)
    assert (tmp_path / "c" / "runs.csv").read_bytes() == before


def test_a_place_on_the_belt_is_that_at_the_beginning_of_the_record(folder, tmp_path):
    """In the file as read off the machine, in the run counted back to the straight start."""
    first = read_campaign(folder.path).runs[0]
    ran = replace(
        first, name="ran", run_in=80.0, travel=first.travel + 80.0, yaw_at=first.yaw_at + 80.0, start=3.2 - 80.0
    )
    stood = replace(first, start=3.2)
    back = write_campaign(replace(read_campaign(folder.path), runs=(stood, ran), steady=()), tmp_path / "c")
    assert [run.start for run in back.runs] == pytest.approx([3.2, -76.8])
    header, *rows = [line.split(",") for line in (tmp_path / "c" / "runs.csv").read_text().split()]
    assert [row[header.index("start_m")] for row in rows] == ["3.2", "3.2"]
