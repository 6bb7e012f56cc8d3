"""Mistakes in the sheet of a clean campaign of a limp rope are named, with their size, before any fault is tried."""

import math
from dataclasses import replace

import numpy as np
import pytest
from roped_campaign import SPACING, WHITE, roped_campaign

from belt_sim.campaign import Campaign, Quantity, SignalSheet, suspicions
from belt_sim.campaign.sheet_doubts import sheet_mistakes
from belt_sim.diagnosis.foresight import sheet_evidence
from belt_sim.model import MODELS

ROPE = MODELS["rope"]
LATE = 3.0  # [m]
#: The rope of the test is integrated in steps of 0.05 m, and a yaw's place is told to a fraction of a step.
PLACE = 0.1  # [m]


@pytest.fixture(scope="module")
def right() -> Campaign:
    return roped_campaign()


def with_runs(campaign: Campaign, change, names=()) -> Campaign:
    return replace(campaign, runs=tuple(change(r) if not names or r.name in names else r for r in campaign.runs))


def test_a_right_sheet_is_not_doubted(right):
    assert sheet_evidence(right, ROPE) == ()


def test_a_yaw_that_came_later_is_told_with_its_place(right):
    later = with_runs(right, lambda r: replace(r, yaw_at=0.0, travel=r.travel + LATE))
    first, *_ = sheet_evidence(later, ROPE)
    assert (first.mistake.kind, first.certain) == ("yaw_place", True)
    assert abs(first.mistake.size - LATE) < PLACE


def test_a_yaw_that_came_later_in_two_runs_names_these(right):
    some = ("r1", "r4")
    later = with_runs(right, lambda r: replace(r, travel=r.travel + LATE), some)
    first, *_ = sheet_evidence(later, ROPE)
    assert (first.mistake.kind, first.mistake.runs) == ("yaw_place", some)


def test_a_tilt_that_is_blank_about_the_yaw_hides_no_late_yaw(right):
    """Guard: with a tilt no place of the yaw but the stated one could be judged."""
    tilt = SignalSheet(name="tilt", at="upper_mid_span", kind="tilt", unit="mrad", white=1e-4)
    rng, rows = np.random.default_rng(1), round(LATE / SPACING)
    still = lambda y: np.concatenate([y[0] + rng.normal(0.0, WHITE, rows), y[:-rows]])  # noqa: E731

    def run(r):
        signals = {n: still(y) if r.name == "r0" else y for n, y in r.signals.items()}
        return replace(r, signals=signals | {"tilt": rng.normal(0.0, tilt.white, len(r.travel))})

    first, *_ = sheet_evidence(replace(with_runs(right, run), signals=(*right.signals, tilt)), ROPE)
    assert (first.mistake.kind, first.mistake.runs, first.certain) == ("yaw_place", ("r0",), True)


WIDE = Quantity(value=0.34)
TWO = lambda c: [s for s in c.signals if s.name in ("y1", "y4")]  # noqa: E731
MISTAKES = {
    "radius": lambda c: replace(c, machine=replace(c.machine, head_radius=WIDE, tail_radius=WIDE)),
    "yaw_sign": lambda c: with_runs(c, lambda r: replace(r, yaw=abs(r.yaw))),
    "points": lambda c: replace(c, signals=tuple(replace(s, at="point_3" if s.name == "y4" else s.at) for s in TWO(c))),
    "travel_unit": lambda c: with_runs(c, lambda r: replace(r, travel=r.travel / 0.3048)),
    "yaw_unit": lambda c: with_runs(c, lambda r: replace(r, yaw=r.yaw * math.pi / 0.18)),
}  # fmt: skip


def only_signals(campaign: Campaign) -> Campaign:
    """The readings of the signals that the sheet states."""
    names = {s.name for s in campaign.signals}
    return with_runs(campaign, lambda r: replace(r, signals={n: y for n, y in r.signals.items() if n in names}))


#: Other base models are asked about these, which takes compiling them.
SLOW = ("radius", "travel_unit", "points")


@pytest.mark.parametrize("kind", [pytest.param(k, marks=[pytest.mark.long] if k in SLOW else []) for k in MISTAKES])
def test_a_mistake_is_named_and_undone(right, kind):
    wrong = only_signals(MISTAKES[kind](right))
    first, *_ = sheet_evidence(wrong, ROPE)
    assert first.mistake.kind == kind
    assert first.mistake.sentence.startswith("check ")
    assert sheet_evidence(first.mistake.campaign, ROPE) == ()


def test_every_mistake_is_a_campaign_and_a_sentence(right):
    for mistake in sheet_mistakes(right):
        assert isinstance(mistake.campaign, Campaign)
        assert "{" not in mistake.sentence
    units = {m.size: m.sentence for m in sheet_mistakes(right) if m.kind == "reading_unit"}
    assert units[0.1].endswith("they look 10 times too large (were mm entered as cm?)")
    assert units[10.0].endswith("they look 10 times too small (were cm entered as mm?)")


def test_a_copied_run_is_told(right):
    first, *rest = right.runs
    copy = replace(right, runs=(first, *rest, replace(first, name="again", repeat_of=first.name)))
    assert any(s.run == "again" and "very readings of run r0" in s.sentence for s in suspicions(copy))


def test_readings_full_of_something_else_are_not_taken_for_another_unit(right):
    """Readings 25 times smaller leave 25 times less of anything; a wave of 2 mm is no mistake of the hand."""
    wave = lambda r: 2e-3 * np.sin(2.0 * math.pi * r.travel / 1.7 + float(r.name[1:]))  # noqa: E731
    shaken = with_runs(right, lambda r: replace(r, signals={n: y + wave(r) for n, y in r.signals.items()}))
    assert not [e.mistake.kind for e in sheet_evidence(shaken, ROPE) if e.certain]
