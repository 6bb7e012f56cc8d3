"""A sweep shared by two workers takes up what one has begun."""

import json

import pytest

TENSIONS = (20.0, 30.0, 40.0)
TWO = ("hydra/launcher=joblib", "hydra.launcher.n_jobs=2")


def test_two_workers_resume_what_one_has_begun(belt):
    one = belt("simulate", "-m", "travel=2", "pictures=false", "tension=20,30")
    assert one.status == 0, one.err
    alone = {p: p.stat().st_ino for p in belt.folder.glob("*/summary.json")}
    assert len(alone) == 2
    two = belt("simulate", "-m", "travel=2", "pictures=false", "tension=20,30,40", *TWO)
    assert two.status == 0, two.err
    assert {p: p.stat().st_ino for p in alone} == alone  # kept, not written again
    found = [json.loads(p.read_text(encoding="utf-8")) for p in belt.folder.glob("*/summary.json")]
    steady = {s["tension_n_per_mm2"]: s["steady_rate_mm_per_m"] for s in found}
    assert sorted(steady) == list(TENSIONS)
    assert steady[40.0] == pytest.approx(-0.15201, abs=1e-5)  # the table of steady rates
    assert len((belt.folder / "sweep.csv").read_text(encoding="utf-8").splitlines()) == 1 + len(TENSIONS)
