"""An empty campaign for a machine: the runs that a diagnosis needs, a commented sheet, empty tables."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from belt_sim import plausible
from belt_sim.campaign import Campaign, Machine, Quantity, Run, SettingsSheet, SignalSheet, Source
from belt_sim.campaign.folder import put_folder, read_plan, runs_text
from belt_sim.campaign.problems import did_you_mean
from belt_sim.campaign.types import PLACES, BeltSheet
from belt_sim.case import Belt, Rig
from belt_sim.errors import InputError
from belt_sim.foresight.harm import harm_warnings, safe_yaw
from belt_sim.importing.build import sheet_text
from belt_sim.importing.columns import SIGNAL_NAMES
from belt_sim.importing.sheets import BELT, GAIN, MACHINE, TENSION_REL, YAW_U
from belt_sim.si import DEGREE, MM, N_PER_MM2, round_digits

#: Sag stretch over elastic stretch, Lambda, of a slack, a middling and a tight belt; bounds of the tensions [N/mm2].
LAMBDAS, LEAST, MOST = (30.0, 3.0, 0.3), 2.0, 150.0
#: The belt may drift by this share of its width over a record of so many spans; drift per yaw is about a half.
DRIFT, SPANS, DRIFT_PER_YAW = 0.1, 5.3, 0.5
#: Sensors as they usually are, to be replaced: white, zero, wander [m] or [rad] and its length [m].
WHITE, ZERO, WANDER, LENGTH = 2e-5, 1e-4, 5e-5, 3.0
TYPICAL = "typical, REPLACE by your sensor's"

_PLAN = """\
# The runs, and what each is good for

Record every run over {travel} m of belt travel from the yaw on (a few metres before it help), the belt straight and
at rest in its track to begin with. If time is short, take them from the top, but not without the repeats. At these
yaws the belt drifts by about {drift}; stop before an edge touches anything. What is not measured: take its row out of
runs.csv.

{warnings}{table}

