"""Small campaigns, and answerers that are not the diagnosis: processes of a challenge import these by name."""

import os
import sys
import time
from pathlib import Path
from typing import Any

from belt_sim.campaign import read_campaign
from belt_sim.results.files import file_json
from belt_sim.units import DEGREE, N_PER_MM2
from belt_sim.virtual_rig import Plan, grid, make_campaign

sys.path.insert(0, str(Path(__file__).parents[2] / "diagnose"))
import small_campaign

PLAN = Plan(runs=grid((10 * N_PER_MM2, 30 * N_PER_MM2), (-0.042 * DEGREE, 0.042 * DEGREE)), length=20.0)
HIDDEN: tuple[tuple[str, ...], ...] = ((), ("cant",), ("taper",), ("cant", "taper"))
SLOW = 0.5  # [s]
PATIENCE = 6.0  # [s]: an answer takes a tenth of a second where campaigns are drawn already; a busy machine, more


def hidden(seed: int) -> tuple[str, ...]:
    return HIDDEN[seed % len(HIDDEN)]


def draw(seed: int):
    return make_campaign(hidden=[{"id": i, "d": 40.0} for i in hidden(seed)], seed=seed, base="strip", plan=PLAN)


def answer_of(*names: str, verdict: str | None = None, probability: float = 1.0) -> dict[str, Any]:
    """An answer that names effects."""
    effects = [{"id": n, "parameters": {}, "probability": probability, "confusable_with": []} for n in names]
    return {"verdict": verdict or ("explained" if names else "adequate"), "sentence": "", "effects": effects}


def oracle(folder: Path, bootstraps: int, seed: int, base: str) -> dict[str, Any]:
    """Always right; refuses a folder that holds a truth."""
    assert sorted(p.name for p in folder.iterdir()) == ["campaign.yaml", "runs.csv", "signals.csv"]
    assert base == "strip"
    return answer_of(*hidden(seed))


def draw_kept(seed: int):
    """The campaign that other tests diagnose as well."""
    return make_campaign(hidden=small_campaign.HIDDEN["sag_roll"], seed=1, plan=small_campaign.SPREAD, title="sag_roll")


def kept(folder: Path, bootstraps: int, seed: int, base: str) -> dict[str, Any]:
    """What the diagnosis says of it."""
    assert read_campaign(folder).runs[0].name == small_campaign.campaign("sag_roll").runs[0].name
    return file_json(small_campaign.diagnosed("sag_roll"))


def slow_oracle(folder: Path, bootstraps: int, seed: int, base: str) -> dict[str, Any]:
    time.sleep(SLOW)
    return oracle(folder, bootstraps, seed, base)


def wrong(folder: Path, bootstraps: int, seed: int, base: str) -> dict[str, Any]:
    """Says crown, whatever it is."""
    return answer_of("crown")


def troubled(folder: Path, bootstraps: int, seed: int, base: str) -> dict[str, Any]:
    """Raises, dies, never comes back, or answers."""
    if seed == 0:
        raise ValueError("no such thing")
    if seed == 1:
        os._exit(7)
    if seed == 2:
        time.sleep(600.0)
    return oracle(folder, bootstraps, seed, base)
