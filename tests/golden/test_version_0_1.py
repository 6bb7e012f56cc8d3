"""Files that version 0.1 left are still read."""

import csv
import json
import lzma
from pathlib import Path

import pytest

import belt_sim as bs
from belt_sim.virtual_rig import reveal
from studies.challenge.report import read_stored

OLD = Path(__file__).parent / "version_0_1"
WRITTEN = 1e-9  # relative; files hold every digit that is compared


def test_a_diagnosis(tmp_path):
    for name in ("diagnosis", "drawings"):
        (tmp_path / f"{name}.json").write_bytes(lzma.decompress((OLD / "diagnosis" / f"{name}.json.xz").read_bytes()))
    found = bs.load_diagnosis(tmp_path)
    assert (found.verdict, found.base_model) == ("explained", "beam_th2")
    (effect,) = found.effects
    assert effect.id == "sag_roll"
    assert effect.parameters["strength"].value == pytest.approx(1.001396583676493, rel=WRITTEN)
    bs.report(found, tmp_path / "report.html")
    assert "sag_roll" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_effects_of_a_diagnosis():
    found = bs.simulate(model="beam_th2", effects=OLD / "diagnosis" / "effects.yaml", tension=10, travel=1.0)
    assert [(e.id, e.strength) for e in found.effects] == [("sag_roll", 1.001396583676493)]


def test_a_summary_and_its_curves():
    """What sweeps and scripts read by name: the schema, the fields with their units, the columns."""
    summary = json.loads((OLD / "summary" / "summary.json").read_text())
    now = bs.simulate(model="strip", tension=10, travel=5.0)
    assert summary["schema"] == "belt-summary/1"
    rates = [summary["rate_mm_per_m"][point] for point in "1234"]
    assert 1e3 * now.rates == pytest.approx(rates, rel=1e-6)  # explicit recursion in float64
    with (OLD / "summary" / "curves.csv").open() as file:
        last = list(csv.DictReader(file))[-1]
    y_end = [float(last[f"y{point}_mm"]) for point in "1234"]
    assert 1e3 * now.curves.y[:, -1] == pytest.approx(y_end, rel=1e-6)


def test_a_campaign_of_curves():
    campaign = bs.load_campaign(OLD / "campaign_curves")
    assert [r.tension / 1e6 for r in campaign.runs] == [7.0, 10.0, 20.0, 40.0]
    assert [s.at for s in campaign.signals] == ["point_1"]
    assert campaign.runs[0].signals["y1"][1] == pytest.approx(-0.175e-3)


def test_a_campaign_of_rates():
    campaign = bs.load_campaign(OLD / "campaign_rates")
    assert [rate.rates[0] for rate in campaign.steady][:3] == pytest.approx([-3e-5, -5e-5, -1e-4])


def test_a_sealed_truth():
    assert [e["id"] for e in reveal(OLD / "sealed").effects] == ["sag_roll"]


def test_a_published_challenge():
    (published,) = read_stored(OLD / "challenge")
    assert [f.kind for f in published.cases] == ["two", "outside", "dirty"]
    assert published.cases[1].law is not None
    assert "sysid" in published.others
    assert published.cases[0].aliases == {"yaw_offset_head": [("taper",)]}
