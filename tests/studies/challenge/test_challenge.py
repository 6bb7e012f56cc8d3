"""A challenge runs end to end, goes on after it was killed, and survives what goes wrong on the way."""

import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from small_challenge import HIDDEN, PATIENCE, answer_of, draw

from belt_sim.campaign import write_campaign
from belt_sim.errors import InputError
from belt_sim.io import ROOT, write_json
from belt_sim.results.diagnosis import RunSettings
from belt_sim.units import DEGREE
from belt_sim.virtual_rig import reveal
from belt_sim.virtual_rig.make import HASH
from studies.challenge.run_case import Task, run_case
from studies.challenge.run_challenge import results, run_challenge
from studies.challenge.score import score_case
from studies.challenge.targets import targets

COUNT = len(HIDDEN)
DEADLINE = 120.0  # [s]


def task(out: Path, who: str) -> Task:
    return Task(seed=0, out=out, source="small_challenge:draw", ablation=f"small_challenge:{who}", bootstraps=100)


def rows(found):
    return [score_case(result) for result in found]


def share(found, name: str):
    return next(t.found for t in targets(rows(found)) if t.name.startswith(name))


@pytest.fixture(scope="module")
def right(tmp_path_factory):
    out = tmp_path_factory.mktemp("right")
    return out, run_challenge(task(out, "oracle"), range(COUNT), workers=1)


@pytest.fixture(scope="module")
def wrong(tmp_path_factory):
    """The same campaigns answered wrongly, in this process."""
    out = tmp_path_factory.mktemp("wrong")
    for seed in range(COUNT):
        run_case(replace(task(out, "wrong"), seed=seed))
    return results(out)


def test_the_truth_is_sealed_and_what_was_answered_is_kept(right):
    out, found = right
    assert [r["seed"] for r in found] == list(range(COUNT))
    for result in found:
        place = out / "sealed" / str(result["seed"])
        assert (place / HASH).read_text().split()[0] == result["truth_sha256"] == reveal(place).sha256()
        assert (place / HASH).stat().st_mtime_ns <= (out / "answers" / f"{result['seed']}.json").stat().st_mtime_ns


def test_who_is_always_right_scores_full_marks_and_who_is_always_wrong_scores_none(right, wrong):
    good, bad = right[1], wrong
    assert [f.outcome for f in rows(good)] == ["right"] * COUNT
    assert [f.outcome for f in rows(bad)] == ["wrong"] * COUNT
    for found, one, none in ((good, 1.0, 0.0), (bad, 0.0, 1.0)):
        assert share(found, "false alarm").value == none
        assert share(found, "two effects").value == one
        assert share(found, "truth named").value == one
        assert share(found, "confidently wrong").value == none


def test_a_challenge_that_is_done_is_not_done_again(right):
    out, _ = right
    kept = {path: path.stat().st_mtime_ns for path in out.rglob("*.json")}
    assert len(run_challenge(task(out, "oracle"), range(COUNT), workers=1)) == COUNT
    assert {path: path.stat().st_mtime_ns for path in out.rglob("*.json")} == kept


def test_an_answer_is_frozen(tmp_path):
    """A run that was stopped between answer and result takes the answer as it stands."""
    one = task(tmp_path, "wrong")
    write_json(one.file("answers"), answer_of("taper"))
    run_case(one)
    (result,) = results(tmp_path)
    assert list(score_case(result).named) == ["taper"]


def test_results_of_other_settings_are_not_mixed(right):
    out, _ = right
    with pytest.raises(InputError, match=r"ablation .*choose another folder"):
        run_challenge(task(out, "wrong"), range(COUNT), workers=1)


def test_no_time_no_campaign(tmp_path):
    assert run_challenge(task(tmp_path, "oracle"), range(COUNT), workers=1, minutes=1e-9) == []


