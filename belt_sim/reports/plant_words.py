"""A diagnosis in the words of the plant: what is wrong, where on the machine, how large, how sure, what to check.

``CAUSES`` has a line for each effect of the library; an effect of one's own is described by its own file.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from belt_sim.effects.library import library, title_of
from belt_sim.results import words
from belt_sim.results.diagnosis import Diagnosis, Verdict
from belt_sim.results.found import RESOLVED, Estimate, FoundEffect, NextRun

SURE, LIKELY = 0.99, 0.9  # probabilities from which an explanation is called nearly certain, likely


@dataclass(frozen=True)
class Cause:
    """What an effect means at the machine.

    phrase: the fault as a clause, with {pulley} where it may be on either; parts: ids of the sketch that it is at;
    check: what to look at; of_model: the machine is sound, and the model left something out.
    """

    phrase: str
    parts: tuple[str, ...]
    check: str
    of_model: bool = False


_MODEL = "Nothing on the machine. Use a model that has this built in, or add the effect with effects.yaml."
_PI_TAPE = "Measure the {pulley} pulley's diameter at both sides and in the middle with a pi tape."
CAUSES: Mapping[str, Cause] = {
    "build_up": Cause(
        "dirt builds up on one side of the tail pulley", ("tail",), "Look at the tail pulley's surface, and clean it."
    ),
    "camber": Cause(
        "the belt is curved in its own plane (camber)",
        ("upper", "lower"),
        "Stretch a string along one edge of a free length of belt and measure the bow.",
    ),
    "cant": Cause(
        "the axis of the {pulley} pulley is not level",
        ("tail", "head"),
        "Put a machinist's level on the shaft of the {pulley} pulley.",
    ),
    "crown": Cause("the {pulley} pulley is crowned or hollow", ("tail", "head"), _PI_TAPE),
    "edge_guide": Cause(
        "a guide roller pushes the belt back at its edge",
        ("upper", "lower"),
        "Look for contact and wear at the guide rollers, and swing them away for one run.",
    ),
    "edge_profile": Cause(
        "the belt's edge is not straight",
        ("upper", "lower"),
        "Look whether the reading repeats with every turn of the belt; average over whole turns.",
    ),
    "encoder_scale": Cause(
        "the travel encoder shows too much or too little",
        ("encoder",),
        "Mark the belt, run it one turn, and compare the display with the belt's length.",
    ),
    "flatness": Cause(
        "the strip is not flat (long edges or a long middle)",
        ("upper", "lower"),
        "Slacken the belt and look for wavy edges or a loose middle.",
    ),
    "idler_skew": Cause(
        "a roller under the upper span is not square to the belt",
        ("upper",),
        "Measure the rollers' angles, or lower them away for one run.",
    ),
    "lift_off": Cause("the belt leaves its pulleys along a layer", ("tail", "head"), _MODEL, of_model=True),
    "machine_tilt": Cause(
        "the machine leans to one side",
        ("upper", "lower"),
        "Put a level across the frame, at the head and at the tail.",
    ),
    "off_centre_load": Cause(
        "the load on the upper span lies off centre", ("upper",), "Centre the load, or run the belt empty."
    ),
    "pulley_deflection": Cause(
        "the pulleys bend under the belt's pull",
        ("tail", "head"),
        "Compare shell and shaft stiffness with the belt's pull; look for a cracked shell or a thin shaft.",
    ),
    "run_up_points": Cause("a sagging span meets its pulley before the top", ("tail", "head"), _MODEL, of_model=True),
    "sag_roll": Cause("a slack belt hangs, and tilts instead of bending", ("upper", "lower"), _MODEL, of_model=True),
    "sensor_delay": Cause(
        "the edge sensors lag behind",
        ("sensors",),
        "Look up the sensors' filter time, and repeat a run at another speed.",
    ),
    "sensor_drift": Cause(
        "an edge sensor drifts with time", ("sensors",), "Read the sensor against a fixed edge before and after a run."
    ),
    "sensor_gain": Cause(
        "an edge sensor shows the wrong scale", ("sensors",), "Move a target by a gauge block in front of the sensor."
    ),
    "sensor_offset": Cause(
        "an edge sensor's zero is off", ("sensors",), "Set the sensor's zero on a straightedge along the machine."
    ),
    "shear": Cause("a short, wide span gives way in shear", ("upper", "lower"), _MODEL, of_model=True),
    "side_drag": Cause(
        "a scraper or skirt rubs on one edge of the upper span",
        ("upper",),
        "Look for rub marks on one edge, and lift the scraper for one run.",
    ),
    "slip": Cause(
        "the belt turns on its pulleys where it should stick",
        ("tail", "head"),
        "Look for grease, water or dust on the pulleys.",
    ),
    "soft_cover": Cause(
        "a soft pulley cover gives way under one edge",
        ("tail", "head"),
        "Measure thickness and hardness of the covers.",
    ),
    "speed_tension": Cause("speed takes tension off the spans", ("upper", "lower"), _MODEL, of_model=True),
    "taper": Cause("the {pulley} pulley is conical", ("tail", "head"), _PI_TAPE),
    "taper_drift": Cause(
        "the tail pulley becomes conical as it warms up",
        ("tail",),
        "Measure the temperature at both sides of the pulley.",
    ),
    "tension_bias": Cause(
        "the tension is not the one displayed", ("tensioner",), "Check the load cell with a known weight."
    ),
    "traction_loss": Cause(
        "the belt floats on a film of air or liquid at speed",
        ("tail", "head"),
        "Look for water at the run-ups, and repeat a run slowly.",
    ),
    "unequal_tension": Cause(
        "the left and the right tensioner do not pull alike",
        ("tensioner",),
        "Compare both tensioners' pressures or strokes, and free a guide that sticks.",
    ),
    "weld": Cause(
        "a weld puts a kink into the belt", ("upper", "lower"), "Lay a straightedge along the edge across the weld."
    ),
    "wobble": Cause(
        "the {pulley} pulley sits askew on its shaft",
        ("tail", "head"),
        "Turn the {pulley} pulley by hand and read a dial gauge at both sides.",
    ),
    "yaw_backlash": Cause(
        "the steering of the tail pulley has play",
        ("tail",),
        "Push the steered shaft to and fro with a dial gauge on it.",
    ),
    "yaw_compliance": Cause(
        "the belt turns the steered pulley back",
        ("tail",),
        "Put a dial gauge on the steered bearing while the belt is tensioned and steered.",
    ),
    "yaw_drift": Cause(
        "the steered pulley turns as the machine warms up",
        ("tail",),
        "Measure the axes' distance at both sides, cold and warm.",
    ),
    "yaw_offset_head": Cause(
        "the head pulley is not square to the machine",
        ("head",),
        "Measure the axes' distance at both sides of the machine.",
    ),
    "yaw_offset_tail": Cause(
        "the zero of the tail pulley's steering is off",
        ("tail",),
        "Measure the axes' distance at both sides, and set the steering's zero.",
    ),
}
#: parts of the sketch by the law that an effect of one's own changes
PARTS_OF_LAW = {
    "span": ("upper", "lower"),
    "run-up": ("tail", "head"),
    "wrap": ("tail", "head"),
    "drive": ("tail",),
    "sensor": ("sensors",),
}
#: SI unit -> (units of the shop in one of it, their name)
SHOP_UNITS = {
    "m": (1e3, "mm"),
    "rad": (1e3, "mm per m"),
    "Pa": (1e-6, "N/mm²"),
    "rad/s": (3.6e6, "mm per m an hour"),
    "rad/N": (1e6, "mm per m and kN"),
}
#: the same for single effects, where the number has a better picture
SHOP_UNITS_OF = {
    "camber": {"1/m": (12.5e3, "mm of bow over 10 m")},
    "taper": {"1/m": (1e3, "‰ of the radius per m of width")},
    "sensor_drift": {"m/s": (3.6e6, "mm an hour")},
    "sensor_gain": {"1": (100.0, "%")},
    "encoder_scale": {"1": (100.0, "%")},
    "tension_bias": {"1": (100.0, "%"), "Pa": (1e-6, "N/mm²")},
}


@dataclass(frozen=True)
class Card:
    """A named effect for people at the machine.

    fault: the clause of the headline; about: what the effect is, from its own file; parts: ids of the sketch; sizes: a
    line a number; sure: how sure; unsure: marked as such; others: what it may be instead; check: what to do.
    """

    id: str
    fault: str
    about: str
    parts: tuple[str, ...]
    sizes: tuple[str, ...]
    sure: str
    unsure: bool
    others: tuple[str, ...]
    check: str
    of_model: bool
    stamp: str


def card(e: FoundEffect) -> Card:
    """Return the card of a named effect."""
    cause, cls = CAUSES.get(e.id), library().get(e.id)
    pulley = _pulley(e)
    parts = cause.parts if cause else PARTS_OF_LAW.get(getattr(cls, "law", ""), ())
    if pulley and set(parts) >= {"tail", "head"}:
        parts = (pulley,)
    title = title_of(cls) if cls is not None else f"The effect {e.id} of your own"
    check = cause.check if cause else "See the effect's own file."
    return Card(
        id=e.id,
        fault=cause.phrase.format(pulley=pulley or "tail or head") if cause else f"the effect {e.id} acts",
        about=title,
        parts=parts,
        sizes=_sizes(e),
        sure=sureness(e.probability),
        unsure=e.probability < LIKELY,
        others=tuple(fault_of(name) for name in e.confusable_with),
        check=check.format(pulley=pulley or "tail or head"),
        of_model=bool(cause and cause.of_model),
        stamp=e.stamp,
    )


def fault_of(name: str) -> str:
    """Return the fault of an effect, or of several joined by +, with the id in brackets."""
    causes = [CAUSES.get(one.strip()) for one in name.split("+")]
    said = [c.phrase.format(pulley="tail or head") for c in causes if c is not None]
    return f"{' and '.join(said)} ({name})" if said else name


def sureness(probability: float) -> str:
    """Return a probability in words, with the figure."""
    probability = round(probability, 2)
    word = "nearly certain" if probability >= SURE else "likely" if probability >= LIKELY else "uncertain"
    return f"{word} (probability {words.fixed(min(probability, SURE), 2)}{' or more' if probability >= SURE else ''})"


def in_shop_units(effect: str, p: Estimate) -> str:
    """Return a fitted number with its uncertainty in units of the shop; as it is where there are none for it."""
    factor, unit = SHOP_UNITS_OF.get(effect, {}).get(p.unit) or SHOP_UNITS.get(p.unit, (0.0, ""))
    if not factor:
        return str(p)
    interval = p.interval and (p.interval[0] * factor, p.interval[1] * factor)
    return str(Estimate(p.value * factor, p.u * factor, unit, p.plausible, interval))


def _sizes(e: FoundEffect) -> tuple[str, ...]:
    cls = library().get(e.id)
    meanings = {n: p.meaning for n, p in cls.parameters.items()} if cls is not None else {}
    if not e.parameters:
        return e.sizes
    return tuple(f"{meanings.get(n, n)}: {in_shop_units(e.id, p)}" for n, p in e.parameters.items())


def _pulley(e: FoundEffect) -> str | None:
    """Return the pulley that an effect is at, by the larger of its fitted numbers; None where none is fitted."""
    known = {n: abs(p.value) / p.u if p.u > 0 else math.inf for n, p in e.parameters.items()}
    if not known:
        return None
    return "head" if max(known, key=lambda n: known[n]).endswith("_head") else "tail"


def headline(d: Diagnosis, cards: list[Card]) -> str:
    """Return what is wrong, in one sentence of the plant."""
    if d.verdict is Verdict.CANNOT_SAY:
        wrong = any(s.severity == "stop" for s in d.suspicions)
        cause = (
            "The data look damaged, or the sheet is wrong" if wrong else "These readings are too few to show a fault"
        )
        return f"{cause}, so nothing can be said of the machine yet"
    at_machine = [c.fault for c in cards if not c.of_model and not c.unsure]
    perhaps = [c.fault for c in cards if not c.of_model and c.unsure]
    left_out = [c.fault for c in cards if c.of_model]
    said = f"Most likely {words.listed(at_machine)}" if at_machine else ""
    if perhaps:
        said = f"{said}. Perhaps also {words.listed(perhaps)}" if said else f"Perhaps {words.listed(perhaps)}"
    if left_out and said:
        said += f". Besides, {words.listed(left_out)}, which the model leaves out"
    elif left_out:
        said = f"The machine shows no fault. The model leaves out that {words.listed(left_out)}"
    if d.verdict is Verdict.PARTLY and said:
        return f"{said}. Something unknown acts as well"
    if said:
        return said
    if d.verdict is Verdict.ADEQUATE:
        return "No fault shows: the belt moves as the model says"
    return "Something moves the belt that none of the known causes explains"


def advice(n: NextRun) -> str:
    """Return what a further run would tell; below 3 sigma that no single run tells it."""
    pair = " from ".join(n.separates)
    change = f"{words.number(n.sigma_before, 2)} → {words.number(n.sigma_after, 2)} sigma"
    if n.sigma_after < RESOLVED:
        return f"No single further run on this rig tells {pair}. The best would be: {n.action} ({change})."
    return f"{n.action[:1].upper()}{n.action[1:]}. It tells {pair} ({change})."
