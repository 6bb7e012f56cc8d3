"""Which measurement would decide why a slack belt runs faster: ``python -m studies.what_decides``.

What may stand behind M3 (docs/open_question.md), each at the size at which the belt of 10 N/mm2 is as fast as that of
40: nothing but records too short, a camber, a load cell that reads too much. How many sigma apart the readings of
measured runs are, and with each further run of the diagnosis's own menu, the other explanation's numbers, noise, zero
and setting errors refitted. Leaves OUT, which make paper shows.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.analytic.model import analytic_model
from belt_sim.campaign import Campaign
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench, workbench
from belt_sim.diagnosis.next_run import Outlook
from belt_sim.effects.belt_shape import Camber
from belt_sim.effects.tension import TensionBias
from belt_sim.files import write_json
from belt_sim.provenance import provenance
from belt_sim.si import DEGREE, N_PER_MM2
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import Noise, Plan, RunSetting
from studies.application import application


@dataclass(frozen=True)
class Explanation:
    """words; effect and parameter with its size in SI; None: nothing is missing, the record is too short."""

    words: str
    effect: str | None = None
    parameter: str = ""
    size: float = 0.0


def explanations(config: dict[str, Any]) -> list[Explanation]:
    """The strip alone, and what lifts its rate at 10 N/mm2 to that at 40."""
    return [
        Explanation("records too short, nothing missing"),
        Explanation(f"camber of {config['camber']:.2g} 1/m", "camber", "kappa_c", -config["camber"]),
        Explanation(f"load cell that reads {config['bias']:g} N/mm2 too much", "tension_bias", "bias",
                    -config["bias"] * N_PER_MM2),
    ]  # fmt: skip


def campaign_of(tensions: Sequence[float], config: dict[str, Any]) -> Campaign:
    """Runs of the strip with nothing hidden; only their plan and their stated noise matter here."""
    yaw = config["yaw"] * DEGREE
    runs = tuple(RunSetting(tension=t * N_PER_MM2, yaw=yaw) for t in tensions)
    plan = Plan(runs=runs, length=config["length"], signals={"y1": "point_1", "y4": "point_4"})
    return make_campaign(hidden=[], seed=config["seed"], base="strip", plan=plan, noise=Noise())[0]


def fit_of(bench: Workbench, e: Explanation) -> Fit:
    """Predictions and whitened derivatives where the explanation has its size."""
    vector = bench.forward.null()
    free = [k for k in bench.forward.index(e.effect) if bench.forward.slots[k].name == e.parameter] if e.effect else []
    for k in free:
        vector[k] = e.size / bench.forward.slots[k].scale
    start = bench.start([e.effect] if e.effect else [], vector, free)
    values, slopes = bench.forward.expand(vector, free)
    return replace(start, values=values, columns=bench.metric.whiten(slopes))


def separations(campaign: Campaign, config: dict[str, Any]) -> dict[str, Any]:
    """Every pair, sigma of what is measured, and with each action; a truth with nothing missing has no size to miss."""
    bench = workbench(campaign, analytic_model("strip"), [Camber, TensionBias])
    found = explanations(config)
    fits = [fit_of(bench, e) for e in found]
    outlook = Outlook(bench, fits[1])
    pairs: list[dict[str, Any]] = []
    for a, truth in enumerate(found):
        for b, other in enumerate(found):
            if a != b and truth.effect:
                before, after = outlook.separations(fits[a], fits[b])
                pairs.append(
                    {"truth": truth.words, "instead": other.words, "measured": before, "after": after.tolist()}
                )
    least = np.min([p["after"] for p in pairs], axis=0)
    order = np.argsort(-least)
    return {
        "pairs": pairs,
        "least_measured": min(p["measured"] for p in pairs),
        "actions": [{"words": outlook.actions[k].words, "least": float(least[k])} for k in order],
    }


def what_decides(config: dict[str, Any]) -> None:
    """One run at the low tension; the four tensions of the paper."""
    slack, all_four = (separations(campaign_of(t, config), config) for t in ([config["slack"]], config["tensions"]))
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
        "explanations": [e.words for e in explanations(config)],
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
