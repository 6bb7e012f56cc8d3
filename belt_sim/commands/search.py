"""A search by Optuna: which settings make the number small (or large) that a run returns.

The settings are those of Hydra's group ``hydra/sweeper: optuna``: direction, n_trials, sampler, params.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import yaml
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import IntervalSweep
from hydra.errors import HydraException

from belt_sim.commands.command_line import Request, case_of
from belt_sim.commands.run_dir import Outcome, RunDir, run_case
from belt_sim.errors import BeltError
from belt_sim.files import write_text
from belt_sim.whole_number import whole


def search(request: Request) -> tuple[list[RunDir], list[Outcome]]:
    """Run the trials of a search and leave optimization_results.yaml with the best; returns all of them."""
    if request.searcher != "optuna":
        raise BeltError(f"hydra/sweeper = {request.searcher}: use basic or optuna")
    try:
        import optuna
        from hydra.utils import instantiate
    except ImportError as missing:
        raise BeltError("a search needs Optuna: pip install 'belt-sim[sweeps]'") from missing
    settings = request.searching
    trials = whole("hydra.sweeper.n_trials", settings["n_trials"])
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    direction = str(settings["direction"]).rpartition(".")[2]
    study = optuna.create_study(
        sampler=instantiate(settings["sampler"]),
        direction=direction,
        storage=settings["storage"],
        study_name=settings["study_name"],
        load_if_exists=True,
    )
    fixed, ranges = _split(request)
    runs, outcomes = [], []
    for number in range(trials):
        trial = study.ask()
        tried = [f"{key}={suggest(trial, key, ranges[key])}" for key in ranges]
        runs.append(case_of(request.command, request, [*fixed, *tried], number))
        outcomes.append(run_case(runs[-1]))
        value = outcomes[-1].value
        state = optuna.trial.TrialState.FAIL if value is None else optuna.trial.TrialState.COMPLETE
        study.tell(trial, value, state=state)
    best = {"name": "optuna", "best_params": dict(study.best_params), "best_value": study.best_value}
    assert request.folder is not None
    write_text(request.folder / "optimization_results.yaml", yaml.safe_dump(best, sort_keys=False))
    print(f"best of {trials}: {best['best_value']:.4g} with {best['best_params']}")
    return runs, outcomes


def _split(request: Request) -> tuple[list[str], dict[str, Any]]:
    """Overrides that all trials share, and the range or the choices of each key that is tried."""
    fixed, ranges = [], {}
    try:
        parsed = OverridesParser.create().parse_overrides(list(request.lines))
    except HydraException as error:
        raise BeltError(f"hydra.sweeper.params: {str(error).splitlines()[0]}") from error
    for override in parsed:
        if not override.is_sweep_override():
            fixed.append(str(override.input_line))
        elif override.is_interval_sweep():
            ranges[override.get_key_element()] = override.value()
        else:
            ranges[override.get_key_element()] = list(override.sweep_string_iterator())
    return fixed, ranges


def suggest(trial: Any, key: str, among: IntervalSweep | Sequence[str] | Mapping[str, Any]) -> Any:
    """What Optuna tries next for a key."""
    if not isinstance(among, IntervalSweep):
        return trial.suggest_categorical(key, among)
    low, high = among.start or 0.0, among.end or 0.0
    if (isinstance(low, int) and isinstance(high, int)) or "int" in among.tags:
        return trial.suggest_int(key, int(low), int(high), log="log" in among.tags)
    return trial.suggest_float(key, low, high, log="log" in among.tags)
