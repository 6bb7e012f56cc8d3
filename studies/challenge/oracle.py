"""What is learnt once a truth is open: the least held-out error, and whether an advised run tells its pair apart.

The least error that anybody could have had on a campaign is that of a law which knows what is hidden.
The noise floor that an answer tells is what noise and settings make on average. Of the few long waves of wander in one
campaign chance may have drawn a tenth more or less, as much as the whole reducible part of a small effect's error; so
what was reducible is known only once the truth is open, on the very readings.
"""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from belt_sim.api.simulate import fitted_model
from belt_sim.campaign import Campaign, Run, SignalSheet, read_campaign, write_campaign
from belt_sim.diagnosis.errors import ErrorsWithoutNuisances, conditions
from belt_sim.diagnosis.noise import metric_of
from belt_sim.diagnosis.samples import samples_of
from belt_sim.diagnosis.workbench import workbench
from belt_sim.results.diagnosis import RESOLVED, RunSettings
from belt_sim.units import MM
from belt_sim.virtual_rig import Truth
from belt_sim.virtual_rig.hidden import CATALOGUE, Detectability, fault_from_spec
from belt_sim.virtual_rig.make import RESOLUTION
from belt_sim.virtual_rig.march import TrueErrors, add_noise, observe, true_line
from belt_sim.virtual_rig.plan import Noise, Plan, RunSetting
from studies.challenge.registry import answerer
from studies.challenge.score import error_of, score_case

_STEPS = 30  # of the search for the numbers with which wrong names imitate best
_DIFFERENCE = 1e-3  # typical sizes: residuals are rounded at 1e-8, which spoils quotients over scipy's own 1.5e-8
POINTS = ("point_1", "point_2", "point_3", "point_4")
LINE = "engine=line"  # campaigns of a 3D scene have no line that would predict them


def least_error(campaign: Campaign, truth: Truth, answer: Mapping[str, Any]) -> dict[str, float] | None:
    """rms [mm] of the lateral errors of that law, over the conditions that the answer's error is told over: as they
    are, and beside each run's own zero, gain and settings. None where nothing hidden or nothing told is to be had.
    """
    error = error_of(answer)
    if not error or not error.get("held_out") or not truth.effects or truth.dirty:
        return None
    if LINE not in campaign.source.reference:
        return None
    bench = workbench(campaign, fitted_model(truth.base), ())
    residual = bench.samples.y - samples_of(noise_free(campaign, truth), leave_out_bad=False).y
    levels = bench.finder(residual)
    metric = metric_of(bench.fitted, levels, bench.shapes, bench.shared)
    own = ErrorsWithoutNuisances(replace(bench, levels=levels, metric=metric))
    found, untold = conditions(bench), error.get("held_out_untestable", error.get("untestable", ()))
    told = [out for name, out in found.items() if name not in untold] or list(found.values())
    return {
        "plain_mm": _rms([residual[out][own.there[out]] for out in told]),
        "beside_settings_mm": _rms([own.remove_nuisances(residual[out], out)[own.there[out]] for out in told]),
    }


