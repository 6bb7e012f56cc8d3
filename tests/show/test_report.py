"""The report is one whole page that fetches nothing and does without what a diagnosis does not bring."""

import html
import re
from dataclasses import replace
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest
from small_campaign import diagnosed, drawn
from unknown_result import unknown

from belt_sim.api.plot import report, report_pictures
from belt_sim.campaign import Suspicion
from belt_sim.errors import BeltError
from belt_sim.io import ROOT
from belt_sim.results.diagnosis import STAMP, Candidate, Confusable, NextRun, Verdict
from belt_sim.results.errors import Change, Drawings, Errors
from belt_sim.results.words import thousandths
from belt_sim.show.report import (
    BLIND_TESTS,
    HERE,
    bars,
    falls,
    inline_svg,
)
from belt_sim.show.report import render as page_text

FETCHING = {"src", "action", "data", "poster", "srcset", "background"}
SMALL = 1_000_000  # bytes of a page with all its pictures
GAP = 7  # a sample that is missing
RUN = NextRun("opposite yaw at 10 N/mm²", ("yaw_offset_tail", "sensor_gain"), 0.1, 5.9)
PAIR = Confusable(effect="yaw_offset_tail", other="sensor_gain", sigma=0.1)


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
        self.references += [v for n, v in attrs if n.endswith("href") and not v.startswith(("#", "data:image/png"))]
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
def explained():
    """The slack belt, with a hard title, a run that got worse, a gap in a record, a pair and a next run."""
    d = drawn("sag_roll")
    first, *others = d.per_run
    panel, *panels = d.drawings.overlays
    gone = np.where(np.arange(len(panel.travel)) == GAP, np.nan, panel.measured)
    drawings = replace(d.drawings, overlays=(replace(panel, measured=gone), *panels))
    return replace(
        d,
        campaign=replace(d.campaign, title="Slack belt <sample>"),
        per_run=(replace(first, worse=True), *others),
        drawings=drawings,
        confusables=(PAIR,),
        next_runs=(RUN,),
    )


@pytest.fixture(scope="module")
def pictures(explained):
    return report_pictures(explained)


@pytest.fixture(scope="module")
def text(explained, pictures):
    return page_text(explained, pictures)


def render(d):
    """A page without pictures, which are drawn once above."""
    return page_text(d)


@pytest.fixture(scope="module")
def page(text):
    return Page(text)


def test_nothing_is_fetched(page):
    assert page.references == []
    assert "default-src 'none'" in page.policy
    style = (HERE / "report.css").read_text()
    assert not re.search(r"url\(|@import", style)


def test_the_page_is_well_formed_and_small(page, text):
    assert page.open == []
    assert len(page.scripts) == 1
    assert len(text.encode()) < SMALL


def test_the_page_is_read_from_the_top(text):
    order = [
        "<h1>",
        'id="found"',
        'id="error"',
        'id="fails"',
        'id="apart"',
        'id="evidence"',
        'id="ranking"',
        'id="runs"',
    ]
    places = [text.index(mark) for mark in order]
    assert places == sorted(places)
    before, evidence = text[: places[5]], text[places[5] :]
    assert before.count("<table") == before.count("<details") == 0
    assert evidence.count("<details") == evidence.count("<summary") >= 4


def test_the_error_is_said_to_fall_only_where_it_does(explained, text):
    assert "The error falls" in text
    own = replace(explained.error.own, after=2 * explained.error.own.before)
    worse = render(replace(explained, error=replace(explained.error, own=own)))
    assert "The error does not fall" in worse
    assert "How large the error is" in render(replace(explained, effects=()))


def test_falls_share_one_scale_with_the_noise_floor():
    error = Errors(
        noise_floor=1e-5,
        fit=Change(before=1e-4, after=1e-5),
        held_out=Change(before=5e-5, after=2e-5),
        by_condition={"7 N/mm2": Change(before=float("nan"), after=2e-4), "yaw +": Change(before=1e-4, after=1.0)},
        untestable=("yaw +",),
    )
    shown = {row["label"]: (row["before"], row["after"], row["floor"]) for row in falls(error)}
    assert shown == {
        "unseen runs": (25.0, 10.0, 5.0),
        "fitted runs": (50.0, 5.0, 5.0),
        "7 N/mm2, unseen": (0.0, 100.0, 5.0),
        "yaw + (not testable by hold-out), unseen": (50.0, 100.0, 5.0),  # it tests nothing and sets no scale
    }


