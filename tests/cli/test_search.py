"""A search by Hydra's Optuna sweeper: simulate returns the number that is to be small."""

import pytest
import yaml

from belt_sim.commands.cases import CentringGoal
from belt_sim.curves import read_curves

pytest.importorskip("hydra_plugins.hydra_optuna_sweeper")


def test_the_best_of_a_few_runs_is_the_best_of_what_they_left(belt):
    few = ("+experiment=centre_belt", "hydra.sweeper.n_trials=4", "travel=100")
    answer = belt("simulate", *few)
    assert answer.status == 0, answer.err
    assert "best of 4: " in answer.out  # and the end of the sweep raised nothing
    assert (belt.folder / "sweep.csv").is_file()
    wanted = CentringGoal.from_setting({"start": 10.0, "within": 1.0, "beyond": 0.2})
    reached = [wanted.measures(c.travel, c.y)[2] for c in map(read_curves, belt.folder.glob("*/curves.csv"))]
    best = yaml.safe_load((belt.folder / "optimization_results.yaml").read_text(encoding="utf-8"))
    assert len(reached) == 4
    assert best["best_value"] == pytest.approx(min(reached))
    assert set(best["best_params"]) == {f"steering.{n}" for n in ("first", "turn", "second", "over")}


@pytest.mark.parametrize("wrong", ["objective=3", "objective={start: 10, wihtin: 1, beyond: 0}"])
def test_an_objective_that_cannot_be_is_told_before_the_first_trial(belt, wrong):
    answer = belt.simulate("hydra/sweeper=optuna", "hydra.sweeper.n_trials=2", wrong, "-m", "tension=interval(10,20)")
    assert answer.status == 1
    assert "write {start: mm, within: mm, beyond: mm}" in answer.err
    assert not list(belt.folder.glob("*"))


def test_an_objective_that_cannot_be_is_told_in_one_line(belt):
    answer = belt.simulate("objective=fast")
    assert answer.status == 1
    assert answer.err.startswith("belt-sim: objective = fast")