def test_a_crash_a_death_and_a_long_silence_cost_their_own_campaign_only(right, tmp_path):
    for drawn in ("campaigns", "sealed"):
        shutil.copytree(right[0] / drawn, tmp_path / drawn)
    found = run_challenge(task(tmp_path, "troubled"), range(COUNT), workers=2, patience=PATIENCE)
    facts = rows(found)
    assert [f.outcome for f in facts] == ["crash", "crash", "crash", "right"]
    assert "ValueError: no such thing" in facts[0].sentence
    assert "exit code 7" in facts[1].sentence
    assert f"no answer within {PATIENCE:g} s" in facts[2].sentence
    assert [f.hidden for f in facts] == [list(h) for h in HIDDEN]  # a crash is counted where it belongs


def test_a_truth_that_changed_since_it_was_sealed_is_refused(tmp_path):
    one = task(tmp_path, "oracle")
    place = one.file("sealed")
    place.mkdir(parents=True)
    (place / HASH).write_text("0123  truth.sealed\n")
    run_case(one)
    (result,) = results(tmp_path)
    assert "sealed earlier" in result["answer"]["sentence"]
    assert score_case(result).outcome == "crash"


def test_killed_outright_it_goes_on_where_it_was(tmp_path):
    settings = ["source=small_challenge:draw", "ablation=small_challenge:slow_oracle", "bootstraps=100"]
    settings += [f"count={COUNT}", "workers=1", f"folder={tmp_path}"]
    command = [sys.executable, "-m", "studies.challenge", *settings]
    paths = os.pathsep.join([str(ROOT), str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    run = subprocess.Popen(command, env=os.environ | {"PYTHONPATH": paths}, cwd=tmp_path, stdout=subprocess.DEVNULL)
    first, began = tmp_path / "results" / "0.json", time.monotonic()
    while not first.exists() and run.poll() is None and time.monotonic() - began < DEADLINE:
        time.sleep(0.05)
    run.send_signal(signal.SIGKILL)
    run.wait()
    kept, there = first.stat().st_mtime_ns, len(results(tmp_path))
    assert 1 <= there < COUNT
    assert len(run_challenge(task(tmp_path, "slow_oracle"), range(COUNT), workers=1)) == COUNT
    assert first.stat().st_mtime_ns == kept
    assert [f.outcome for f in rows(results(tmp_path))] == ["right"] * COUNT


def test_a_further_run_is_of_the_same_line(tmp_path):
    from studies.challenge.oracle import add_follow_up_run, advised_run

    campaign, truth = draw(1)
    settings = RunSettings(tension=30e6, yaw=0.042 * DEGREE, speed=0.5, direction=1.0, travel=20.0, all_points=True)
    run, signals = advised_run(campaign, settings)
    longer = write_campaign(add_follow_up_run(campaign, truth, run, signals, 5), tmp_path / "longer")
    fresh, same = longer.runs[-1], campaign.runs[3]
    assert (fresh.tension, fresh.yaw) == pytest.approx((same.tension, same.yaw))
    assert set(fresh.signals) == {"y1", "y2", "y3", "y4"}
    assert abs(fresh.signals["y1"] - same.signals["y1"]).max() < 1.5e-3 < abs(same.signals["y1"]).max()


@pytest.mark.parametrize(
    ("drawn", "who", "named"),
    [
        ("small_challenge:draw_kept", "small_challenge:kept", "sag_roll"),
        pytest.param("small_challenge:draw", "diagnosis", "cant", marks=pytest.mark.long),
    ],
)
def test_the_diagnosis_itself_answers(drawn, who, named, tmp_path):
    """One effect, large, on a small plan: named; of small_campaign among few, in the long test of the whole library."""
    run_case(Task(seed=1, out=tmp_path, source=drawn, ablation=who, bootstraps=100))
    (result,) = results(tmp_path)
    found = score_case(result)
    assert (found.outcome, list(found.named)) == ("right", [named])
    assert result["least"]["plain_mm"] > 0
    assert {"draw", "answer"} <= set(result["seconds"])
