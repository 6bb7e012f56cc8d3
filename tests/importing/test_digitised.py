"""Digitised figures: pixels with marks on the axes, curves with travels of their own, tables of rates."""

import numpy as np
import pytest
from logger_files import MAPPING

from belt_sim.api.campaigns import import_files
from belt_sim.api.compare import compare
from belt_sim.api.inference import diagnose
from belt_sim.campaign import read_campaign
from belt_sim.errors import BeltError
from belt_sim.importing import read, understand, write
from belt_sim.io import CAMPAIGNS, MODEL_FOLDER
from studies.made_up_figures import INVENTED, RATES, figure_12, figure_13

FIGURES = MODEL_FOLDER / "figures"


@pytest.mark.parametrize("name", ["made_up_figure_12", "made_up_figure_13"])
def test_the_made_up_figures_are_what_their_commands_make(name, tmp_path):
    made = {"made_up_figure_12": figure_12, "made_up_figure_13": figure_13}[name]()
    assert (FIGURES / f"{name}.csv").read_text() == made
    write(understand(read([FIGURES / f"{name}.csv"]), FIGURES / f"{name}.yaml"), tmp_path / "out")
    for path in sorted((CAMPAIGNS / name).iterdir()):
        assert path.read_bytes() == (tmp_path / "out" / path.name).read_bytes(), path.name


def test_pixels_become_what_the_marks_say():
    campaign = read_campaign("made_up_figure_12")
    assert campaign.source.kind == "digitised"
    assert "MADE UP" in campaign.title
    assert [s.name for s in campaign.signals] == ["y1"]
    assert campaign.signals[0].white == pytest.approx(10e-3 / 400.0)  # a pixel
    for run in campaign.runs:
        offset, length, rate = INVENTED[round(run.tension / 1e6)]
        expected = -(offset * (1.0 - np.exp(-run.travel / length)) + rate * run.travel) * 1e-3
        there = np.isfinite(run.signals["y1"])
        assert np.abs(run.signals["y1"] - expected)[there].max() < 0.04e-3  # rounding of either pixel


def test_rates_are_compared_in_one_command():
    found = compare(read_campaign("made_up_figure_13"), "ritzinger")
    assert len(found.steady) == len(RATES)
    assert [e.measured for e in found.steady] == pytest.approx([-r * 1e-3 for r in RATES.values()])


@pytest.mark.parametrize(("figure", "then"), [("12", "diagnose"), ("13", "compare")])
def test_the_next_step_is_one_that_works(figure, then, tmp_path, capsys):
    name = FIGURES / f"made_up_figure_{figure}"
    campaign = import_files([f"{name}.csv"], tmp_path / "out", mapping=f"{name}.yaml", pictures=False)
    assert f"\nthen      belt-sim {then} campaign=" in capsys.readouterr().out
    if then == "compare":
        with pytest.raises(BeltError, match="belt-sim compare does without"):
            diagnose(campaign)


def test_a_table_of_rates_asks_how_well_they_are_known(tmp_path):
    (tmp_path / "rates.csv").write_text("run;Bandzug [N/mm2];rate1 [mm/m];rate4 [mm/m]\na;10;0,1;0,11\nb;20;0,2;0,21\n")
    logged = read([tmp_path / "rates.csv"])
    first = understand(logged, MAPPING | {"all_runs": {"yaw": "0.042"}})
    assert [q.key for q in first.missing] == ["columns.rate1 [mm/m].white"]
    more = {"columns": {"rate1 [mm/m]": {"white": "0.002 mm/m"}}}
    campaign = write(understand(logged, MAPPING | {"all_runs": {"yaw": "0.042"}} | more), tmp_path / "out")
    assert campaign.steady[1].rates[[0, 3]] == pytest.approx([0.2e-3, 0.21e-3])
    assert campaign.steady[0].u == pytest.approx(2e-6)
    assert campaign.runs[1].tension == pytest.approx(20e6)


@pytest.mark.parametrize("pixel", [[1], [3, 3]])
def test_an_axis_with_one_mark_is_refused(pixel, tmp_path):
    (tmp_path / "a.csv").write_text("x,y\n1,1\n2,2\n3,3\n4,5\n")
    marks = {"x": {"axis": {"pixel": pixel, "value": [0, 1]}}, "y": {"at": "point_1", "against": "x"}}
    with pytest.raises(BeltError, match=r"columns\.x\.axis"):
        understand(read([tmp_path / "a.csv"]), MAPPING | {"columns": marks})


TITLES = ["tilt: 100 % # not a comment", "a\tb 'quoted' \"twice\"", "- list?", "ümläut — ½", "12"]


@pytest.mark.parametrize("title", TITLES)
def test_a_title_comes_back_from_the_commented_sheet(title, tmp_path):
    rows = (FIGURES / "made_up_figure_13.csv", FIGURES / "made_up_figure_13.yaml")
    from belt_sim.importing.mapping import mapping_of

    mapping = mapping_of(rows[1]).model_copy(update={"title": title})
    campaign = write(understand(read([rows[0]]), mapping), tmp_path / "out")
    assert campaign.title == " ".join(title.split())
    assert campaign.source.reference.endswith("Fig. 13")
