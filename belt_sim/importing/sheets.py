"""The data sheet: machine, belt, signals and settings of a campaign, its text, and an empty campaign for a machine.

Numbers are stated by the mapping, read off the runs, or assumed. White noise is what scatters from sample to sample.
Wander is what two runs at the same settings differ by, beside a straight line (settings and zero). Without repeats it
is what a smooth curve leaves of a run: a lower bound, since neither a belt's own movement nor the drift of a fault must
count, and a fault acts at zero yaw as well.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import BSpline

from belt_sim.campaign import Campaign, Run, SignalSheet, Source
from belt_sim.campaign.folder import put_folder, read_plan, runs_text, sheet_tree
from belt_sim.campaign.quality import resolution, scatter, scatter_of_wander
from belt_sim.campaign.sheet import Entry, field_texts
from belt_sim.campaign.types import PLACES, BeltSheet, Machine, Quantity, SettingsSheet, did_you_mean, kind_at
from belt_sim.case import Belt, Case, Rig, Schedule, Settings
from belt_sim.diagnosis.foresight import harm_warnings
from belt_sim.errors import InputError
from belt_sim.importing.columns import SIGNAL_NAMES, USUAL_UNITS, Column
from belt_sim.importing.mapping import DATA, MappingEntry, Question, ask, flow_text, texts_of
from belt_sim.io import group_names
from belt_sim.settings import BOUNDS, SIGNAL_DIMENSION, belt_from, rig_from
from belt_sim.units import DEGREE, MM, N_PER_MM2, UNITS, quantity, round_digits, size_of, two_digits
from belt_sim.validity import STRENGTH, limits


def settings_of(mapping: MappingEntry) -> tuple[SettingsSheet, dict[str, str]]:
    """How well runs hit their settings, and remarks on what is assumed of it."""
    asked = {
        "tension_rel": (mapping.settings.tension_rel, "1", TENSION_REL, "how well the tension is known"),
        "yaw": (mapping.settings.yaw, "urad", YAW_U, "how well a run hits its yaw"),
    }
    remarks = {f"settings.{k}": f"assumed, no data tell it; state {a[-1]}" for k, a in asked.items() if a[0] is None}
    known = {k: u if text is None else size_of(text, unit, f"settings.{k}") for k, (text, unit, u, _) in asked.items()}
    return SettingsSheet(tension_rel=known["tension_rel"], yaw_u=known["yaw"]), remarks


def machine_and_belt(
    of_machine: Entry | Rig | str | None, of_belt: Entry | Belt | str | None
) -> tuple[Machine | None, BeltSheet | None, dict[str, str], list[Question]]:
    """Machine and belt, each None where something of it is missing; remarks on their numbers; what is missing."""
    machine: Machine | None = None
    belt: BeltSheet | None = None
    found, remarks, missing = _quantities(of_machine, "machine")
    own = [k for k in ("head_radius", "tail_radius") if k in found]
    if len(own) == 1 or (own and "pulley_radius" in found):
        remedy = "state either pulley_radius, or both head_radius and tail_radius"
        raise InputError("machine", ", ".join(own), "", remedy)
    missing = [q for q in missing if not (own and q.path[-1] == "pulley_radius")]
    if not missing:
        radii = {k: found[k if own else "pulley_radius"] for k in ("head_radius", "tail_radius")}
        machine, centre = Machine(centre_distance=found["centre_distance"], **radii), found["centre_distance"].value
        if machine.head_radius.value + machine.tail_radius.value >= centre:
            raise InputError("machine.centre_distance", centre, "m", "the pulleys overlap; check the radii")
    remarks |= {"machine.pulley_radius": remarks["machine.head_radius"]} if "machine.head_radius" in remarks else {}
    found, about_numbers, about_belt = _quantities(of_belt, "belt")
    if not about_belt:
        belt = BeltSheet(**found)
        if belt.thickness.value >= belt.width.value:
            raise InputError("belt.thickness", f"{belt.thickness.value * 1e3:g}", "mm", "must be below the width")
    return machine, belt, remarks | about_numbers, missing + about_belt


def _quantities(
    entry: Entry | Rig | Belt | str | None, part: str
) -> tuple[dict[str, Quantity], dict[str, str], list[Question]]:
    """Numbers of machine or belt that are written as text with units, or those of a rig or belt or its name; remarks
    on them, and questions on those that are missing."""
    found, remarks, missing = dict[str, Quantity](), dict[str, str](), list[Question]()
    if isinstance(entry, str):
        kind, read = ("rig", rig_from) if part == "machine" else ("belt", belt_from)
        if entry not in (names := group_names(kind)):
            raise InputError(part, entry, "", f"is no {kind} that is known ({', '.join(names)}); give its numbers")
        entry = read(entry)
    for name, (unit, relative_u) in DATA[part].items():
        stated, u, bounds = getattr(entry, name, None), None, BOUNDS[name]
        if stated is None:
            missing += [ask(name)] if name in texts_of("questions.yaml") else []
            continue
        if isinstance(stated, str):
            value, u, own = quantity(stated, (bounds.dimension,), unit, f"{part}.{name}")
            stated, u = bounds.check(value, own, name=f"{part}.{name}"), None if u is None else u * UNITS[own][1]
        if u is None and relative_u:
            remarks[f"{part}.{name}"] = "u is assumed, none was stated"
        u = relative_u * float(stated) if u is None else u
        found[name] = Quantity(value=round_digits(float(stated), 12), u=round_digits(u, 12))
    return found, remarks, missing


# ---- signals and their noise

#: Stated when the mapping says nothing: relative error of the tension, of the yaw [rad], of a sensor's scale.
TENSION_REL, YAW_U, GAIN = 0.01, 5e-6, 0.005
FEWEST_SAMPLES = 20  # samples from which anything is read
KNOT_SPACING = 0.5  # of a span: spacing of the knots of the smooth curve, a spline
LEAST_WHITE = 0.3  # of the scatter from sample to sample, which wander cannot explain alone
FAINT_WANDER = 0.1  # of the white noise, below which a wander is none
DEFAULT_LENGTH = 3.0  # [m], where nothing tells
WANDER_LENGTHS = np.exp(np.linspace(np.log(0.3), np.log(20.0), 40))  # [m]


class NoiseRead(NamedTuple):
    """What was read off one signal: white, wander, zero [SI], wander length [m], each with where it comes from."""

    white: float
    wander: float
    length: float
    zero: float
    white_from: str
    wander_from: str
    zero_from: str


def signals_of(
    runs: list[Run], used: tuple[Column, ...], span: float
) -> tuple[tuple[SignalSheet, ...], dict[str, NoiseRead], dict[str, str]]:
    """Sheets of the signals, what was read off them, and remarks on each number: where it comes from."""
    columns: dict[str, Column] = {}
    for column in used:
        if column.role == "signal" and column.at and any(column.signal in r.signals for r in runs):
            columns.setdefault(column.signal, column)
    noise, remarks, sheets = {name: noise_of(name, runs, span) for name in columns}, dict[str, str](), []
    for name, column in columns.items():
        read, own, where, kind = noise[name], column.entry, f"columns.{column.name}", kind_at(column.at)
        assert kind is not None
        unit, length = USUAL_UNITS[SIGNAL_DIMENSION[kind]], read.length
        found = {
            "white": (read.white, f"from {read.white_from}"),
            "zero": (read.zero, f"from {read.zero_from}"),
            "gain": (GAIN, "assumed, no data tell it; state the sensor's accuracy"),
            "wander": (read.wander, f"from {read.wander_from}"),
        }
        if column.by_hand is not None:
            found["white"] = column.by_hand, "one sigma of reading the picture"
            found["wander"], length = (0.0, "none, read by hand"), 1.0
        for key, text in (("white", own.white), ("zero", own.zero), ("gain", own.gain)):
            if text is not None:
                found[key] = size_of(text, "1" if key == "gain" else unit, f"{where}.{key}"), "stated"
        if own.wander is not None:
            found["wander"] = size_of(own.wander.sd, unit, f"{where}.wander.sd"), "stated"
            length = size_of(own.wander.length_m, "m", f"{where}.wander.length_m")
        remarks |= {f"signals.{name}.{key}": source for key, (_, source) in found.items()}
        white, zero, wander = (round_digits(found[key][0], 3) for key in ("white", "zero", "wander"))
        errors = {"white": white, "zero": zero, "gain": found["gain"][0], "wander_sd": wander, "wander_length": length}
        sheets.append(SignalSheet(name=name, at=column.at, kind=kind, unit=unit, **errors))
    return tuple(sheets), noise, remarks


def noise_of(signal: str, runs: list[Run], span: float) -> NoiseRead:
    """Noise of one signal from all runs that have it; span [m]."""
    own = [r for r in runs if signal in r.signals and np.isfinite(r.signals[signal]).sum() >= 3]
    there = {r.name: r.signals[signal][np.isfinite(r.signals[signal])] for r in own}
    # by the median second difference, by their rms where most are rounded away
    levels = [scatter(y) or float(np.sqrt(np.mean(np.diff(y, 2) ** 2) / 6.0)) for y in there.values()]
    white = float(np.median(levels)) if own else 0.0
    records = {}  # from the yaw on
    for run in own:
        rows = np.isfinite(run.signals[signal]) & (run.travel >= run.yaw_at)
        records[run.name] = run.travel[rows], run.signals[signal][rows]
    pairs = []  # differences of repeats from their first run over the square root of 2: each has half of their variance
    for run in own:
        (s, y), (s_first, first) = records[run.name], records.get(run.repeat_of or "", (np.empty(0), np.empty(0)))
        rows = np.isin(np.round(s, 6), np.round(s_first, 6))
        if len(s_first) and rows.sum() < 0.5 * len(s):
            rows = (s >= s_first[0]) & (s <= s_first[-1])
        if rows.any():
            pairs.append((s[rows], (y[rows] - np.interp(s[rows], s_first, first)) / np.sqrt(2.0)))
    # errors of zero and yaw are no wander
    traces = [(s, y - np.polynomial.Polynomial.fit(s, y, 1)(s)) for s, y in pairs if len(s) >= FEWEST_SAMPLES]
    source = f"{len(traces)} pair{'s' if len(traces) != 1 else ''} of repeats"
    if not traces:
        for s, y in (record for record in records.values() if len(record[0]) >= FEWEST_SAMPLES):
            count = int(np.clip((s[-1] - s[0]) / (KNOT_SPACING * span), 2, len(s) // 4))
            knots = np.concatenate([[s[0]] * 3, np.linspace(s[0], s[-1], count + 1), [s[-1]] * 3])
            basis = BSpline.design_matrix(s, knots, 3).toarray()
            traces.append((s, y - basis @ np.linalg.lstsq(basis, y, rcond=None)[0]))
        source = "what a smooth curve leaves of single runs: a lower bound; repeat a run to know better"
    wander, length, white = _levels(traces, white)
    steps = map(resolution, there.values())
    white = max(white, min((s for s in steps if s > 0.0), default=0.0) / float(np.sqrt(12.0)), 1e-9)
    wander = wander if wander > FAINT_WANDER * white else 0.0
    zero, zero_from = float(np.hypot(0.5 * white, wander)), "the noise of the first readings"
    firsts = (y[s <= s[0] + 0.1 * np.ptp(s)] for s, y in pairs)
    apart = [float(np.mean(first)) for first in firsts if len(first) >= 3]
    if len(apart) > 1:
        zero = max(float(np.sqrt(np.mean(np.square(apart)))), zero)
        zero_from = f"where {len(apart)} repeats begin"
    white_from = f"the scatter from sample to sample in {len(own)} run{'s' if len(own) != 1 else ''}"
    return NoiseRead(white, wander, length, zero, white_from, source, zero_from)


def _levels(traces: list[tuple[np.ndarray, np.ndarray]], white: float) -> tuple[float, float, float]:
    """(wander sd, wander length, white) of correlated noise exp(-d/length) and white noise, by the structure function
    of traces: travel [m] and values along it, each (n,).

    Half the mean squared difference over a lag d is white^2 + sd^2 (1 - exp(-d/length)).
    """
    spacing = [float(np.median(np.diff(s))) for s, _ in traces if len(s) > 2]
    step, longest = (float(np.median(spacing)), max(float(np.ptp(s)) for s, _ in traces)) if spacing else (1.0, 0.0)
    found = []  # lag [m], half the mean squared difference over it, and from how many independent stretches
    for count in np.unique(np.round(np.geomspace(1, max(longest / (4.0 * step), 1), 24)).astype(int)):
        squares = np.concatenate([(y[count:] - y[:-count]) ** 2 for _, y in traces if spacing] or [np.empty(0)])
        if len(squares) > 4:
            found.append((count * step, 0.5 * float(np.mean(squares)), min(len(squares) / count, 1e3)))
    if len(found) < 4:
        return 0.0, DEFAULT_LENGTH, white
    lags, halves, weights = np.array(found).T
    root = np.sqrt(weights) / np.maximum(halves, 1e-30)
    best = (np.inf, 0.0, DEFAULT_LENGTH)
    for length in WANDER_LENGTHS[lags[-1] >= WANDER_LENGTHS]:
        shape = np.stack([np.ones_like(lags), 1.0 - np.exp(-lags / length)])
        sizes = np.maximum(np.linalg.lstsq((shape * root).T, halves * root, rcond=None)[0], 0.0)
        cost = float(np.sum(((sizes @ shape - halves) * root) ** 2))
        best = min(best, (cost, float(np.sqrt(sizes[1])), float(length)))
    _, sd, length = best
    without_wander = white**2 - scatter_of_wander(sd, length, lags[0]) ** 2
    return sd, float(f"{length:.2g}"), float(np.sqrt(max(without_wander, (LEAST_WHITE * white) ** 2)))


# ---- the sheet with a comment beside every field

COLUMN = 60


def sheet_text(campaign: Campaign, remarks: dict[str, str]) -> str:
    """The sheet with a comment beside every field; remarks: dotted key -> where its number comes from."""
    lines = ["# belt-sim campaign sheet. Every number that is uncertain has u: one sigma in the unit of the value."]
    tree = sheet_tree(campaign)
    for signal in campaign.signals:
        tree["signals"][signal.name].setdefault("wander", {"sd": 0, "length_m": signal.wander_length})
    for key, value in tree.items():
        lines += _lines((key,), value, remarks)
    return "\n".join([*lines, ""])


def _lines(path: tuple[str, ...], value: Any, remarks: dict[str, str]) -> list[str]:
    """The lines of a field; a quantity and a spread take one."""
    begin, where = "  " * (len(path) - 1) + flow_text(path[-1]) + ":", ".".join(path)
    if isinstance(value, dict) and value and not {"u", "sd"} & set(value):
        return [begin, *(line for key, inner in value.items() for line in _lines((*path, key), inner, remarks))]
    meaning = field_texts("meaning").get(path[-1], "")
    comment = "; ".join(part for part in (meaning, remarks.get(where, "")) if part)
    entries = value.items() if isinstance(value, dict) else [("", value)]  # 200, not 200.0
    whole = {k: int(v) if isinstance(v, float) and v.is_integer() else v for k, v in entries}
    text = f"{begin} {flow_text(whole if isinstance(value, dict) else whole[''])}"
    return [f"{text:{COLUMN}s}  # {comment}" if comment else text]


#: Sag stretch over elastic stretch, Lambda, of a slack, a middling and a tight belt; bounds of the tensions [N/mm2].
LAMBDAS, LEAST, LARGEST_LAMBDA = (30.0, 3.0, 0.3), 2.0, 150.0
#: The belt may drift by this share of its width over a record of so many spans; drift per yaw is about a half.
DRIFT, RECORD_SPANS, DRIFT_PER_YAW = 0.1, 5.3, 0.5
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


#: a run and what it is good for
PlannedRun = tuple[Run, str]


def travel_for(rig: Rig) -> float:
    """How long a record should be [m]: until late drift is plain."""
    return 5.0 * math.ceil(RECORD_SPANS * rig.span_length / 5.0)


#: Share of the yaw at which an edge goes slack, or the linear laws end, that a plan may use.
SHARE = 0.8
#: Share of the belt's bending fatigue strength that tension, bending over the pulleys and the yaw together may reach.
STRESS = 0.9
#: A yaw at which the limits are asked; their loads go with the yaw or with its square [rad].
_ASKED = 0.01 * DEGREE


def plan_for(
    rig: Rig, belt: Belt, speed: float, tensions: list[float] | None = None, yaw: float | None = None
) -> list[PlannedRun]:
    """Runs at tensions [N/mm2], either sign of a yaw [deg], and what tells look-alikes apart; most telling first.

    tensions: a slack, a middling and a tight one, from Lambda = (rho g L)^2 E / (12 sigma^3), unless stated; yaw: one
    that moves the belt by a tenth of its width over a record, less where twice as much would harm it, unless stated.
    """
    if tensions is None:
        load, rounded = belt.density * rig.gravity * rig.span_length, list[float]()
        for wanted in LAMBDAS:
            tension = (load**2 * belt.youngs_modulus / (12.0 * wanted)) ** (1.0 / 3.0) / N_PER_MM2
            rounded.append(round_digits(min(max(tension, LEAST), LARGEST_LAMBDA), 2))
        tensions = [*rounded[:1], *(max(t, round_digits(1.5 * s, 2)) for s, t in pairwise(rounded))]
    if yaw is None:
        yaw = DRIFT * belt.width / (DRIFT_PER_YAW * travel_for(rig)) / DEGREE
        # half the largest that harms no run and leaves no law of the models behind
        sizes = list[float]()
        for tension in (t * N_PER_MM2 for t in tensions):
            asked = Settings(tension=tension, yaw=Schedule.step(_ASKED))
            loads = {limit.id: float(limit.load) for limit in limits(Case(rig=rig, belt=belt, settings=asked))}
            bent = loads["thick_belt"] * STRENGTH
            room = max(STRESS * STRENGTH - bent, 0.0) / (tension * loads["slack_edge"])
            ends = (("slack_edge", 1.0), ("second_order", 0.5))  # neither without gravity and sag
            sizes += [(SHARE / loads[name]) ** power for name, power in ends if loads[name] > 0.0]
            sizes += [room] if room else []  # a belt that its pulleys alone bend too far is told of, whatever the yaw
        harmless = _ASKED * min(sizes) / DEGREE / 2.0
        yaw = round_digits(yaw, 2) if yaw < harmless else two_digits(harmless)
    low, middle, high = tensions[0], tensions[(len(tensions) - 1) // 2], tensions[-1]
    rows: list[tuple[str, float, float, dict[str, Any]]] = []  # what it is good for, N/mm2, degrees, other settings
    names: dict[tuple[float, int], str] = {}
    for tension in tensions:
        what = "tight: pulleys, yaw, sensors" if tension == high else "between"
        rows.append((f"one sign of yaw, {'slack: sag, camber, weight' if tension == low else what}", tension, -yaw, {}))
        words = f"the other sign at {tension:g}: what does not turn with the yaw is the machine's own"
        rows.append((words, tension, yaw, {}))
        names |= {(tension, -1): f"r{len(rows) - 1:02d}", (tension, 1): f"r{len(rows):02d}"}
    rows += [
        ("a repeat: noise and settings are read off it", middle, -yaw, {"repeat_of": names[middle, -1]}),
        ("a repeat at the other end of the tensions", low, yaw, {"repeat_of": names[low, 1]}),
        ("zero yaw: what the machine does by itself, and the noise without any model", low, 0.0, {}),
        ("zero yaw at the tightest: offsets that tension does not touch", high, 0.0, {}),
        ("travel reversed: offsets of a pulley from skewed rollers and drag", middle, -yaw, {"direction": -1.0}),
        ("twice the yaw: play and springs (guides, crowns) from what is in proportion", middle, 2.0 * yaw, {}),
        ("half the speed: what goes with time (warming, delay), not with travel", middle, yaw, {"speed": speed / 2.0}),
        ("twice the speed: traction, delay", middle, yaw, {"speed": speed * 2.0}),
    ]
    found = []
    for k, (words, tension, angle, more) in enumerate(rows, start=1):
        settings = {"tension": tension * N_PER_MM2, "yaw": angle * DEGREE, "speed": speed} | more
        found.append((Run(name=f"r{k:02d}", **settings), words))
    return found


PLAN_COLUMNS = ("run", "N/mm2", "yaw deg", "m/s", "direction", "good for")


def plan_rows(planned: Sequence[PlannedRun]) -> list[tuple[str, ...]]:
    """The plan as rows of PLAN_COLUMNS."""
    return [
        (r.name, f"{r.tension / N_PER_MM2:g}", f"{r.yaw / DEGREE:+.3g}", f"{r.speed:g}", f"{r.direction:+.0f}", words)
        for r, words in planned
    ]


# ---- the folder


def template(
    folder: str | Path, rig: Rig, belt: Belt, planned: list[PlannedRun], places: list[str], travel: float, title: str
) -> Campaign:
    """Write the folder and return the plan as it is read back; raises InputError for a folder that is not empty."""
    machine, belt_sheet, remarks, _ = machine_and_belt(rig, belt)
    assert machine is not None
    assert belt_sheet is not None
    signals, remarks = [], remarks | {f"settings.{k}": "assumed, REPLACE" for k in ("tension_rel", "yaw")}
    for place in dict.fromkeys(places):
        if place not in PLACES:
            raise InputError("signals", place, "", did_you_mean(place, PLACES))
        name, kind = SIGNAL_NAMES[place], PLACES[place]
        unit, white = ("mm", WHITE) if kind == "lateral" else ("mrad", 5.0 * WHITE)
        errors = {"white": white, "zero": ZERO, "gain": GAIN, "wander_sd": WANDER, "wander_length": LENGTH}
        signals.append(SignalSheet(name=name, at=place, kind=kind, unit=unit, **errors))
        remarks |= {f"signals.{name}.{k}": TYPICAL for k in ("white", "zero", "gain", "wander")}
    campaign = Campaign(
        title=title,
        source=Source(kind="measured", reference="REPLACE: log book, date", licence=""),
        machine=machine,
        belt=belt_sheet,
        signals=tuple(signals),
        settings=SettingsSheet(tension_rel=TENSION_REL, yaw_u=YAW_U),
        runs=tuple(run for run, _ in planned),
    )
    rows = [PLAN_COLUMNS, ("---",) * len(PLAN_COLUMNS), *plan_rows(planned)]
    most = max(abs(run.yaw) for run, _ in planned) / 2.0
    plan = _PLAN.format(
        travel=f"{travel:g}",
        drift=f"{DRIFT_PER_YAW * most * travel / MM:.2g} mm",
        table="\n".join(f"| {' | '.join(row)} |" for row in rows),
        warnings="".join(f"**Warning**: {warning}.\n\n" for warning in harm_warnings(campaign)),
    )
    texts = {
        "campaign.yaml": sheet_text(campaign, remarks),
        "runs.csv": runs_text(campaign.runs),
        "signals.csv": ",".join(["run", "travel_m", *(s.name for s in signals)]) + "\n",
        "plan.md": plan,
    }
    return put_folder(texts, folder, overwrite=False, check=lambda f: read_plan(f, travel=travel, step=travel / 120.0))
