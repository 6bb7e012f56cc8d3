"""Progress is quiet where nobody looks."""

import io
import json
import re
from itertools import pairwise

import pytest
from moving_belt import case, curves, frames
from rich.console import Console

from belt_sim.show.terminal import (
    AS_JSON,
    BEYOND_CATALOGUE,
    FITTING,
    LAW_OF_REST,
    PREPARING,
    SOMETIMES,
    STAGES,
    ProgressObserver,
    in_stages,
    progress,
)


def test_without_a_terminal_a_line_each_tenth():
    console = Console(file=io.StringIO(), force_terminal=False, width=120)
    with progress(1000, "bootstrap", console) as done:
        for _ in range(1000):
            done()
    lines = console.file.getvalue().splitlines()
    assert len(lines) == 10
    assert lines[4].startswith("bootstrap:  50 %")
    assert lines[-1].startswith("bootstrap: 100 %")


@pytest.mark.parametrize("left_out", [set(), SOMETIMES])
def test_where_a_stage_begins_the_end_is_told(monkeypatch, left_out):
    """Of a diagnosis whose stages take what they are said to take, in all 0.4 s a percent."""
    stages = [s for s in STAGES if s not in left_out]
    console, now = Console(file=io.StringIO(), force_terminal=False, width=120), 0.0
    monkeypatch.setattr("time.monotonic", lambda: now)
    with progress(1.0, "diagnosing", console, timed=False) as done:
        tell = in_stages(done)
        for before, stage in pairwise(stages):
            now += 0.4 * STAGES[before]
            tell(200 if stage == "drawing" else 0, stage if stage != "drawing" else "")
    lines, end = console.file.getvalue().splitlines(), 0.4 * sum(STAGES[s] for s in stages)
    assert len(lines) == len(stages) - 1  # a line a stage
    early = stages.index(BEYOND_CATALOGUE) - 1  # before: the fits may take as long as they like
    assert all(line.endswith(" s gone") for line in lines[:early])
    told = [line.split(" of about ")[1] for line in lines[early:]]
    at = stages.index(LAW_OF_REST) - 1 - early if LAW_OF_REST in stages else len(STAGES)
    seconds = [float(text.split()[0]) for text in told]
    assert [text.endswith(", longer if a law is sought") for text in told] == [True, *[False] * (len(told) - 1)]
    assert seconds[:at] == pytest.approx(
        [0.4 * sum(STAGES[s] for s in stages if s != LAW_OF_REST)] * len(told[:at]), rel=0.3
    )
    assert seconds[at + 1 :] == pytest.approx([end] * len(told[at + 1 :]), rel=0.3)
    assert seconds[-1] == pytest.approx(end, rel=0.03)


@pytest.mark.parametrize(("begins", "ends"), [(131.0, 195.0), (87.0, 117.0), (72.0, 118.0)])
def test_where_the_search_for_a_law_begins_the_end_is_estimated_anew(begins, ends, monkeypatch):
    """Of blind campaigns, when the search begins and when all ends [s]: the median, a short and a long one."""
    console, now = Console(file=io.StringIO(), force_terminal=False, width=120), 0.0
    monkeypatch.setattr("time.monotonic", lambda: now)
    with progress(1.0, "diagnosing", console, timed=False) as done:
        tell = in_stages(done)
        for share, stage in ((0.1, PREPARING), (0.2, FITTING), (0.3, BEYOND_CATALOGUE), (1.0, LAW_OF_REST)):
            now = share * begins
            tell(0, stage)
    (told,) = re.findall(f"{LAW_OF_REST}.* of about (\\d+) s$", console.file.getvalue(), re.MULTILINE)
    assert float(told) == pytest.approx(ends, rel=0.3)


def test_a_slow_first_stage_does_not_make_all_others_slow(monkeypatch):
    """47 s until an effect of one's own was loaded; the whole took 75 s."""
    console, now = Console(file=io.StringIO(), force_terminal=False, width=120), 0.0
    monkeypatch.setattr("time.monotonic", lambda: now)
    with progress(1.0, "diagnosing", console, timed=False) as done:
        tell = in_stages(done)
        for now, stage in ((47.0, PREPARING), (58.0, FITTING), (62.0, BEYOND_CATALOGUE)):  # noqa: B007
            tell(0, stage)
    (told,) = re.findall(" of about (\\d+) s", console.file.getvalue())
    assert float(told) == pytest.approx(75.0, rel=0.2)


def test_a_stage_that_nobody_knows_moves_nothing():
    console = Console(file=io.StringIO(), force_terminal=False, width=120)
    with progress(1.0, "diagnosing", console, timed=False) as done:
        tell = in_stages(done)
        for k in range(30):
            tell(0, f"stage {k}")
    lines = console.file.getvalue().splitlines()
    assert lines[-1] == "diagnosing: stage 29, 0 s gone"


def test_a_run_tells_travel_speed_and_time_left():
    console = Console(file=io.StringIO(), force_terminal=False, width=160)
    watcher = ProgressObserver("r01", console)
    watcher.start(case(), 10.0)
    for frame in frames(10.0):
        watcher.frame(frame)
    watcher.finish(curves(10.0))
    lines = console.file.getvalue().splitlines()
    assert len(lines) == 10
    assert "5.0 of 10 m at 0.50 m/s" in lines[4]
    assert "s left" in lines[4]


def test_time_left_counts_the_run_in_and_not_the_compilation(monkeypatch):
    """100 s until the first step, then 1 s a percent of the steps, the first half of them before travel 0."""
    console, now = Console(file=io.StringIO(), force_terminal=False, width=160), 0.0
    monkeypatch.setattr("time.monotonic", lambda: now)
    watcher = ProgressObserver("r01", console)
    watcher.start(case(), 10.0)
    for percent in range(100):
        now = 100.0 + percent
        watcher.advance(percent / 100)
    lines = console.file.getvalue().splitlines()
    assert "20 s gone, 80 s left" in lines[1]
    assert "80 s gone, 20 s left" in lines[7]


def test_a_worker_of_a_sweep_prints_lines_on_a_terminal_too(monkeypatch):
    monkeypatch.setattr("multiprocessing.parent_process", lambda: "the sweep")
    console = Console(file=io.StringIO(), force_terminal=True, width=160)
    with progress(2, "mujoco_flex, 60 N/mm2, job 1", console) as done:
        done()
        done()
    lines = console.file.getvalue().splitlines()
    assert [line[:34] for line in lines] == [f"mujoco_flex, 60 N/mm2, job 1: {p:3d} %"[:34] for p in (50, 100)]


def test_on_a_terminal_there_is_a_bar():
    console = Console(file=io.StringIO(), force_terminal=True, width=160)
    with progress(2, "rank", console) as done:
        done(note="taper")
        done(note="cant")
    assert "100 %" in console.file.getvalue()
    assert "cant" in console.file.getvalue()


def test_a_program_reads_progress_as_objects(monkeypatch, capsys):
    now = 0.0
    monkeypatch.setenv(AS_JSON, "1")
    monkeypatch.setattr("time.monotonic", lambda: now)
    with progress(1.0, "diagnose", Console(file=io.StringIO()), timed=False) as done:
        done(0.2, FITTING)
        now = 8.0
        done(0.2, BEYOND_CATALOGUE)
    fitting, beyond = map(json.loads, capsys.readouterr().err.splitlines())
    assert fitting == {"stage": FITTING, "in_all_s": 0.0, "more": ""}  # the fits may take as long as they like
    assert beyond["in_all_s"] == 20.0
    assert "law" in beyond["more"]
