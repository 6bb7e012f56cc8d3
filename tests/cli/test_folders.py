"""A run's folder holds that run and no other; a sweep's folder bears a name that any file system takes."""

import json

from belt_sim.commands import runs
from belt_sim.commands.cli import LONGEST_FOLDER_NAME, folder_name, run_command


def test_nothing_of_an_earlier_run_stays(belt):
    belt("simulate", "model=rope", "travel=2")
    assert (belt.folder / "curves.svg").is_file()
    (belt.folder / "mine.txt").write_text("a note of the user's", encoding="utf-8")
    belt("simulate", "model=rope", "travel=2", "tension=20", "pictures=false")
    assert not (belt.folder / "curves.svg").exists()
    assert (belt.folder / "mine.txt").is_file()
    assert json.loads((belt.folder / "summary.json").read_text())["tension_n_per_mm2"] == 20


def test_of_two_runs_in_one_folder_the_second_is_refused_and_takes_nothing_away(belt):
    notes = belt.folder / ".hydra"
    notes.mkdir(parents=True)
    with (notes / "lock").open("a") as other:
        runs.fcntl.flock(other, runs.fcntl.LOCK_EX)
        answer = belt("simulate", "model=strip", "travel=2")
    assert answer.status == 1
    assert "another run is at work there" in answer.err
    assert (notes / "lock").is_file()


def test_a_refused_run_leaves_no_folder(belt):
    assert belt("simulate", "tension=-4").status == 1
    assert not belt.folder.exists()


def test_a_sweep_over_files_makes_one_folder_a_run(belt, tmp_path):
    table = tmp_path / "effects.yaml"
    table.write_text("schema: belt-effects/1\neffects: [{id: taper, kappa_t: 1.0e-5}]\n", encoding="utf-8")
    answer = belt("simulate", "-m", f"effects={table}", "tension=20,40", "travel=2", "pictures=false")
    assert answer.status == 0, answer.err
    assert (belt.folder / "sweep.csv").is_file()
    assert len(list(belt.folder.glob("*/summary.json"))) == 2


def test_names_of_folders():
    assert folder_name("tension=7,yaw=0.1") == "tension=7,yaw=0.1"
    long = "effects=" + "x" * 400
    assert len(folder_name(long)) < LONGEST_FOLDER_NAME + 10
    assert folder_name(long) != folder_name(long + "y")
    assert "/" not in folder_name("effects=/a/b.yaml")
    assert folder_name("effects=/a/b.yaml") != folder_name("effects=_a_b.yaml")


def test_two_sweeps_have_two_folders(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for tensions in ("30,40", "50,60"):
        assert run_command(["simulate", "-m", "model=rope", "travel=2", "pictures=false", f"tension={tensions}"]) == 0
    assert {p.parent.name for p in tmp_path.glob("outputs/simulate/sweep/*/sweep.csv")} == {
        f"model=rope,pictures=false,tension={tensions},travel=2" for tensions in ("30,40", "50,60")
    }


def test_of_two_sweeps_in_one_folder_the_second_is_refused(belt):
    belt.folder.mkdir()
    with (belt.folder / runs.CASES).open("a") as other:
        runs.fcntl.flock(other, runs.fcntl.LOCK_EX)
        answer = belt("simulate", "-m", "model=rope", "travel=2", "pictures=false", "tension=30,40")
    assert answer.status == 1
    assert answer.err.startswith(f"belt-sim: hydra.sweep.dir = {belt.folder}: another sweep is at work there")
    assert not list(belt.folder.glob("*/summary.json"))
