"""Who answers: the diagnosis as people use it, and the diagnosis with one of its parts taken away."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from belt_sim.campaign import Campaign, read_campaign
from studies.challenge.sources import function

#: answer(folder of the campaign, bootstraps, seed, base model) -> content of diagnosis.json
Answer = Callable[[Path, int, int, str], dict[str, Any]]
#: parts of an answer that no score looks at, and that are long
_LONG = ("per_run", "runs_schema", "schema", "where", "provenance", "admitted")
_CURVES = ("courses", "against", "curve", "effect_file", "campaign", "base_model")


def diagnosed(folder: Path, bootstraps: int, seed: int, base: str) -> dict[str, Any]:
    """What the diagnosis says of a campaign on disk."""
    return _diagnosed(read_campaign(folder), bootstraps, seed, base)


def no_repeats(folder: Path, bootstraps: int, seed: int, base: str) -> dict[str, Any]:
    """The same of the campaign without its repeats: noise has to be taken as stated."""
    campaign = read_campaign(folder)
    runs = tuple(run for run in campaign.runs if run.repeat_of is None)
    return _diagnosed(replace(campaign, runs=runs), bootstraps, seed, base, advise=False)


def no_whitening(folder: Path, bootstraps: int, seed: int, base: str) -> dict[str, Any]:
    """The same, all noise taken as independent from sample to sample: as large as stated, but without its length."""
    return _diagnosed(unwandering(read_campaign(folder)), bootstraps, seed, base, advise=False)


def unwandering(campaign: Campaign) -> Campaign:
    """The campaign with wander stated as white noise of the same variance."""
    signals = tuple(
        replace(s, white=(s.white**2 + s.wander_sd**2) ** 0.5, wander_sd=0.0, wander_length=1.0)
        for s in campaign.signals
    )
    return replace(campaign, signals=signals)


def _diagnosed(campaign: Campaign, bootstraps: int, seed: int, base: str, advise: bool = True) -> dict[str, Any]:
    from belt_sim.results.written import diagnosis_json
    from belt_sim.use_cases.diagnose import diagnose

    content = diagnosis_json(diagnose(campaign, base, bootstraps=bootstraps, seed=seed, advise=advise))
    kept = {key: value for key, value in content.items() if key not in _LONG}
    if "discovery" in kept:
        kept["discovery"] = {k: v for k, v in kept["discovery"].items() if k not in (*_LONG, *_CURVES)}
    return kept


OWN = "diagnosis"
ANSWERS: dict[str, Answer] = {OWN: diagnosed, "no_repeats": no_repeats, "no_whitening": no_whitening}
#: the diagnosis without one of its parts; plain methods have answered the same campaigns beside the whole one
ABLATIONS = tuple(name for name in ANSWERS if name != OWN)


def answerer(name: str) -> Answer:
    """Who answers, by name, or one's own as ``module:function``; raises InputError when there is none."""
    return ANSWERS.get(name) or function(name, "ablation", ANSWERS)
