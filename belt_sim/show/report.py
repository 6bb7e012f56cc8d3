"""Write a diagnosis as one HTML page that needs nothing but a browser."""

import importlib.util
import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.effects.library import library, title_of
from belt_sim.errors import BeltError
from belt_sim.files import write_text
from belt_sim.results import words
from belt_sim.results.diagnosis import RESOLVED, Candidate, Diagnosis, FoundEffect, NextRun, Verdict, number_texts
from belt_sim.results.drawings import Panel
from belt_sim.results.errors import Errors, OwnChange
from belt_sim.results.json import DIAGNOSIS
from belt_sim.show import figures
from belt_sim.show.diagnosis import FULL

HERE = Path(__file__).parent
SHOWN_PLACES = 6


def write_report(path: str | os.PathLike, diagnosis: Diagnosis) -> Path:
    """Write ``path`` (.html) from a diagnosis and its drawings.

    The page holds plotly once and forbids itself the network (Content-Security-Policy). What the diagnosis does not
    have leaves its section out. Raises BeltError when the file cannot be written.
    """
    page = render(diagnosis)
    try:
        return write_text(Path(path), page)
    except OSError as cause:
        raise BeltError(f"report {path}: cannot be written ({cause.strerror}); choose another folder") from cause


def render(diagnosis: Diagnosis) -> str:
    import jinja2

    loader = jinja2.FileSystemLoader(HERE)
    page = jinja2.Environment(loader=loader, autoescape=True, undefined=jinja2.StrictUndefined)
    page.trim_blocks = page.lstrip_blocks = True
    page.filters.update(number=words.number, milli=words.thousandths, plain=words.plain, degrees=words.degrees)
    page.filters.update(tenths=lambda gain: words.decimal(gain, 1 if gain is not None and gain < 100.0 else 0))
    page.filters.update(listed=words.join_words, rows=words.rows, capital=lambda text: text[:1].upper() + text[1:])
    found = diagnosis.discovery if diagnosis.discovery is not None and diagnosis.discovery.found else None
    cards = [plant_card(e) for e in diagnosis.effects]
    return page.get_template("report.html.j2").render(
        d=diagnosis,
        schema=DIAGNOSIS,
        plots=_plots(diagnosis, found),
        bars=bars(diagnosis.ranking),
        falls=falls(diagnosis.error),
        discovery=found,
        weights=weights(found) if found else [],
        tensions=figures.tensions_of(found.courses or found.against) if found else [],
        colours=len(figures.CYCLE),
        place_note=place_note(found) if found else "",
        final=diagnosis.final_model != diagnosis.base_model,
        headline=headline(diagnosis),
        lead=plant_headline(diagnosis, cards),
        cards=cards,
        marked=marked_parts(cards, found),
        advice=run_advice,
        number_texts=number_texts,
        where=where_sentence(diagnosis),
        fails=not _fails_nowhere(diagnosis),
        full=f"{FULL:g}",
        plotly=_plotly(),
    )


def _plots(d: Diagnosis, found: Any) -> dict:
    """Every figure of the page, by the id of its place; ``overlays`` is a list to choose from."""
    law = [figures.course(found.courses, found.unit)] if found and found.courses else []
    return {
        "overlays": [figures.overlay(panel, d.base_model, d.final_model) for panel in d.drawings.overlays],
        "first": worst(d.drawings.overlays),
        "where": [figures.where(one) for one in d.drawings.maps],
        "drift": [figures.drift(*pair) for pair in d.drawings.drifts],
        "law": [*law, figures.law(found)] if found and found.against else law,
    }


def weights(found: Any) -> list[dict]:
    """Places of an unknown, best first: lengths [%] of their gains in log evidence."""
    best, chosen = found.places[:SHOWN_PLACES], found.law.place if found.law is not None else ""
    full = max([1e-9, *(p.gain for p in best)])
    shares = [(p, round(100.0 * max(p.gain, 0.0) / full, 1)) for p in best]
    return [{"words": p.words, "gain": p.gain, "length": share, "chosen": p.words in chosen} for p, share in shares]


def place_note(found: Any) -> str:
    """Why a law may stand at a place that these bars do not rank first; empty where it stands at the first, or is of a
    stretch of the belt, at which no smooth unknown was tried."""
    if found.law is None or not found.places or found.places[0].words in found.law.place or not found.courses:
        return ""
    return (
        f"A smooth unknown of any shape fits best at another place ({found.places[0].words}); the formula was sought "
        "at every place, and predicts best where it stands. Take the place as uncertain."
    )