def _rms(parts: list[np.ndarray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) / MM


def noise_free(campaign: Campaign, truth: Truth) -> Campaign:
    """The campaign with such readings in place of its own; ``truth``: what stands behind it."""
    faults = [fault_from_spec({"id": e["id"], **e["parameters"]}) for e in truth.effects]
    alike: dict[tuple, list[int]] = {}
    for k, run in enumerate(campaign.runs):
        alike.setdefault((len(run.travel), float(run.travel[-1]), tuple(run.signals)), []).append(k)
    runs = list(campaign.runs)
    for which in alike.values():
        readings = _noise_free_readings(campaign, which, truth, faults)
        for k, signals in zip(which, readings, strict=True):
            runs[k] = replace(runs[k], signals=signals)
    return replace(campaign, runs=tuple(runs), sha256="")


def _noise_free_readings(campaign: Campaign, which: list[int], truth: Truth, faults) -> list[dict[str, np.ndarray]]:
    """Readings of the runs of these numbers, recorded alike: all in one march."""
    plan = _plan(campaign, which, truth)
    line = replace(
        true_line(plan, truth.base, TrueErrors()), run=np.array(which)
    )  # some faults are another in every run
    readings = observe(plan, line, faults)
    return [
        {name: values[:, k] for name, values in zip(plan.signals, readings, strict=True)} for k in range(len(which))
    ]


def setting_from(run: Run) -> RunSetting:
    """What a run of a campaign is set to."""
    return RunSetting(**{n: getattr(run, n) for n in ("tension", "yaw", "yaw_head", "speed", "direction", "yaw_at")})


def _plan(campaign: Campaign, which: list[int], truth: Truth) -> Plan:
    """The plan of the runs of these numbers, recorded alike, as it truly was."""
    runs = [campaign.runs[k] for k in which]
    reach, steps = float(runs[0].travel[-1]), len(runs[0].travel) - 1
    starts = truth.settings.get("start", [0.0] * len(campaign.runs))
    return Plan(
        runs=tuple(replace(setting_from(run), start=starts[k]) for k, run in zip(which, runs, strict=True)),
        length=reach,
        spacing=reach / steps,
        signals={s.name: s.at for s in campaign.signals if s.name in runs[0].signals},
        machine=campaign.machine,
        belt=campaign.belt,
        zero_at_start="zero_at_start" in truth.settings,
    )


def left_by_named(campaign: Campaign, truth: Truth, answer: Mapping[str, Any]) -> float | None:
    """d of what the named effects leave at best of what is hidden: both by the generator's laws, without noise.

    Under 3 nobody can tell them apart. The stated distance takes effects for linear, which large ones are not.
    What is hidden and named is set aside: of a belt's edge the answer has those waves only that show.
    None where no other effect of the generator's catalogue is named, or runs were recorded unlike.
    """
    right = {e["id"] for e in truth.effects} & {e["id"] for e in answer["effects"]}
    others = [e for e in answer["effects"] if e["id"] not in right]
    named = [e for e in others if e["id"] in CATALOGUE]
    if not named or len(named) < len(others) or len({len(run.travel) for run in campaign.runs}) > 1:
        return None
    plan = _plan(campaign, list(range(len(campaign.runs))), truth)
    unseen = [e for e in truth.effects if e["id"] not in right]
    hidden = tuple(fault_from_spec({"id": e["id"], **e["parameters"]}) for e in unseen)
    bench = Detectability(plan, _noise(campaign, truth), truth.base, hidden)
    classes = [CATALOGUE[e["id"]] for e in named]
    known = [{n: v for n, v in e["numbers"].items() if n in vars(c())} for e, c in zip(named, classes, strict=True)]
    free = [(k, name) for k, e in enumerate(named) for name in e["parameters"] if name in known[k]]
    unit = [classes[k].sizes[n].typical if n in classes[k].sizes else 1.0 for k, n in free]

    def residual(values: np.ndarray) -> np.ndarray:
        numbers = [dict(own) for own in known]
        for (k, name), value in zip(free, values * unit, strict=True):
            numbers[k][name] = float(value)
        faults = [cls(**own) for cls, own in zip(classes, numbers, strict=True)]
        return np.nan_to_num(bench.reduce(observe(plan, bench.base, faults) - bench.clean), nan=1e3)

    def slopes(values: np.ndarray) -> np.ndarray:
        steps = _DIFFERENCE * np.eye(len(values))
        return np.stack([(residual(values + h) - residual(values - h)) / (2.0 * _DIFFERENCE) for h in steps], axis=1)

    start = np.array([known[k][n] for k, n in free]) / unit
    best = least_squares(residual, start, jac=slopes, x_scale="jac", max_nfev=_STEPS)
    return float(np.sqrt(2 * best.cost))


def _noise(campaign: Campaign, truth: Truth) -> Noise:
    """What a campaign states of its noise, and how the true one differs."""
    sheets = {s.kind: s for s in campaign.signals}
    of = sheets.get("lateral") or next(iter(sheets.values()))
    stated = Noise(
        white=of.white,
        zero=of.zero,
        gain=of.gain,
        wander_sd=of.wander_sd,
        wander_length=of.wander_length,
        tension_rel=campaign.settings.tension_rel,
        yaw_u=campaign.settings.yaw_u,
        tilt_white=sheets["tilt"].white if "tilt" in sheets else Noise.tilt_white,
    )
    return replace(stated, **{n: truth.noise[n] for n in ("scale", "true_length", "smooth") if n in truth.noise})


# The advised run, made on the same line; all is diagnosed again.


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
