"""A campaign of the virtual rig and the truth behind it."""

import secrets
from collections.abc import Sequence
from functools import cache
from typing import Any, Literal

import numpy as np

from belt_sim.campaign import Campaign, Run, Source
from belt_sim.errors import InputError, whole
from belt_sim.virtual_rig.effect_size import detectability_of
from belt_sim.virtual_rig.fault import Fault, UnmodelledFault
from belt_sim.virtual_rig.hidden_faults import CORRUPTIONS, HiddenFaults, random_hidden, random_noise, specified_hidden
from belt_sim.virtual_rig.observe import TrueErrors, add_noise, draw_errors, observe, true_line
from belt_sim.virtual_rig.plan import Noise, Plan
from belt_sim.virtual_rig.sealed_truth import Truth

BASES = BASE, RANDOM_BASE = "beam_th2", "strip"
#: Readings are written to this resolution [m or rad], far below their noise.
RESOLUTION = 1e-7
_SALT_BYTES = 16


def make_campaign(
    *,
    hidden: Sequence[str | dict] | Literal["random"] = (),
    seed: int | None = None,
    base: str | None = None,
    plan: Plan | None = None,
    noise: Noise | None = None,
    title: str = "Virtual rig",
) -> tuple[Campaign, Truth]:
    """Measure the plan on a line with hidden effects; the same seed gives the same campaign.

    hidden: ids, dictionaries {"id", parameters in SI} or {"id", "d"}, or "random"; base: the law without any
    effect, ``BASE`` unless stated (``RANDOM_BASE`` for "random"). Without a seed one is drawn and kept in the truth.
    """
    at_random = isinstance(hidden, str)
    if at_random and hidden != "random":
        raise InputError("hidden", hidden, "", "give a list of effects, or random")
    base = check_base(base or (RANDOM_BASE if at_random else BASE))
    plan, stated = plan or Plan(), noise or Noise()
    seed = secrets.randbits(63) if seed is None else check_seed(seed)
    streams = random_streams(seed)
    noise = random_noise(stated, streams[1]) if at_random else stated
    get_detectability = cache(lambda: detectability_of(plan, noise, base))
    if at_random:
        what = random_hidden(plan, get_detectability, base, streams[0])
    else:
        what = specified_hidden(hidden, get_detectability)
    return measure_campaign(plan, noise, base, what, seed, streams, title)


def random_streams(seed: int) -> list[np.random.Generator]:
    """Chance for what is hidden, the noise's nature, the errors, the readings, the salt."""
    return [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(5)]


def measure_campaign(
    plan: Plan, noise: Noise, base: str, what: HiddenFaults, seed: int, streams, title: str, name: str = ""
):
    """Measure a plan, which may have a name, with what is hidden: the campaign and its truth."""
    check_base(base, what.faults)
    errors = draw_errors(plan, noise, streams[2])
    readings, dirt = _readings(plan, noise, base, errors, what, streams[3])
    campaign = build_campaign(plan, noise, readings, title, "belt-sim virtual-rig engine=line")
    salt = streams[4].bytes(_SALT_BYTES).hex()
    unstated = {"start": [run.start for run in plan.runs]} if any(run.start for run in plan.runs) else {}
    unstated |= {"zero_at_start": [1.0]} if plan.zero_at_start else {}
    return campaign, describe_truth(seed, base, what, noise, errors, dirt, salt, name, unstated)


def _readings(plan: Plan, noise: Noise, base: str, errors: TrueErrors, what: HiddenFaults, rng):
    """Noisy readings, shape (signals, n, runs), and what was done to them if they are dirty."""
    readings = observe(plan, true_line(plan, base, errors), what.faults)
    for k, (name, place) in enumerate(plan.signals.items()):
        readings[k] = add_noise(readings[k], plan.travel, noise.sheet(name, place), noise, rng)
    if what.dirty is None:
        return readings, None
    able = [k for k, place in enumerate(plan.signals.values()) if place.startswith("point_")]
    turned = [k for k, run in enumerate(plan.runs) if run.yaw != 0.0] or list(range(len(plan.runs)))
    signal, run = int(rng.choice(able)), int(rng.choice(turned))
    CORRUPTIONS[what.dirty](readings, signal, run)
    return readings, {"kind": what.dirty, "signal": list(plan.signals)[signal], "run": _name(run)}