#: parts of the sketch by words that the place of an unknown is called with
PLACE_PARTS = {"tail": "tail", "head": "head", "upper": "upper", "lower": "lower", "sensor": "sensors", "span": "upper"}


def marked_parts(cards: Sequence[dict[str, Any]], found: Any) -> list[str]:
    """Parts of the sketch that are marked: where the named effects are, else where the unknown acts."""
    parts = [part for c in cards for part in c["parts"]]
    if not parts and found and found.law is not None:
        parts = [part for word, part in PLACE_PARTS.items() if word in found.law.place]
    return list(dict.fromkeys(parts))


def _fails_nowhere(d: Diagnosis) -> bool:
    """Whether no single run, signal and stretch of travel is beyond the uncertainty."""
    return d.where.sentence.startswith("Nowhere")


def where_sentence(d: Diagnosis) -> str:
    """Where the base model fails; a misfit that only all runs together show is said to be that."""
    if not (_fails_nowhere(d) and d.verdict is not Verdict.ADEQUATE):
        return d.where.sentence
    return f"No single stretch is beyond its uncertainty: only all runs together show the misfit. {d.where.sentence}"


def headline(d: Diagnosis) -> str:
    """What that which was found did to the error, on held-out conditions where there are any."""
    change = d.error.own or d.error.held_out or d.error.fit
    if d.final_model == d.base_model or change is None:
        return "How large the error is"
    return "The error falls" if change.after < change.before else "The error does not fall"


def falls(error: Errors) -> list[dict]:
    """The error before and after, over all and by held-out condition: lengths [%] on one linear scale, and values."""
    rows = {"held out, zeros and settings taken off": error.own, "held out": error.held_out, "fitted": error.fit}
    there = {name: change for name, change in (rows | error.left_out()).items() if change is not None}
    values = [v for change in there.values() for v in (change.before, change.after) if np.isfinite(v)]
    full = max([error.noise_floor, *values, 1e-12])

    def length(value: float) -> float:
        return round(100.0 * value / full, 1) if np.isfinite(value) else 0.0

    floors = {name: c.floor if isinstance(c, OwnChange) else error.noise_floor for name, c in there.items()}
    return [
        {
            "label": name,
            "change": c,
            "before": length(c.before),
            "after": length(c.after),
            "floor": length(floors[name]),
        }
        for name, c in there.items()
    ]


def bars(ranking: Sequence[Candidate]) -> list[dict]:
    """Lengths [%] of the gains and of chance on one scale, log2(1 + gain / threshold)."""
    ratios = [max(c.gain, 0.0) / c.threshold if c.threshold else 0.0 for c in ranking]
    full = float(np.log2(1.0 + max([1.0, *ratios])))
    lengths = [(ratio, round(100.0 * float(np.log2(1.0 + ratio)) / full, 1)) for ratio in ratios]
    return [{"length": length, "chance": round(100.0 / full, 1), "beyond_chance": r > 1.0} for r, length in lengths]


def worst(panels: Sequence[Panel]) -> int:
    """The panel whose model before is farthest out of its band: the one to show first."""
    return max(range(len(panels)), key=lambda k: panels[k].misfit, default=0)


def _plotly() -> str:
    """plotly.js as the installed plotly package brings it (not imported: that takes a second)."""
    spec = importlib.util.find_spec("plotly")
    if spec is None or spec.origin is None:
        raise BeltError("report: plotly is not installed; run `make setup`")
    return (Path(spec.origin).parent / "package_data" / "plotly.min.js").read_text(encoding="utf-8")


# A diagnosis in the words of the plant: what is wrong, where on the machine, how large, how sure, what to check. The
# words of an effect stand in its class (Effect.cause).


EITHER = "tail or head"
SURE, LIKELY = 0.99, 0.9  # probabilities from which an explanation is called nearly certain, likely


#: parts of the sketch by the law that an effect of one's own changes
PARTS_OF_LAW = {
    "span": ("upper", "lower"),
    "run-up": ("tail", "head"),
    "wrap": ("tail", "head"),
    "drive": ("tail",),
    "sensor": ("sensors",),
}


