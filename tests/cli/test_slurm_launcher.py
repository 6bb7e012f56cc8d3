"""The launcher for Slurm, with jobs run in this process: several cases a job, only what is missing, losses listed."""

import pandas as pd
import pytest

from belt_sim.commands import sweep

HERE = ("travel=2", "pictures=false", "hydra/launcher=slurm", "hydra.launcher.cluster=debug")


def test_only_what_is_missing_is_submitted(belt):
    first = belt("simulate", "-m", "tension=20,30", *HERE)
    assert first.status == 0, first.err
    assert "2 of 2 cases to run, in 2 jobs" in first.out
    more = belt("simulate", "-m", "tension=20,30,40,50,2000", *HERE, "hydra.launcher.cases_per_job=2")
    assert more.status == 1
    assert "3 of 5 cases to run, in 2 jobs" in more.out
    assert more.out.count("done before, kept") == 2
    table = pd.read_csv(belt.folder / "sweep.csv")
    assert len(table) == 5
    assert table["failed"].notna().sum() == 1


def test_a_job_that_is_lost_is_listed_and_stops_nothing(belt, monkeypatch):
    submitit = pytest.importorskip("submitit")

    class Lost:
        job_id, state = "7_1", "OUT_OF_MEMORY"

        def done(self, force_check=False):
            return True

        def results(self):
            raise submitit.core.utils.UncompletedJobError("killed")

    whole = sweep.submit_jobs
    monkeypatch.setattr(sweep, "submit_jobs", lambda *a: [Lost(), *whole(*a)[1:]])
    answer = belt("simulate", "-m", "tension=20,30,40", *HERE)
    assert answer.status == 1
    assert "Traceback" not in answer.err
    table = pd.read_csv(belt.folder / "sweep.csv")
    assert table["rate1_mm_per_m"].notna().sum() == 2
    told = table["failed"].dropna().tolist()
    assert len(told) == 1
    assert told[0].startswith("job 7_1 was lost (OUT_OF_MEMORY)")


def test_without_slurm_one_line(belt):
    answer = belt("simulate", "-m", "tension=20,30", *HERE, "hydra.launcher.cluster=nowhere")
    assert answer.status == 1
    assert answer.err.startswith("belt-sim: hydra.launcher: ")
    assert len(answer.err.splitlines()) == 1
