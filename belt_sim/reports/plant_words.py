"""A diagnosis in the words of the plant: what is wrong, where on the machine, how large, how sure, what to check.

The words of an effect stand in its class (``Effect.cause``).
"""

import math
from dataclasses import dataclass

from belt_sim.effects.library import library, title_of
from belt_sim.results import words
from belt_sim.results.diagnosis import Diagnosis, Verdict
from belt_sim.results.found import RESOLVED, Estimate, FoundEffect, NextRun

SURE, LIKELY = 0.99, 0.9  # probabilities from which an explanation is called nearly certain, likely


#: parts of the sketch by the law that an effect of one's own changes
PARTS_OF_LAW = {
    "span": ("upper", "lower"),
    "run-up": ("tail", "head"),
    "wrap": ("tail", "head"),
    "drive": ("tail",),
    "sensor": ("sensors",),
}
#: SI unit -> (units of the shop in one of it, their name), unless the effect has its own (Parameter.shop)
SHOP_UNITS = {
    "m": (1e3, "mm"),
    "rad": (1e3, "mm per m"),
    "Pa": (1e-6, "N/mm²"),
    "rad/s": (3.6e6, "mm per m an hour"),
    "m/s": (3.6e6, "mm an hour"),
    "rad/N": (1e6, "mm per m and kN"),
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
    cls = library().get(e.id)
    cause = cls.cause if cls is not None else None
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
    classes = [library().get(one.strip()) for one in name.split("+")]
    said = [c.cause.phrase.format(pulley="tail or head") for c in classes if c is not None and c.cause is not None]
    return f"{' and '.join(said)} ({name})" if said else name


def sureness(probability: float) -> str:
    """Return a probability in words, with the figure."""
    probability = round(probability, 2)
    word = "nearly certain" if probability >= SURE else "likely" if probability >= LIKELY else "uncertain"
    return f"{word} (probability {words.fixed(min(probability, SURE), 2)}{' or more' if probability >= SURE else ''})"


def in_shop_units(p: Estimate, shop: tuple[float, str] | None = None) -> str:
    """Return a fitted number with its uncertainty in units of the shop; as it is where there are none for it."""
    factor, unit = shop or SHOP_UNITS.get(p.unit, (0.0, ""))
    if not factor:
        return str(p)
    interval = p.interval and (p.interval[0] * factor, p.interval[1] * factor)
    return str(Estimate(p.value * factor, p.u * factor, unit, p.plausible, interval))


def _sizes(e: FoundEffect) -> tuple[str, ...]:
    if not e.parameters:
        return e.sizes
    cls = library().get(e.id)
    known = cls.parameters if cls is not None else {}
    texts = {n: (known[n].meaning, known[n].shop) if n in known else (n, None) for n in e.parameters}
    return tuple(f"{texts[n][0]}: {in_shop_units(p, texts[n][1])}" for n, p in e.parameters.items())


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