def plant_card(e: FoundEffect) -> dict[str, Any]:
    """Return the card of a named effect for people at the machine.

    fault: the clause of the headline; about: what the effect is, from its own file; parts: ids of the sketch; sizes: a
    line a number; sure: how sure; unsure: marked as such; others: what it may be instead; check: what to do.
    """
    cls = library().get(e.id)
    cause = cls.cause if cls is not None else None
    pulley = _pulley(e)
    parts = cause.parts if cause else PARTS_OF_LAW.get(getattr(cls, "law", ""), ())
    return {
        "id": e.id,
        "fault": cause.phrase.format(pulley=pulley or EITHER) if cause else f"the effect {e.id} acts",
        "about": title_of(cls) if cls is not None else f"The effect {e.id} of your own",
        "parts": (pulley,) if pulley and set(parts) >= {"tail", "head"} else parts,
        "sizes": _sizes(e),
        "sure": sureness(e.probability),
        "unsure": e.probability < LIKELY,
        "others": [fault_of(ids) for ids in e.confusable_with],
        "check": cause.check.format(pulley=pulley or EITHER) if cause else "See the effect's own file.",
        "of_model": bool(cause and cause.of_model),
        "stamp": e.stamp,
    }


def fault_of(ids: Sequence[str]) -> str:
    """Return the faults of effects that act together, with their ids in brackets."""
    classes, name = [library().get(one) for one in ids], words.join_effects(ids)
    said = [c.cause.phrase.format(pulley=EITHER) for c in classes if c is not None and c.cause is not None]
    return f"{' and '.join(said)} ({name})" if said else name


def sureness(probability: float) -> str:
    """Return a probability in words, with the figure."""
    probability = round(probability, 2)
    word = "nearly certain" if probability >= SURE else "likely" if probability >= LIKELY else "uncertain"
    return f"{word} (probability {words.decimal(min(probability, SURE), 2)}{' or more' if probability >= SURE else ''})"


def _sizes(e: FoundEffect) -> tuple[str, ...]:
    if not e.parameters:
        return e.sizes
    cls = library().get(e.id)
    known = cls.parameters if cls is not None else {}
    texts = number_texts(e.id, e.parameters)
    return tuple(f"{known[n].meaning if n in known else n}: {text}" for n, text in texts.items())


def _pulley(e: FoundEffect) -> str | None:
    """Return the pulley that an effect is at, by the larger of its fitted numbers; None where none is fitted."""
    known = {n: abs(p.value) / p.u if p.u > 0 else math.inf for n, p in e.parameters.items()}
    if not known:
        return None
    return "head" if max(known, key=lambda n: known[n]).endswith("_head") else "tail"


def plant_headline(d: Diagnosis, cards: Sequence[dict[str, Any]]) -> str:
    """Return what is wrong, in one sentence of the plant."""
    if d.verdict is Verdict.CANNOT_SAY:
        wrong = any(s.severity == "stop" for s in d.suspicions)
        cause = (
            "The data look damaged, or the sheet is wrong" if wrong else "These readings are too few to show a fault"
        )
        return f"{cause}, so nothing can be said of the machine yet"
    at_machine = [c["fault"] for c in cards if not c["of_model"] and not c["unsure"]]
    perhaps = [c["fault"] for c in cards if not c["of_model"] and c["unsure"]]
    left_out = [c["fault"] for c in cards if c["of_model"]]
    said = [f"Most likely {words.join_words(at_machine)}"] if at_machine else []
    said += [f"Perhaps {'also ' if said else ''}{words.join_words(perhaps)}"] if perhaps else []
    if left_out:
        said += (
            [f"Besides, {words.join_words(left_out)}, which the model leaves out"]
            if said
            else ["The machine shows no fault", f"The model leaves out that {words.join_words(left_out)}"]
        )
    if said:
        return ". ".join([*said, *(["Something unknown acts as well"] if d.verdict is Verdict.PARTLY else [])])
    if d.verdict is Verdict.ADEQUATE:
        return "No fault shows: the belt moves as the model says"
    return "Something moves the belt that none of the known causes explains"


def run_advice(n: NextRun) -> str:
    """Return what a further run would tell; below 3 sigma that no single run tells it."""
    pair = " from ".join(n.separates)
    change = f"{words.decimal(n.sigma_before, 1)} → {words.decimal(n.sigma_after, 1)} sigma"
    if n.sigma_after < RESOLVED:
        return f"No single further run on this rig tells {pair}. The best would be: {n.action} ({change})."
    return f"{n.action[:1].upper()}{n.action[1:]}. It tells {pair} ({change})."