def test_pictures_take_their_colours_from_the_page(pictures):
    style = (HERE / "report.css").read_text()
    light, dark = re.findall(r":root \{(.*?)\}", style, re.DOTALL)[:2]
    shown = str(inline_svg(pictures["overlay"]))
    named = set(re.findall(r"var\((--[a-z0-9-]+)\)", shown))
    assert named >= {"--ink", "--before", "--after"}
    for scheme in (light, dark):
        assert named <= set(re.findall(r"(--[a-z0-9-]+):", scheme))
    assert not re.search(r"#[0-9a-f]{6}\b(?!\w)", re.sub(r"#[mp][0-9a-f]{10}", "", shown))


def test_what_was_found_stands_in_sentences(page, explained):
    assert explained.sentence in page.text
    assert explained.where.sentence.replace("N/mm2", "N/mm²") in page.text
    assert "N/mm2" not in page.text  # one form of a unit
    assert str(explained.effects[0].parameters["strength"]) in page.text
    assert thousandths(explained.error.held_out.before) in page.text
    first = explained.per_run[0]
    assert f"Worse than before: {first.run} {first.signal}" in page.text
    assert "Opposite yaw at 10 N/mm². It tells yaw_offset_tail from sensor_gain (0.1 → 5.9 sigma)" in page.text


def test_what_users_write_is_escaped(page):
    assert "Slack belt <sample>" in page.text  # as text, not as a tag


def test_what_looks_wrong_and_what_was_admitted_are_told(explained):
    seen = Suspicion(run="r01", signals=("y1",), kind="wrong_sign", sentence="y1 is turned round", severity="look")
    text = Page(render(replace(explained, suspicions=(seen,), admitted=("wind: units declared",)))).text
    assert str(seen)[1:] in text
    assert "wind: units declared" in text


def test_a_tilt_is_told_in_milliradians(explained):
    first, *others = explained.per_run
    tilted = replace(explained, per_run=(replace(first, kind="tilt", before=2e-3, after=3e-3), *others))
    assert f"{first.run} {first.signal} (2.00 → 3.00 mrad)" in Page(render(tilted)).text


def test_every_panel_is_in_the_page_and_the_worst_is_shown(text, explained, pictures):
    overlays = explained.drawings.overlays
    assert len(overlays) == len(explained.per_run)
    assert text.count('<g id="panel-') == text.count('<use href="#panel-') == len(overlays)
    assert text.count('class="one shown"') == 1
    worst = explained.where.worst
    chosen = "<option selected>(.*?)</option>"
    assert re.search(chosen, text)[1].startswith(f"{worst.run} {worst.signal}")
    elsewhere = replace(explained, where=replace(explained.where, worst=replace(worst, run="none")))
    largest = max(overlays, key=lambda p: np.nanmean(np.abs(p.base - p.measured) / p.band))
    assert re.search(chosen, page_text(elsewhere, pictures))[1] == html.escape(largest.title, quote=False)


def test_no_name_of_a_picture_stands_twice_in_the_page(text):
    names = re.findall(r' id="([^"]+)"', text)
    twice = {n for n in names if names.count(n) > 1}
    assert all(re.fullmatch(r"[mp][0-9a-f]{10}", n) for n in twice)  # of one content each


def test_a_picture_keeps_words_and_runs_keep_their_signs(pictures, explained):
    panel = explained.drawings.overlays[0]
    assert html.escape(panel.title, quote=False) in pictures["overlay"]


@pytest.mark.parametrize(
    "left_out", ["effects", "ranking", "confusables", "next_runs", "per_run", "suspicions", "admitted"]
)
def test_any_list_may_be_empty(explained, left_out):
    assert Page(render(replace(explained, **{left_out: ()}))).open == []


def test_without_drawings_there_are_no_empty_plots(explained):
    bare = render(replace(explained, drawings=Drawings()))
    assert not re.search(r'id="(where|drift|overlays)"', bare)
    assert Page(bare).open == []


def test_an_adequate_model_has_no_effects_to_show():
    page = Page(render(drawn("nothing")))
    assert "beam_th2 agrees with every run" in page.text
    assert "What is missing" not in page.text
    assert "got worse" not in page.text  # than what: nothing was added


def test_unknown_shows_its_card_and_names_the_nearest():
    page = Page(render(unknown()))
    for said in (
        "What the unknown looks like",
        "parity in yaw",
        "Nearest known effect: crown, but it fails at 7 N/mm²",
    ):
        assert said in page.text


def test_values_of_a_rejected_model_are_stamped(explained):
    stamped = replace(explained, verdict=Verdict.PARTLY, effects=(replace(explained.effects[0], stamp=STAMP),))
    assert "effective value, model rejected" in Page(render(stamped)).text
    assert "effective value, model rejected" not in Page(render(explained)).text


