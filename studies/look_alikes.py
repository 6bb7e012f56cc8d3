"""Which effects look alike by nature: python -m studies.look_alikes tensions=[10] prints a Markdown table.

The cosine of two effects is the largest between their whitened columns at null, noise and nuisances taken into account
as a diagnosis does: at 1 the readings cannot tell them apart, whatever their size.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from belt_sim.api.simulate import candidates_of
from belt_sim.diagnosis.workbench import Workbench, workbench
from belt_sim.model import analytic_model
from belt_sim.units import N_PER_MM2
from belt_sim.virtual_rig.make import make_campaign
from studies.application import application

FAINT = 0.1  # standard deviations that a parameter's scale must move the readings by


def look_alikes(config: dict[str, Any]) -> None:
    """Print every pair above ``above``."""
    campaign = make_campaign(seed=int(config["seed"]), base=config["base"])[0]
    if config["tensions"] is not None:
        wanted = np.array(config["tensions"]) * N_PER_MM2
        kept = [r for r in campaign.runs if np.isclose(r.tension, wanted, rtol=1e-3).any()]
        names = {r.name for r in kept}
        runs = tuple(replace(r, repeat_of=r.repeat_of if r.repeat_of in names else None) for r in kept)
        campaign = replace(campaign, runs=runs)
    model = analytic_model(config["base"])
    bench = workbench(campaign, model, tuple(candidates_of(None, model)))
    bases = effect_bases(bench)
    print(f"{len(campaign.runs)} runs, {len(campaign.signals)} signals\n\n| effect | beside | cosine |\n|---|---|---|")
    ids = sorted(bases)
    pairs = [(cosine(bases[a], bases[b]), a, b) for k, a in enumerate(ids) for b in ids[k + 1 :]]
    for size, a, b in sorted(pairs, reverse=True):
        if size > float(config["above"]):
            print(f"| {a} | {b} | {size:.4f} |")
    print("\nnot seen:", ", ".join(c.id for c in bench.forward.classes if c.id not in bases) or "none")


def effect_bases(bench: Workbench) -> dict[str, np.ndarray]:
    """Orthonormal columns (N, k) of every effect that these readings can see."""
    null, found = bench.forward.null(), {}
    for name in (c.id for c in bench.forward.classes):
        rows = bench.metric.whiten(bench.forward.expand(null, bench.forward.index(name))[1])
        seen = rows[np.linalg.norm(rows, axis=1) > FAINT]
        if len(seen):
            found[name] = np.linalg.qr(seen.T)[0]
    return found


def cosine(a: np.ndarray, b: np.ndarray) -> float:
    """Of the smallest angle between two spans."""
    return float(np.linalg.norm(a.T @ b, ord=2))


if __name__ == "__main__":
    application("look_alikes", look_alikes)
