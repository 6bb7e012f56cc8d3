"""How often is the diagnosis right? Campaigns of the virtual rig, diagnosed blind, then revealed.

    python -m studies.score count=40 first_seed=1000

takes the three sample campaigns and as many random ones. The generator and the diagnosis do not know each other;
this module only carries the folder from one to the other. Every campaign counts; a crash is wrong.
"""

import math
import tempfile
import time
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from belt_sim.analytic.model import analytic_model
from belt_sim.campaign import read_campaign
from belt_sim.diagnosis.describe import describe
from belt_sim.diagnosis.examine import examine
from belt_sim.files import write_json
from belt_sim.paths import CAMPAIGNS
from belt_sim.results.written import diagnosis_json
from belt_sim.use_cases.asked import candidates_of
from belt_sim.virtual_rig.folder import run_reveal, run_virtual_rig
from studies.application import application

#: sample campaigns and the model that each is to be diagnosed with
SAMPLES = {"slack_belt": "beam_th2", "machine_fault": "strip", "nothing_hidden": "strip"}
Z95 = 1.959964
OUTCOMES = ("right", "confusable", "wrong", "crash")


def score_one(seed: int, bootstraps: int) -> dict[str, Any]:
    """One random campaign: made, diagnosed from its folder, then revealed and judged."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "campaign"
        run_virtual_rig(folder, hidden="random", seed=seed)
        return score_folder(folder, "strip", str(seed), bootstraps, seed)


def score_folder(folder: Path, base: str, name: str, bootstraps: int, seed: int = 0) -> dict[str, Any]:
    """One campaign on disk, diagnosed with model ``base``; its truth is opened only afterwards."""
    started = time.perf_counter()
    answer: dict[str, Any] = {"verdict": "crash", "effects": []}
    try:
        model = analytic_model(base)
        classes = candidates_of(None, model)
        d = examine(read_campaign(folder), model, classes, bootstraps=bootstraps, seed=seed, advise=False)
        answer = diagnosis_json(describe(d, seed=seed))
    except Exception as error:  # a crash is an outcome here, and is shown
        answer["sentence"] = f"{type(error).__name__}: {error}"
    truth = run_reveal(folder)
    found = {e["id"]: e for e in answer["effects"]}
    return {
        "campaign": name,
        "seed": seed,
        "kind": truth.kind,
        "hidden": [e["id"] for e in truth.effects],
        "d": [e.get("d") for e in truth.effects],
        "lookalikes": truth.lookalikes,
        "distance": truth.distance,
        "dirty": truth.dirty,
        "verdict": answer["verdict"],
        "found": list(found),
        "confusable": sorted({c for e in found.values() for c in e["confusable_with"]}),
        "sentence": answer.get("sentence", ""),
        "suspicions": [s["kind"] for s in answer.get("suspicions", [])],
        "outcome": judge(truth, answer),
        "seconds": time.perf_counter() - started,
        "error": answer.get("error"),
    }


def judge(truth: Any, answer: dict[str, Any]) -> str:
    """right | confusable | wrong | crash, by the kind of truth.

    Nothing hidden or below the noise: adequate is right (naming the truth is too). A library effect: named first is
    right; in the confusable set, or a look-alike that the generator itself cannot tell from it, is confusable. Two:
    the exact set. Outside the library: right when something unknown is reported. Dirty: right when caught.
    """
    verdict, found = answer["verdict"], {e["id"] for e in answer["effects"]}
    hidden = {e["id"] for e in truth.effects}
    alike = {c for e in answer["effects"] for c in e["confusable_with"]}
    if verdict == "crash":
        return "crash"
    if truth.kind == "nothing" or (not hidden and truth.kind == "stated"):
        return "right" if verdict == "adequate" else "wrong"
    if truth.kind == "dirty":
        return "right" if verdict == "cannot_say" or answer["suspicions"] else "wrong"
    if truth.kind == "below_noise":
        return "right" if verdict == "adequate" or found == hidden else "wrong"
    if truth.kind == "outside":
        return "right" if verdict in ("none_known", "partly") else "wrong"
    if found == hidden and verdict in ("explained", "partly"):
        return "right"
    if hidden <= found | alike or (found and found <= set(truth.lookalikes) | hidden):
        return "confusable"
    return "wrong"


def table(rows: list[dict[str, Any]]) -> Table:
    """Outcomes by kind of truth, with 95 % Wilson intervals of the share that is right."""
    shown = Table(title="random campaigns of the virtual rig", title_justify="left")
    for name in ("hidden", "campaigns", *OUTCOMES, "right, 95 % interval"):
        shown.add_column(name, justify="left" if name == "hidden" else "right")
    for kind in (*sorted({r["kind"] for r in rows}), "all"):
        mine = [r for r in rows if kind in (r["kind"], "all")]
        counts = {o: sum(r["outcome"] == o for r in mine) for o in OUTCOMES}
        low, high = wilson(counts["right"], len(mine))
        cells = [str(counts[o]) for o in OUTCOMES]
        shown.add_row(kind, str(len(mine)), *cells, f"{low:.0%} - {high:.0%}")
    return shown


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """95 % interval of a share from counts (Wilson 1927); (0, 1) without trials."""
    if trials == 0:
        return 0.0, 1.0
    share, z2 = successes / trials, Z95**2
    centre = (share + z2 / (2 * trials)) / (1 + z2 / trials)
    half = Z95 / (1 + z2 / trials) * math.sqrt(share * (1 - share) / trials + z2 / (4 * trials**2))
    return max(0.0, centre - half), min(1.0, centre + half)


def score(config: dict[str, Any]) -> None:
    """Score the campaigns; print every line and the table."""
    out, rows = Console(highlight=False), []
    out.width = max(out.width, 120)
    first, count = int(config["first_seed"]), int(config["bootstraps"])
    for name in (*(SAMPLES if config["samples"] else ()), *range(first, first + int(config["count"]))):
        if isinstance(name, str):
            row = score_folder(CAMPAIGNS / name, SAMPLES[name], name, count)
        else:
            row = score_one(name, count)
        rows.append(row)
        hidden = ", ".join(f"{i} (d={d:.0f})" if d else i for i, d in zip(row["hidden"], row["d"], strict=True))
        answer = f"{row['verdict']} {', '.join(row['found'])}"
        alike = f" ~ {', '.join(row['confusable'])}" if row["confusable"] else ""
        asked = f"{name} {row['outcome']:10s} {row['kind']:11s} {hidden or '-'}"
        out.print(f"{asked} -> {answer}{alike} ({row['seconds']:.0f} s)", soft_wrap=True)
        write_json(Path(config["out"]) / f"score_{first}.json", {"schema": "belt-score/1", "campaigns": rows})
    out.print(table(rows))


if __name__ == "__main__":
    application("score", score)
