"""Does the advised run tell the pair apart? It is made on the same line, and all is diagnosed again."""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.campaign import Campaign, Run, SignalSheet, read_campaign, write_campaign
from belt_sim.results.diagnosis import RESOLVED, RunSettings
from belt_sim.virtual_rig import Truth
from belt_sim.virtual_rig.hidden import fault_from_spec
from belt_sim.virtual_rig.make import RESOLUTION
from belt_sim.virtual_rig.march import TrueErrors, add_noise, observe, true_line
from belt_sim.virtual_rig.plan import Noise, Plan
from studies.challenge.oracle import setting_from
from studies.challenge.registry import answerer
from studies.challenge.score import score_case

POINTS = ("point_1", "point_2", "point_3", "point_4")


def follow(
    folder: Path, truth: Truth, answer: Mapping[str, Any], *, ablation: str, bootstraps: int
) -> dict[str, Any] | None:
    """What the second diagnosis says; resolved: the pair is told apart, and what is hidden is named (up to other
    aliases that the answer declares).

    The first advice that promises to tell its pair apart, and that this rig can follow; None where there is none.
    """
    for advice in answer.get("next_runs", []):
        can = advice.get("settings") and not advice["settings"]["turned_over"]
        if can and advice["sigma_after"] >= RESOLVED > advice["sigma_before"]:
            break
    else:
        return None
    campaign = read_campaign(folder)
    run, signals = advised_run(campaign, RunSettings(**advice["settings"]))
    longer = add_follow_up_run(campaign, truth, run, signals, truth.seed)
    with tempfile.TemporaryDirectory(prefix="belt_challenge_") as scratch:
        place = Path(scratch) / "further"
        write_campaign(longer, place)
        again = answerer(ablation)(place, bootstraps, truth.seed, truth.base)
    scored = score_case({"seed": truth.seed, "source": "", "truth": asdict(truth), "seconds": {}, "answer": again})
    apart = sorted(advice["separates"]) not in [sorted((c["a"], c["b"])) for c in again["confusables"]]
    return advice | {"verdict": again["verdict"], "named": sorted(scored.named), "resolved": apart and scored.right}


def advised_run(campaign: Campaign, settings: RunSettings) -> tuple[Run, tuple[SignalSheet, ...]]:
    """The run that an advice asks for, on the campaign's own spacing, and the sensors that it needs."""
    like = next(run for run in campaign.runs if len(run.travel) > 1)
    spacing = float(np.median(np.diff(like.travel)))
    run = replace(
        like,
        tension=settings.tension,
        yaw=settings.yaw,
        speed=settings.speed,
        direction=settings.direction,
        travel=np.arange(0.0, settings.travel + 0.5 * spacing, spacing),
        time=None,
        signals={},
        repeat_of=None,
        use="fit",
    )
    if not settings.all_points:
        return run, campaign.signals
    have = {s.at for s in campaign.signals}
    sensor = next(s for s in campaign.signals if s.kind == "lateral")
    return run, (*campaign.signals, *(replace(sensor, name=f"y{at[-1]}", at=at) for at in POINTS if at not in have))


def add_follow_up_run(
    campaign: Campaign, truth: Truth, run: Run, signals: Sequence[SignalSheet], seed: int
) -> Campaign:
    """The campaign with one more run, whose setting errors and noise are drawn.

    run: its setting and travel [m], shape (n,), readings ignored; signals: its sensors, which may be more than the
    campaign has so far; truth: what stands behind the campaign.
    """
    rng = np.random.default_rng([seed, len(campaign.runs)])
    noise = Noise(**truth.noise)
    plan = Plan(
        runs=(setting_from(run),),
        length=float(run.travel[-1]),
        spacing=float(run.travel[1] - run.travel[0]),
        signals={s.name: s.at for s in signals},
        machine=campaign.machine,
        belt=campaign.belt,
    )
    errors = TrueErrors(
        machine=truth.machine,
        tension_rel=campaign.settings.tension_rel * rng.standard_normal(1),
        yaw=campaign.settings.yaw_u * rng.standard_normal(1),
    )
    faults = [fault_from_spec({"id": e["id"], **e["parameters"]}) for e in truth.effects]
    readings = observe(plan, true_line(plan, truth.base, errors), faults)
    noisy = np.round(add_noise(readings, plan.travel, signals, noise, rng) / RESOLUTION) * RESOLUTION
    shown = {sheet.name: values[:, 0] for sheet, values in zip(signals, noisy, strict=True)}
    fresh = replace(run, name=f"r{len(campaign.runs) + 1:02d}", travel=plan.travel, signals=shown)
    return replace(campaign, signals=tuple(signals), runs=(*campaign.runs, fresh), sha256="")
