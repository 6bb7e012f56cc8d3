"""Stored runs in three dimensions: each says how it is made again, and is what its figure says it is."""

import numpy as np
import pytest

from belt_sim.errors import InputError
from belt_sim.model import analytic_model
from studies.paper.models import case_at, moving
from studies.paper.stored_runs import names, stored_run

BESIDE_THE_LAW = {
    "flex_7": 0.02,
    "flex_10": 0.02,
    "flex_20": 0.02,
    "flex_40": 0.02,
}  # studies/notes/three_dimensions.md: 1.1 %


@pytest.mark.parametrize("name", names())
def test_it_says_command_commit_and_cost(name):
    run = stored_run(name)
    assert run.command.startswith(f"python -m studies.space_run name={name} ")
    assert f"tension={run.tension:g}" in run.command or run.tension == 40.0
    assert len(run.made["commit"]) == 40
    assert run.made["cpu_s"] > 0.0
    assert run.curves.travel[0] == 0.0
    assert run.curves.travel[-1] == pytest.approx(run.made["travel_m"], abs=0.15)
    assert "/" not in run.command.replace("outputs/study", "")


@pytest.mark.parametrize("name", BESIDE_THE_LAW)
def test_the_membrane_is_near_the_strip_law(name):
    run = stored_run(name)
    law = moving("strip", run.tension)
    y = np.interp(np.asarray(law.travel), np.asarray(run.curves.travel), np.asarray(run.curves.y)[0])
    y_law = np.asarray(law.y)[0]
    assert np.abs(y - y_law).max() < BESIDE_THE_LAW[name] * np.abs(y_law).max()


@pytest.mark.parametrize("name", ["flex_7_far", "flex_10_far"])
def test_the_far_runs_settle_at_the_laws_rate(name):
    mean, slowest, fastest = stored_run(name).rates()
    assert mean == pytest.approx(analytic_model("strip").steady_rate(case_at(stored_run(name).tension)), rel=0.03)
    assert min(slowest, fastest) <= mean <= max(slowest, fastest)


def test_an_unknown_run_is_named():
    with pytest.raises(InputError, match="nothing_of_the_kind"):
        stored_run("nothing_of_the_kind")