def build_campaign(plan: Plan, noise: Noise, readings: np.ndarray, title: str, reference: str) -> Campaign:
    """Readings, shape (signals, n, runs), as a campaign whose file states ``noise``."""
    sheets = tuple(noise.sheet(name, place) for name, place in plan.signals.items())
    runs = []
    for k, setting in enumerate(plan.runs):
        repeat = None if setting.repeat_of is None else _name(setting.repeat_of)
        rounded = np.round(readings[:, :, k] / RESOLUTION) * RESOLUTION
        signals = {sheet.name: row for sheet, row in zip(sheets, rounded, strict=True)}
        stated = {n: v for n, v in vars(setting).items() if n not in ("repeat_of", "start")}
        runs.append(Run(name=_name(k), repeat_of=repeat, travel=plan.travel, signals=signals, **stated))
    return Campaign(
        title=title,
        source=Source(kind="synthetic", reference=reference, licence="Apache-2.0"),
        machine=plan.machine,
        belt=plan.belt,
        signals=sheets,
        settings=noise.settings,
        runs=tuple(runs),
    )


def describe_truth(
    seed, base, what: HiddenFaults, noise: Noise, errors: TrueErrors, dirt, salt: str, plan: str = "", unstated=()
) -> Truth:
    """What is sealed beside a campaign; unstated: further settings that its file does not state."""
    told = ("scale", "heavy_tails") + (() if noise.true_length is None else ("true_length", "smooth"))
    unknown = next((f for f in what.faults if isinstance(f, UnmodelledFault)), UnmodelledFault())
    effects = [
        {
            "id": fault.id,
            "parameters": {n: _round_digits(v, 9) for n, v in fault.parameters().items()},
            "d": _round_digits(size, 6),
        }
        for fault, size in zip(what.faults, what.sizes, strict=True)
    ]
    return Truth(
        seed=seed,
        base=base,
        kind=what.kind,
        effects=effects,
        lookalikes=what.lookalikes,
        distance=_round_digits(what.distance, 6),
        noise={n: getattr(noise, n) for n in told},
        machine=dict(errors.machine),
        settings={n: np.asarray(getattr(errors, n)).tolist() for n in ("tension_rel", "yaw")} | dict(unstated),
        dirty=dirt,
        salt=salt,
        plan=plan,
        **{n: getattr(unknown, n) for n in ("place", "variable", "form")},
        also=[list(pair) for pair in unknown.also],
    )


def _round_digits(value: Any, digits: int) -> Any:
    """A number to so many significant digits: what processors of different kinds agree upon; all else as it is."""
    return float(f"{value:.{digits}g}") if isinstance(value, float) else value


def _name(run: int) -> str:
    return f"r{run + 1:02d}"


def check_base(base: str, faults: Sequence[Fault] = ()) -> str:
    """A base law as given; raises InputError for one that is not known, or that contains a fault already."""
    if base not in BASES:
        raise InputError("base", base, "", f"use one of {', '.join(BASES)}")
    for fault in faults:
        others = " or ".join(b for b in BASES if b not in (*fault.idle_on, *fault.part_of))
        if base in fault.idle_on:
            raise InputError("hidden", fault.id, "", f"does not act on base {base}; use base {others}")
        if base in fault.part_of:
            raise InputError("hidden", fault.id, "", f"is part of base {base} already; use base {others}")
    return base


def check_seed(seed: object) -> int:
    """A seed as given; raises InputError unless it is a whole number from 0."""
    return whole("seed", seed, 0, 2**63 - 1)
