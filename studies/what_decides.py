"""Which measurement would decide why a slack belt runs faster: ``python -m studies.what_decides``.

The explanations of studies/conf/what_decides.yaml, each at the smallest size that agrees with the paper
(docs/data/open_question.md). For each pair: how many sigma apart the readings of the measured runs are, and with each
further run of the diagnosis's own menu, the other explanation's numbers, noise, zero and setting errors refitted.
Leaves OUT, which ``make paper`` shows.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.campaign import Campaign
from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.next_run import Outlook
from belt_sim.diagnosis.workbench import Workbench, workbench
from belt_sim.effects.base import library
from belt_sim.io import provenance, write_json
from belt_sim.model import analytic_model
from belt_sim.units import DEGREE, N_PER_MM2
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import Noise, Plan, RunSetting
from studies.application import application


@dataclass(frozen=True)
class Explanation:
    """words; effects {id: {parameter: size in SI}}, empty where nothing is missing and the record is too short."""

    words: str
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)


def campaign_of(tensions: Sequence[float], config: dict[str, Any]) -> Campaign:
    """Runs of the strip with nothing hidden; only their plan and their stated noise matter here."""
    yaw = config["yaw"] * DEGREE
    runs = tuple(RunSetting(tension=t * N_PER_MM2, yaw=yaw) for t in tensions)
    plan = Plan(runs=runs, length=config["length"], signals={"y1": "point_1", "y4": "point_4"})
    return make_campaign(hidden=[], seed=config["seed"], base="strip", plan=plan, noise=Noise())[0]


def fit_of(bench: Workbench, e: Explanation) -> Fit:
    """Predictions and whitened derivatives where the explanation has its size."""
    vector, free = bench.forward.null(), []
    for effect, sizes in e.effects.items():
        for k in bench.forward.index(effect):
            slot = bench.forward.slots[k]
            if slot.name in sizes:
                vector[k] = sizes[slot.name] / slot.scale
                free.append(k)
    start = bench.start([*e.effects], vector, free)
    values, slopes = bench.forward.expand(vector, free)
    return replace(start, values=values, columns=bench.metric.whiten(slopes))


def separation(outlook: Outlook, truth: Fit, other: Fit) -> tuple[float, list[float]]:
    """sigma by which ``other``, refitted, misses what ``truth`` gives: by the measured runs, and with each action."""

    def rest(gap: np.ndarray, columns: np.ndarray) -> float:
        return float(np.linalg.norm(gap - columns.T @ np.linalg.lstsq(columns.T, gap, rcond=1e-9)[0]))

    known = outlook.bench.metric.whiten(truth.values - other.values).ravel()
    own = other.columns.reshape(len(other.free), known.size)
    there, (instead, along) = outlook.predict(truth, [])[0], outlook.predict(other, other.free)
    new, further = outlook.white(there - instead), outlook.white(along)
    after = [
        rest(np.concatenate([known, new[r]]), np.concatenate([own, further[:, r]], axis=1)) for r in range(len(new))
    ]
    return rest(known, own), after


def separations(campaign: Campaign, found: Sequence[Explanation]) -> dict[str, Any]:
    """Every pair of explanations, and for each action of the menu the pair that it tells apart least."""
    ids = sorted({i for e in found for i in e.effects})
    bench = workbench(campaign, analytic_model("strip"), [library()[i] for i in ids])
    fits = [fit_of(bench, e) for e in found]
    outlook = Outlook(bench, fits[1])
    pairs: list[dict[str, Any]] = []
    with_action: list[list[float]] = []
    for truth, a in zip(found, fits, strict=True):
        for other, b in zip(found, fits, strict=True):
            if a is not b and truth.effects:
                before, after = separation(outlook, a, b)
                pairs.append({"truth": truth.words, "instead": other.words, "measured": before})
                with_action.append(after)
    least = np.min(with_action, axis=0)
    closest = min(pairs, key=lambda p: float(p["measured"]))
    return {
        "pairs": pairs,
        "least_measured": closest["measured"],
        "closest": [closest["truth"], closest["instead"]],
        "actions": [{"words": outlook.actions[k].words, "least": float(least[k])} for k in np.argsort(-least)],
    }


def what_decides(config: dict[str, Any]) -> None:
    """One run at the low tension; the four tensions of the paper."""
    found = [Explanation(words, effects) for words, effects in config["explanations"].items()]
    slack, all_four = (separations(campaign_of(t, config), found) for t in ([config["slack"]], config["tensions"]))
    noise = Noise()
    stated = {"white_mm": 1e3 * noise.white, "wander_mm": 1e3 * noise.wander_sd, "zero_mm": 1e3 * noise.zero,
              "tension_relative": noise.tension_rel, "yaw_urad": 1e6 * noise.yaw_u}  # fmt: skip
    content = {
        "command": "python -m studies.what_decides",
        "commit": provenance()["commit"],
        "length_m": config["length"],
        "slack_N_per_mm2": config["slack"],
        "tensions_N_per_mm2": config["tensions"],
        "noise": stated,
        "explanations": [e.words for e in found],
        "one_run": slack,
        "four_tensions": all_four,
    }
    print(write_json(Path(config["out"]), content))
    for name in ("one_run", "four_tensions"):
        print(name, "least", content[name]["least_measured"])  # type: ignore[index]
        for action in content[name]["actions"]:  # type: ignore[index]
            print(f"  {action['least']:8.1f}  {action['words']}")


if __name__ == "__main__":
    application("what_decides", what_decides)