Before measuring: `belt-sim check campaign=THIS_FOLDER` says what these runs could tell. Afterwards fill in signals.csv,
or let `belt-sim import` write a campaign from the logger's files.
"""


@dataclass(frozen=True)
class PlannedRun:
    """One run and what it is good for."""

    run: Run
    good_for: str


def tensions_for(rig: Rig, belt: Belt) -> list[float]:
    """A slack, a middling and a tight tension [N/mm2], from Lambda = (rho g L)^2 E / (12 sigma^3)."""
    load = belt.density * rig.gravity * rig.span_length
    found = [(load**2 * belt.youngs_modulus / (12.0 * wanted)) ** (1.0 / 3.0) / N_PER_MM2 for wanted in LAMBDAS]
    rounded = [float(f"{min(max(t, LEAST), MOST):.2g}") for t in found]
    return [t if k == 0 else max(t, float(f"{1.5 * rounded[k - 1]:.2g}")) for k, t in enumerate(rounded)]


def travel_for(rig: Rig) -> float:
    """How long a record should be [m]: until late drift is plain."""
    return 5.0 * math.ceil(SPANS * rig.span_length / 5.0)


def yaw_for(rig: Rig, belt: Belt, tensions: list[float]) -> float:
    """A yaw [deg] that moves the belt by a tenth of its width over a record; less where twice as much would harm it."""
    wanted = DRIFT * belt.width / (DRIFT_PER_YAW * travel_for(rig)) / DEGREE
    harmless = safe_yaw(rig, belt, [t * N_PER_MM2 for t in tensions]) / DEGREE / 2.0
    if wanted < harmless:
        return float(f"{wanted:.2g}")
    step = 10.0 ** (math.floor(math.log10(harmless)) - 1)
    return float(f"{math.floor(harmless / step) * step:.2g}")  # cut to two digits


def plan_for(tensions: list[float], yaw: float, speed: float) -> list[PlannedRun]:
    """Runs at tensions [N/mm2], either sign of a yaw [deg], and what tells look-alikes apart; most telling first."""
    low, middle, high = tensions[0], tensions[(len(tensions) - 1) // 2], tensions[-1]
    found: list[PlannedRun] = []

    def add(words: str, tension: float, angle: float, **more) -> str:
        name = f"r{len(found) + 1:02d}"
        settings = {"speed": speed} | more
        run = Run(name=name, tension=tension * N_PER_MM2, yaw=angle * DEGREE, **settings)
        found.append(PlannedRun(run, words))
        return name

    names = {}
    for k, tension in enumerate(tensions):
        what = (
            "slack: sag, camber, weight" if k == 0 else "tight: pulleys, yaw, sensors" if tension == high else "between"
        )
        names[tension, -1] = add(f"one sign of yaw, {what}", tension, -yaw)
        words = f"the other sign at {tension:g}: what does not turn with the yaw is the machine's own"
        names[tension, 1] = add(words, tension, yaw)
    add("a repeat: noise and settings are read off it", middle, -yaw, repeat_of=names[middle, -1])
    add("a repeat at the other end of the tensions", low, yaw, repeat_of=names[low, 1])
    add("zero yaw: what the machine does by itself, and the noise without any model", low, 0.0)
    add("zero yaw at the tightest: offsets that tension does not touch", high, 0.0)
    add("travel reversed: offsets of a pulley from skewed rollers and drag", middle, -yaw, direction=-1.0)
    add("twice the yaw: play and springs (guides, crowns) from what is in proportion", middle, 2.0 * yaw)
    add("half the speed: what goes with time (warming, delay), not with travel", middle, yaw, speed=speed / 2.0)
    add("twice the speed: traction, delay", middle, yaw, speed=speed * 2.0)
    return found


PLAN_COLUMNS = ("run", "N/mm2", "yaw deg", "m/s", "direction", "good for")


def plan_rows(planned: Sequence[PlannedRun]) -> list[tuple[str, ...]]:
    """The plan as rows of PLAN_COLUMNS."""
    rows: list[tuple[str, ...]] = []
    for p in planned:
        tension, yaw = f"{p.run.tension / N_PER_MM2:g}", f"{p.run.yaw / DEGREE:+.3g}"
        rows.append((p.run.name, tension, yaw, f"{p.run.speed:g}", f"{p.run.direction:+.0f}", p.good_for))
    return rows


def plan_text(planned: list[PlannedRun], travel: float, warnings: Sequence[str] = ()) -> str:
    """The plan as a text beside the campaign; warnings: of runs that could harm the belt."""
    rows = [PLAN_COLUMNS, ("---",) * len(PLAN_COLUMNS), *plan_rows(planned)]
    table = "\n".join(f"| {' | '.join(row)} |" for row in rows)
    most = max(abs(p.run.yaw) for p in planned if p.run.yaw) / 2.0
    drift = f"{DRIFT_PER_YAW * most * travel / MM:.2g} mm"
    told = "".join(f"**Warning**: {w}.\n\n" for w in warnings)
    return _PLAN.format(travel=f"{travel:g}", drift=drift, table=table, warnings=told)


# ---- the folder


def template(
    folder: str | Path, rig: Rig, belt: Belt, planned: list[PlannedRun], places: list[str], travel: float, title: str
) -> Campaign:
    """Write the folder and return the plan as it is read back; raises InputError for a folder that is not empty."""
    for place in places:
        if place not in PLACES:
            raise InputError("signals", place, "", did_you_mean(place, PLACES))
    signals = tuple(_signal(place) for place in dict.fromkeys(places))
    campaign = Campaign(
        title=title,
        source=Source(kind="measured", reference="REPLACE: log book, date", licence=""),
        machine=Machine(**{n: _quantity(getattr(rig, n), MACHINE[n].relative_u) for n in plausible.MACHINE}),
        belt=BeltSheet(**{n: _quantity(getattr(belt, n), BELT[n].relative_u) for n in BELT}),
        signals=signals,
        settings=SettingsSheet(tension_rel=TENSION_REL, yaw_u=YAW_U),
        runs=tuple(p.run for p in planned),
    )
    texts = {
        "campaign.yaml": sheet_text(campaign, _remarks(campaign)),
        "runs.csv": runs_text(campaign.runs),
        "signals.csv": ",".join(["run", "travel_m", *(s.name for s in signals)]) + "\n",
        "plan.md": plan_text(planned, travel, harm_warnings(campaign)),
    }
    return put_folder(texts, folder, overwrite=False, check=lambda f: read_plan(f, travel=travel, step=travel / 120.0))


def _signal(place: str) -> SignalSheet:
    kind = PLACES[place]
    unit, white = ("mm", WHITE) if kind == "lateral" else ("mrad", 5.0 * WHITE)
    errors = {"zero": ZERO, "gain": GAIN, "wander_sd": WANDER, "wander_length": LENGTH}
    return SignalSheet(name=SIGNAL_NAMES[place], at=place, kind=kind, unit=unit, white=white, **errors)


def _quantity(value: float, relative: float) -> Quantity:
    return Quantity(value=float(value), u=round_digits(relative * value, 2))


def _remarks(campaign: Campaign) -> dict[str, str]:
    keys = [f"machine.{k}" for k in MACHINE] + [f"belt.{k}" for k in ("width", "thickness", "youngs_modulus")]
    remarks = dict.fromkeys(keys, "u is assumed")
    for signal in campaign.signals:
        remarks |= {f"signals.{signal.name}.{k}": TYPICAL for k in ("white", "zero", "gain", "wander")}
    return remarks | {f"settings.{k}": "assumed, REPLACE" for k in ("tension_rel", "yaw")}
