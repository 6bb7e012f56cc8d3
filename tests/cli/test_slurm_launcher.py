"""Jobs of submitit, Hydra's own launcher: only what is missing is computed, losses are told."""

import pandas as pd
import pytest

pytest.importorskip("hydra_plugins.hydra_submitit_launcher")
HERE = ("model=rope", "travel=2", "pictures=false")


def test_jobs_leave_one_table_and_keep_what_is_done(belt):
    first = belt("simulate", "-m", "tension=20", *HERE)
    assert first.status == 0, first.err
    done = {p: p.stat().st_ino for p in belt.folder.glob("*/summary.json")}
    more = belt("simulate", "-m", "tension=20,2000", *HERE, "hydra/launcher=submitit_local")
    assert more.status == 1
    assert {p: p.stat().st_ino for p in belt.folder.glob("*/summary.json")} == done
    table = pd.read_csv(belt.folder / "sweep.csv").set_index("tension")
    assert table.loc[2000, "failed"].startswith("tension = 2000 N/mm2")
    assert table.loc[20, "rate1_mm_per_m"] < 0


def test_without_slurm_one_line(belt):
    answer = belt("simulate", "-m", "tension=20,30", *HERE, "hydra/launcher=submitit_slurm")
    assert answer.status == 1
    assert answer.err.startswith("belt-sim: ")
    assert "srun" in answer.err
    assert len(answer.err.splitlines()) == 1
