"""The report is one whole page that fetches nothing and does without what a diagnosis does not bring."""

import json
import re
import sys
from html.parser import HTMLParser
from pathlib import Path

import made_up_diagnosis
import numpy as np
import pytest

from belt_sim.errors import BeltError
from belt_sim.reports import words
from belt_sim.reports.page import Figures, bars, render, worst, write_report

sys.path.insert(0, str(Path(__file__).parents[1] / "pictures"))
import made_up

FIGURES = Figures(overlays=made_up.panels(), maps=made_up.maps(), drifts=made_up.drifts())
FETCHING = {"src", "href", "action", "data", "poster", "srcset", "background"}
SCRIPTS = 3  # the data, plotly.js once, and our own


class Page(HTMLParser):
    """Gathers what a browser would look at."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.references: list[str] = []
        self.open: list[str] = []
        self.scripts: list[str] = []
        self.policy = ""
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        if tag not in ("meta", "br", "link"):
            self.open.append(tag)
        if tag == "script":
            self.scripts.append("")
        self.references += [value or "" for name, value in attrs if name in FETCHING]
        if dict(attrs).get("http-equiv") == "Content-Security-Policy":
            self.policy = dict(attrs)["content"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] == "script":
            self.scripts[-1] += data
        elif self.open and self.open[-1] != "style":
            self.text += data


@pytest.fixture(scope="module")
def page():
    return Page(render(made_up_diagnosis.diagnosis(), FIGURES))


def test_nothing_is_fetched(page):
    assert page.references
    assert all(reference.startswith("#") for reference in page.references)
    assert "default-src 'none'" in page.policy
    style = (Path(words.__file__).parent / "report.css").read_text()
    assert not re.search(r"url\(|@import", style)


def test_the_page_is_well_formed_and_brings_plotly_once(page):
    assert page.open == []
    assert len(page.scripts) == SCRIPTS
    assert [len(s) > 1_000_000 for s in page.scripts] == [False, True, False]


def test_every_link_has_its_section(page):
    text = render(made_up_diagnosis.diagnosis(), FIGURES)
    for reference in page.references:
        assert f'id="{reference[1:]}"' in text


def test_the_verdict_stands_in_a_sentence(page):
    assert "beam_th2 lacks sag_roll. The error on conditions held out falls from 1.88 mm to 0.041 mm" in page.text
    assert "Worse than before: r03 y4" in page.text
    assert "opposite yaw at 10 N/mm²" in page.text


def test_what_users_write_is_escaped(page):
    assert "Slack belt <sample>" in page.text  # as text, not as a tag


def test_figures_carry_the_data_and_no_nan(page):
    plots = json.loads(page.scripts[0], parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert len(plots["overlays"]) == len(FIGURES.overlays)
    panel = FIGURES.overlays[0]
    traces = {t["name"]: t for t in plots["overlays"][0]["data"] if t.get("name") and t.get("yaxis", "y") == "y"}
    np.testing.assert_allclose(traces["beam_th2"]["y"], panel.base, rtol=1e-5)
    np.testing.assert_allclose(traces["beam_th2 + sag_roll"]["y"], panel.final, rtol=1e-5, atol=1e-9)
    assert traces["measured"]["y"][100] is None  # a gap in the measurement stays a gap
    maps = [t for t in plots["where"]["data"] if t["type"] == "heatmap"]
    assert maps[0]["z"][3][5] is None


@pytest.mark.parametrize(
    "left_out",
    ["effects", "ranking", "error", "where", "confusables", "next_runs", "noise", "provenance", "per_run"],
)
def test_any_part_may_be_missing(left_out):
    diagnosis = made_up_diagnosis.diagnosis()
    del diagnosis[left_out]
    assert Page(render(diagnosis, FIGURES)).open == []


def test_without_figures_there_are_no_empty_plots():
    text = render(made_up_diagnosis.diagnosis(), Figures())
    assert not re.search(r'<div id="(where|drift|overlay)"', text)
    assert Page(text).open == []


def test_least_diagnosis_of_all():
    page = Page(render({"verdict": "adequate", "base_model": "strip"}, Figures()))
    assert "strip agrees with this campaign to within its noise" in page.text


def test_unknown_shows_its_card_and_names_the_nearest():
    page = Page(render(made_up_diagnosis.unknown(), FIGURES))
    assert "What the unknown looks like" in page.text
    assert "soft_cover cannot: it would act at all tensions alike." in page.text
    assert "The nearest known effect is soft_cover." in page.text


def test_values_of_a_rejected_model_are_stamped():
    partly = {**made_up_diagnosis.diagnosis(), "verdict": "partly"}
    assert "effective value, model rejected" in Page(render(partly, Figures())).text
    assert "effective value, model rejected" not in Page(render(made_up_diagnosis.diagnosis(), Figures())).text


def test_the_worst_run_is_shown_first():
    panels = made_up.panels()
    assert worst(panels) == int(np.argmax([np.nanmean(np.abs(p.base - p.measured) / p.band) for p in panels]))
    assert worst([]) == 0


def test_bars_show_chance_and_gain_on_one_scale():
    drawn = bars(made_up.ranking())
    assert drawn[0]["length"] == 100.0
    assert [b["beyond_chance"] for b in drawn] == [True, True, True, False, False, False]
    at_chance = bars([{"gain": 9.1, "threshold": 9.1}, {"gain": 900.0, "threshold": 9.1}])[0]
    assert at_chance["length"] == at_chance["chance"]
    assert bars([]) == []


def test_the_file_is_whole_or_not_there(tmp_path):
    path = write_report(tmp_path / "out" / "report.html", made_up_diagnosis.diagnosis(), FIGURES)
    assert path.read_text(encoding="utf-8").rstrip().endswith("</html>")
    assert [p.name for p in path.parent.iterdir()] == ["report.html"]
    (tmp_path / "file").write_text("")
    with pytest.raises(BeltError, match="cannot be written"):
        write_report(tmp_path / "file" / "report.html", made_up_diagnosis.diagnosis())


@pytest.mark.parametrize(
    ("value", "u", "unit", "text"),
    [
        (2.0e-5, 1e-6, "1/m", "(2.00 ± 0.10)·10⁻⁵ 1/m"),
        (1.02, 0.03, "1", "1.020 ± 0.030"),
        (-733.2, 14.0, "urad", "−733 ± 14 urad"),
        (0.5, None, "m", "0.500 m"),
        (float("nan"), 1.0, "m", "–"),
    ],
)
def test_values_carry_two_digits_of_their_uncertainty(value, u, unit, text):
    assert words.with_u(value, u, unit) == text


@pytest.mark.parametrize(
    ("value", "text"), [(0.0410, "0.041"), (1.884, "1.88"), (0.0, "0.00"), (-0.25, "−0.25"), (None, "–")]
)
def test_millimetres_have_no_idle_digits(value, text):
    assert words.millimetres(value) == text
