"""A campaign of the virtual rig, as asked for or drawn, and the truth behind it, sealed: its hash is known before
anybody answers, and read only afterwards."""

import base64
import binascii
import hashlib
import json
import math
import secrets
import zlib
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

from belt_sim.campaign import Campaign, Machine, Quantity, Run, SettingsSheet, Source, write_campaign
from belt_sim.errors import InputError, whole
from belt_sim.io import write_text
from belt_sim.units import MM, N_PER_MM2, round_digits
from belt_sim.virtual_rig.faults import Fault
from belt_sim.virtual_rig.hidden import (
    BLIND_FAULTS,
    DEVELOPMENT_FAULTS,
    MIX,
    OUTSIDE,
    REACHED,
    Detectability,
    HiddenFaults,
    damage,
    random_hidden,
    specified_hidden,
)
from belt_sim.virtual_rig.march import TrueErrors, add_noise, draw_errors, observe, true_line
from belt_sim.virtual_rig.plan import TEST_BELT, TEST_RIG, Noise, Plan, RunSetting

#: Fields that a truth sealed before does not have; left out where they say nothing.
_SINCE = ("plan", "place", "variable", "form", "also")
SEALED_FILE, HASH = "truth.sealed", "truth.sha256"


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What was hidden. All values in SI.

    base: the law that the campaign is meant to be diagnosed with (beam_th2 or strip); kind: stated, nothing, library,
    two, outside, below_noise or dirty; effects: [{"id", "parameters", "d"}], d the size in noise units (None when not
    measured); lookalikes: other single effects of the library that reproduce the same change up to 3 noise units (and
    half its size); distance: what the best single effect leaves over, or the best three when something outside the
    library is hidden; noise: true scale and tails, and length and smoothness of a wander that is not as stated;
    machine, settings: true minus stated; dirty: what was done to the data; plan: its kind and number; place, variable,
    form, also: what the unknown is (``Fault``).
    """

    seed: int
    base: str
    kind: str
    effects: list[dict] = field(default_factory=list)
    lookalikes: list[str] = field(default_factory=list)
    distance: float | None = None
    noise: dict = field(default_factory=dict)
    machine: dict[str, float] = field(default_factory=dict)
    settings: dict[str, list[float]] = field(default_factory=dict)
    dirty: dict | None = None
    salt: str = ""
    plan: str = ""
    place: str = ""
    variable: str = ""
    form: str = ""
    also: list[list[str]] = field(default_factory=list)

    def text(self) -> str:
        """Canonical JSON, salt included."""
        said = {n: v for n, v in asdict(self).items() if v or n not in _SINCE}
        return json.dumps(said, sort_keys=True, allow_nan=False)

    def sha256(self) -> str:
        """SHA-256 of the canonical JSON."""
        return hashlib.sha256(self.text().encode()).hexdigest()


def reveal(folder: str | Path) -> Truth:
    """Open a sealed truth; raises InputError when a file is missing or the truth is not the published one."""
    folder, texts = Path(folder), []
    for name in (HASH, SEALED_FILE):
        try:
            texts.append((folder / name).read_text(encoding="ascii"))
        except FileNotFoundError:
            raise InputError("campaign", folder, "", f"has no {name}: nothing to reveal") from None
        except (OSError, UnicodeDecodeError):
            raise InputError("campaign", folder / name, "", "cannot be read; make the campaign anew") from None
    published, packed = texts
    try:
        truth = Truth(**json.loads(zlib.decompress(base64.b64decode(packed))))
        found = truth.sha256()
    except (binascii.Error, zlib.error, ValueError, TypeError, RecursionError):
        raise InputError(SEALED_FILE, folder, "", "is damaged; make the campaign anew") from None
    if published.split()[:1] != [found]:
        remedy = "the truth was changed after it was sealed (or the published hash was); do not trust it"
        raise InputError("SHA-256 of the truth", found, "", f"does not match {HASH}: {remedy}")
    return truth


def seal(truth: Truth, folder: Path) -> str:
    """Write truth.sealed and truth.sha256 into a campaign folder; returns the hash. Hidden, not encrypted."""
    packed = base64.b64encode(zlib.compress(truth.text().encode(), 9)).decode()
    wrapped = "\n".join(packed[k : k + 76] for k in range(0, len(packed), 76))
    write_text(folder / SEALED_FILE, wrapped + "\n")
    write_text(folder / HASH, f"{truth.sha256()}  {SEALED_FILE}\n")
    return truth.sha256()


def write_blind(out: str | Path, campaign: Campaign, truth: Truth, *, overwrite: bool = False) -> str:
    """Write a campaign with its sealed truth into ``out``; returns the SHA-256 to publish."""
    write_campaign(campaign, out, overwrite=overwrite)
    return seal(truth, Path(out))


BASES = BASE, RANDOM_BASE = "beam_th2", "strip"
#: Readings are written to this resolution [m or rad], far below their noise.
RESOLUTION = 1e-7
_NOISE_OFF, _HEAVY = 0.4, 0.10  # share of what is stated; how often its tails are heavy


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
    noise, lot = stated, streams[1]
    if at_random:  # up to 40 % off what is stated; one time in ten with heavy tails
        scale = float(lot.uniform(1 - _NOISE_OFF, 1 + _NOISE_OFF))
        noise = replace(stated, scale=scale, heavy_tails=bool(lot.random() < _HEAVY))
    rule = cache(lambda: Detectability(plan, noise, base))
    what = random_hidden(plan, rule, base, streams[0]) if at_random else specified_hidden(hidden, rule)
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
    readings, dirt, rng = observe(plan, true_line(plan, base, errors), what.faults), None, streams[3]
    readings = add_noise(readings, plan.travel, noise.sheets(plan), noise, rng)
    if what.dirty is not None:
        able = [k for k, place in enumerate(plan.signals.values()) if place.startswith("point_")]
        turned = [k for k, run in enumerate(plan.runs) if run.yaw != 0.0] or list(range(len(plan.runs)))
        which, run = int(rng.choice(able)), int(rng.choice(turned))
        damage(readings, what.dirty, which, run)
        dirt = {"kind": what.dirty, "signal": list(plan.signals)[which], "run": f"r{run + 1:02d}"}
    campaign = build_campaign(plan, noise, readings, title, "belt-sim virtual-rig engine=line")
    unstated = {"start": [r.start for r in plan.runs]} if any(r.start for r in plan.runs) else {}
    unstated |= {"zero_at_start": [1.0]} if plan.zero_at_start else {}
    return campaign, describe_truth(seed, base, what, noise, errors, dirt, streams[4], name, unstated)


def build_campaign(plan: Plan, noise: Noise, readings: np.ndarray, title: str, reference: str) -> Campaign:
    """Readings, shape (signals, n, runs), as a campaign whose file states ``noise``."""
    sheets = noise.sheets(plan)
    runs = []
    for k, setting in enumerate(plan.runs):
        repeat = None if setting.repeat_of is None else f"r{setting.repeat_of + 1:02d}"
        rounded = np.round(readings[:, :, k] / RESOLUTION) * RESOLUTION
        signals = {sheet.name: row for sheet, row in zip(sheets, rounded, strict=True)}
        stated = {n: v for n, v in vars(setting).items() if n not in ("repeat_of", "start")}
        runs.append(Run(name=f"r{k + 1:02d}", repeat_of=repeat, travel=plan.travel, signals=signals, **stated))
    return Campaign(
        title=title,
        source=Source(kind="synthetic", reference=reference, licence="Apache-2.0"),
        machine=plan.machine,
        belt=plan.belt,
        signals=sheets,
        settings=SettingsSheet(tension_rel=noise.tension_rel, yaw_u=noise.yaw_u),
        runs=tuple(runs),
    )


def describe_truth(
    seed, base, what: HiddenFaults, noise: Noise, errors: TrueErrors, dirt, rng, plan: str = "", unstated=()
) -> Truth:
    """What is sealed beside a campaign; rng: draws the salt; unstated: further settings that its file does not state.

    Numbers have as many digits as processors of different kinds agree upon.
    """
    told = ("scale", "heavy_tails") + (() if noise.true_length is None else ("true_length", "smooth"))
    unknown = next((f for f in what.faults if f.place), Fault())
    effects = [
        {
            "id": fault.id,
            "parameters": {n: round_digits(v, 9) if isinstance(v, float) else v for n, v in vars(fault).items()},
            "d": None if size is None else round_digits(size, 6),
        }
        for fault, size in zip(what.faults, what.sizes, strict=True)
    ]
    return Truth(
        seed=seed,
        base=base,
        kind=what.kind,
        effects=effects,
        lookalikes=what.lookalikes,
        distance=None if what.distance is None else round_digits(what.distance, 6),
        noise={n: getattr(noise, n) for n in told},
        machine=dict(errors.machine),
        settings={n: np.asarray(getattr(errors, n)).tolist() for n in ("tension_rel", "yaw")} | dict(unstated),
        dirty=dirt,
        salt=rng.bytes(16).hex(),
        plan=plan,
        **{n: getattr(unknown, n) for n in ("place", "variable", "form")},
        also=[list(pair) for pair in unknown.also],
    )


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


# Random campaigns: a plan of some machine, a noise, and something hidden or nothing; a seed makes them again.


#: How often each kind of machine is drawn.
MACHINE_SHARES = {"test_rig": 0.4, "short_rig": 0.2, "between": 0.2, "wide_belt": 0.2}
#: Machines of the plans for fresh judging, which this draw does not know.
FRESH_KINDS = ("stiff_short", "wide_thick")
#: How many plans there are in all: plan number n is always the same, so that shapes of data come again.
POOL = 48
#: kind of machine -> tensions [N/mm2], lengths of a record [m], and centre distance, width, thickness, radius [m]
_RIGS: dict[str, tuple[tuple[int, ...], tuple[float, ...], Callable[[np.random.Generator], tuple[float, ...]]]] = {
    "test_rig": ((7, 10, 15, 20, 30, 40), (30.0, 60.0, 60.0, 100.0), lambda rng: ()),
    "short_rig": (
        (10, 15, 20, 40, 60),
        (10.0, 20.0, 40.0),
        lambda rng: (2.0, rng.choice((0.1, 0.2)), 3e-4, 0.17),
    ),
    "between": (
        (10, 15, 20, 30, 40),
        (20.0, 40.0, 60.0),
        lambda rng: (round(rng.uniform(3.0, 9.0), 2), rng.choice((0.15, 0.2, 0.3)), 4e-4, 0.2),
    ),
    "wide_belt": (
        (10, 15, 20, 30, 50),
        (40.0, 60.0, 100.0),
        lambda rng: (round(rng.uniform(8.0, 14.0), 2), 1.5, rng.choice((8e-4, 1e-3)), 0.5),
    ),
    "stiff_short": (
        (8, 11, 15, 20, 30, 45, 60),
        (20.0, 30.0, 60.0),
        lambda rng: (round(rng.uniform(3.0, 6.4), 2), 0.4, 8e-4, 0.25),
    ),
    "wide_thick": (
        (8, 12, 20, 30, 50),
        (40.0, 60.0, 100.0),
        lambda rng: (
            round(rng.uniform(6.0, 12.0), 2), rng.choice((1.0, 1.5, 2.0)), rng.choice((1.2e-3, 1.6e-3, 2e-3)), 0.75
        ),
    ),
}  # fmt: skip
_READINGS = (120, 240, 400)  # a run
_SLACK = (0.35, 0.8)  # share of the yaw at which an edge of the slackest belt goes slack
_SPEEDS = (0.25, 0.5, 0.5, 0.5, 1.0, 2.0)  # [m/s]
_LEAST, _MOST = 4, 20  # runs
_SIGNALS = (
    ("point_1",),
    ("point_4",),
    ("point_1", "point_4"),
    ("point_1", "point_4"),
    ("point_1", "point_3"),
    ("point_2", "point_3"),
    ("point_1", "point_2", "point_4"),
    ("point_1", "point_2", "point_3", "point_4"),
    ("point_1", "point_4", "upper_mid_span"),
)
#: Ranges of what the file states of the noise [SI].
_WHITE, _ZERO, _WANDER = (0.01 * MM, 0.03 * MM), (0.03 * MM, 0.2 * MM), (0.02 * MM, 0.08 * MM)
_WITH_REPEATS, _WITHOUT = (0.3, 3.0), (0.6, 1.4)  # true noise over what is stated
_TRUE_LENGTH = (1.0, 10.0)  # [m], where 3 m are stated
_SMOOTH = 0.10  # how often


def plan_by_number(number: int) -> tuple[str, Plan, Noise]:
    """Kind, plan and stated noise of one of the ``POOL`` plans; their kinds come as often as ``MACHINE_SHARES`` say."""
    if not 0 <= number < POOL:
        raise InputError("plan", number, "", f"give a number from 0 to {POOL - 1}")
    shares = np.cumsum(list(MACHINE_SHARES.values()))
    kind = list(MACHINE_SHARES)[int(np.searchsorted(shares, ((number * 29) % POOL + 0.5) / POOL))]
    return kind, *random_plan(kind, np.random.default_rng([2026, number]))


def true_noise(plan: Plan, stated: Noise, rng: np.random.Generator) -> Noise:
    """The noise as it truly is: its level far off only where repeats tell, its wander of another length."""
    repeats = any(run.repeat_of is not None for run in plan.runs)
    low, high = np.log(_WITH_REPEATS if repeats else _WITHOUT)
    return replace(
        stated,
        scale=float(np.exp(rng.uniform(low, high))),
        heavy_tails=bool(rng.random() < _HEAVY),
        true_length=float(np.exp(rng.uniform(*np.log(_TRUE_LENGTH)))),
        smooth=bool(rng.random() < _SMOOTH),
    )


def random_plan(kind: str, rng: np.random.Generator) -> tuple[Plan, Noise]:
    """A plan and stated noise for a machine of one kind.

    Runs: tensions times yaws; then, by chance, zero yaw, reversed travel, a second speed, repeats; 4 to 20 in all.
    """
    machine, belt, numbers = TEST_RIG, TEST_BELT, _RIGS[kind][2](rng)
    if numbers:
        distance, width, thickness, radius = map(float, numbers)
        both = Quantity(value=radius, u=3e-3 * radius)
        centre = Quantity(value=distance, u=max(5e-4 * distance, 1e-3))
        machine = Machine(centre_distance=centre, head_radius=both, tail_radius=both)
        wide, thick = Quantity(value=width, u=5e-4 * width), Quantity(value=thickness, u=0.01 * thickness)
        belt = replace(TEST_BELT, width=wide, thickness=thick)
    length = float(rng.choice(_RIGS[kind][1]))
    signals = _SIGNALS[int(rng.integers(len(_SIGNALS)))]

    # the runs
    count = int(rng.choice((1, 2, 3, 4), p=(0.15, 0.25, 0.3, 0.3)))
    tensions = sorted(float(t) * N_PER_MM2 for t in rng.choice(_RIGS[kind][0], count, replace=False))
    slack = tensions[0] * machine.centre_distance.value / (2 * belt.youngs_modulus.value * belt.width.value)
    largest = float(min(rng.uniform(*_SLACK) * slack, 2e-3))
    yaws = {
        "both": (-largest, largest),
        "one": (largest, 0.5 * largest) if count < 3 else (largest,),
        "many": (-largest, -0.5 * largest, 0.5 * largest, largest),
    }[str(rng.choice(("both", "one", "many"), p=(0.6, 0.2, 0.2)))]
    speed = float(rng.choice(_SPEEDS))
    late = float(round(rng.uniform(1.0, 4.0), 1)) if rng.random() < 0.2 else 0.0
    first = [RunSetting(tension=t, yaw=y, speed=speed, yaw_at=late) for t in tensions for y in yaws]
    extra = [replace(first[0], yaw=0.0, tension=t) for t in tensions] if rng.random() < 0.3 else []
    extra += [replace(first[k], direction=-1.0) for k in (0, -1)] if rng.random() < 0.25 else []
    extra += [replace(first[k], speed=2 * speed) for k in (0, -1)] if rng.random() < 0.25 else []
    runs = (first + extra)[:_MOST]
    # some runs once more, or none; as many as it takes to have four
    wanted = int(rng.choice((0, 1, 2, 4), p=(0.35, 0.15, 0.3, 0.2)))
    wanted = max(min(wanted, _MOST - len(runs)), _LEAST - len(runs), 0)
    picked = [int(k) % len(runs) for k in rng.permutation(max(len(runs), wanted))[:wanted]]
    runs += [replace(runs[k], repeat_of=k) for k in picked]

    plan = Plan(
        runs=tuple(runs),
        length=length,
        spacing=max(length / float(rng.choice(_READINGS)), 0.1),
        signals={f"y{place[-1]}" if place.startswith("point_") else "phi_upper": place for place in signals},
        machine=machine,
        belt=belt,
    )

    # the noise, to two digits, drawn evenly over its logarithm
    shares = (rng.uniform(math.log(low), math.log(high)) for low, high in (_WHITE, _ZERO, _WANDER))
    white, zero, wander = [round_digits(math.exp(drawn), 2) for drawn in shares]
    noise = Noise(
        white=white,
        zero=zero,
        wander_sd=wander,
        gain=0.005 if rng.random() < 0.3 else 0.0,
        tension_rel=round_digits(math.exp(rng.uniform(math.log(0.005), math.log(0.02))), 2),
        yaw_u=float(f"{0.005 * max(abs(run.yaw) for run in runs):.2g}"),  # half a percent of the largest
    )
    return plan, noise


TITLE = "Drawn by lot"
_PLANS = 4  # plans that are tried for an unmodelled fault
_BEAMS = 0.1  # share of the campaigns on a belt that does not roll


def draw_campaign(
    seed: int, streams, base: str, draw_plan: Callable[[], tuple[str, Plan, Noise]], **what: Any
) -> tuple[Campaign, Truth]:
    """One campaign on the first of a few plans that tell what is hidden from the library.

    draw_plan: gives name, plan and stated noise; what: kind, unmodelled and library as of ``random_hidden``.
    """
    for _ in range(_PLANS):
        name, plan, stated = draw_plan()
        noise = true_noise(plan, stated, streams[1])
        hidden = random_hidden(plan, partial(Detectability, plan, noise, base), base, streams[0], **what)
        if hidden.kind != "outside" or (hidden.distance or 0.0) >= REACHED * OUTSIDE[0]:
            break
    return measure_campaign(plan, noise, base, hidden, seed, streams, TITLE, name)


def random_base(rng: np.random.Generator) -> str:
    """The strip, or now and then a belt that does not roll."""
    return "beam_th2" if rng.random() < _BEAMS else "strip"


def random_campaign(
    seed: int, *, kind: str | None = None, blind: bool | None = True, plan: int | None = None
) -> tuple[Campaign, Truth]:
    """One campaign of the mix (``hidden.MIX``), or of one kind of it, on one of the plans or the one of a number.

    blind: True for unmodelled faults of the blind list only, False for those of the development list, None for both.
    """
    unmodelled = {None: BLIND_FAULTS + DEVELOPMENT_FAULTS, True: BLIND_FAULTS, False: DEVELOPMENT_FAULTS}[blind]
    streams, which = random_streams(check_seed(seed)), np.random.default_rng([seed, 1])
    kind = kind or str(which.choice(list(MIX), p=list(MIX.values())))
    base = random_base(which)

    def draw_plan() -> tuple[str, Plan, Noise]:
        number = int(which.integers(POOL)) if plan is None else plan
        name, chosen, stated = plan_by_number(number)
        return f"{name} {number}", chosen, stated

    return draw_campaign(seed, streams, base, draw_plan, kind=kind, unmodelled=unmodelled)