def test_counts_of_blind_tests_are_those_of_the_record():
    record = (ROOT / "docs" / "data" / "how_often_right_record.md").read_text(encoding="utf-8")
    table = record[record.index("| probability | mean said | truly hidden") :].split("\n\n")[0]
    rows = [[cell.strip() for cell in line.split("|")[1:4]] for line in table.splitlines()[2:]]
    wanted = [[*name.split(" - "), *count.split(" of ")] for name, _, count in rows]
    assert [line.split(",")[:4] for line in BLIND_TESTS.read_text().splitlines()[1:]] == wanted


def tried(gain: float, threshold: float | None = 9.1) -> Candidate:
    return Candidate(
        id="taper", gain=gain, threshold=threshold, held_out_rms=0.0, parameters={}, plausible=True, probability=0.5,
        note="",
    )  # fmt: skip


def test_bars_show_chance_and_gain_on_one_scale():
    ranking = diagnosed("sag_roll").ranking
    shown = bars(ranking)
    assert shown[0]["length"] == 100.0
    assert [b["beyond_chance"] for b in shown] == [bool(c.threshold) and c.gain > c.threshold for c in ranking]
    assert not all(b["beyond_chance"] for b in shown)
    at_chance = bars([tried(9.1), tried(900.0)])[0]
    assert at_chance["length"] == at_chance["chance"]
    assert bars([tried(5.0, None)])[0]["length"] == 0.0
    assert bars([]) == []


@pytest.mark.parametrize(("gain", "text"), [(12.34, "12"), (151.4, "151"), (2.5e4, "25000"), (2.5e5, "2.50·10⁵")])
def test_a_gain_of_any_size_is_told(explained, gain, text):
    assert f">{text}<" in render(replace(explained, ranking=(tried(gain),)))


def test_the_file_is_whole_or_not_there(tmp_path, explained):
    path = report(explained, tmp_path / "out" / "report.html")
    assert path.read_text(encoding="utf-8").rstrip().endswith("</html>")
    assert [p.name for p in path.parent.iterdir()] == ["report.html"]
    (tmp_path / "file").write_text("")
    with pytest.raises(BeltError, match="cannot be written"):
        report(explained, tmp_path / "file" / "report.html")


def test_a_discovered_law_is_told_with_its_place_course_and_rivals(explained):
    s, x = np.linspace(0.0, 30.0, 7), np.linspace(-7e-4, 7e-4, 5)
    courses = [
        SimpleNamespace(label=f"{t} N/mm²", tension=t * 1e6, travel=s, u=1e-5 * s, sd=2e-6 + 0 * s) for t in (7, 40)
    ]
    law = SimpleNamespace(variable="β", variable_unit="rad", place="reading of y1")
    found = SimpleNamespace(
        found=True,
        sentence="The yaw of the tail pulley lacks 0.24 β (1 − exp(−s/14.6 m)).",
        places=[
            SimpleNamespace(words=w, gain=g) for w, g in (("yaw of the tail pulley", 80.0), ("reading of y1", 20.0))
        ],
        unit="rad",
        courses=courses,
        against=[SimpleNamespace(tension=7e6, x=x, u=0.2 * x)],
        curve=SimpleNamespace(tension=7e6, x=x, u=0.24 * x),
        law=law,
        rivals=[SimpleNamespace(formula="κ|κ|", place="turn of the belt")],
        limits=["one speed only"],
        error=replace(explained.error),
        law_file="text",
    )
    told = replace(explained, discovery=found)
    text = render(told)
    page = Page(text)
    for said in (found.sentence, "yaw of the tail pulley", "κ|κ|", "one speed only", "found_law.yaml"):
        assert said in page.text
    assert "fits best at another place (yaw of the tail pulley)" in page.text  # the bars rank it first
    top = text[text.index("<h1>") : text.index("</header>")]
    assert f"A law describes it: {found.sentence.rstrip('.')}" in html.unescape(top)
    assert 'href="#discovered"' in top
    assert re.findall(r'<i class="a whole" style="width:([^"]*)%">', text)[:2] == ["100.0", "25.0"]
    assert "the discovered law" not in text  # effects were named: the top says what they do
    alone = replace(told, effects=(), error=replace(explained.error, own=None, held_out=None))
    for said in ("The error falls", "beam_th2 + the discovered law"):
        assert said in render(alone)
    worse = replace(explained.error, held_out=Change(before=1e-4, after=2e-4))
    found.error = worse
    held_back = render(told)
    assert found.sentence not in held_back
    assert "κ|κ|" not in held_back
    assert "predicts unseen runs worse than nothing does" in held_back
    nothing = replace(told, discovery=SimpleNamespace(found=False))
    assert "What was discovered" not in render(nothing)
