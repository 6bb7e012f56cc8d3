"""The report of a diagnosis: one HTML page that needs nothing but a browser, with the pictures of the run's folder as
SVG in the colours of the page (light or dark). The words of an effect stand in its class (Effect.cause)."""

import csv
import datetime
import math
import re
import string
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.campaign.types import PLACES
from belt_sim.effects.base import library, title_of
from belt_sim.results import words
from belt_sim.results.diagnosis import (
    LIKELY_FROM,
    SOMETHING_UNKNOWN,
    WRONG_MODEL,
    Candidate,
    Diagnosis,
    FoundEffect,
    Verdict,
)
from belt_sim.results.errors import Errors, OwnChange
from belt_sim.results.estimates import Estimate, MachineSizes, number_texts
from belt_sim.results.files import DIAGNOSIS
from belt_sim.show.diagnosis import shown_panels
from belt_sim.show.style import AMBER, BLUE, CYCLE, FAINT_INK, GREEN, GRID, INK, PAPER, PINK, RED
from belt_sim.units import DEGREE

HERE = Path(__file__).parent
#: how often named effects were right in blind tests, by the probability said (docs/data/how_often_right_record.md)
BLIND_TESTS = HERE / "blind_tests.csv"


def environment() -> Any:
    """Return what fills the templates of this folder."""
    from jinja2 import Environment, FileSystemLoader

    made = Environment(loader=FileSystemLoader(HERE), autoescape=True, trim_blocks=True, lstrip_blocks=True)
    made.globals["points"] = [at for place, at in SENSOR_SPOTS.items() if place.startswith("point")]
    return made


def render(d: Diagnosis, pictures: Mapping[str, str] | None = None) -> str:
    """Return the whole page as text. It forbids itself the network; pictures: SVG text by kind, as of
    ``api.plot.report_pictures``."""
    page = environment()
    page.filters.update(number=words.number, milli=words.thousandths)
    page.filters.update(tenths=lambda gain: words.number(gain, 1 if gain is not None and gain < 100.0 else 3))
    page.filters.update(inline=inline_svg, rows=words.rows, capital=words.capital)
    found = d.discovery if d.discovery is not None and d.discovery.found else None
    rivals, cards = rival_cards(d), [plant_card(e, d.drawings.machine, d.asked_for) for e in d.effects]
    certain = [c for c in cards if not rivals or c["id"] in d.certain_effects]
    panels = shown_panels(d.drawings.overlays) if pictures and "overlay" in pictures else ()
    # of the sketch: where the named effects are, else where the unknown acts
    marked = [part for c in (*rivals, *certain) for part in c["parts"]]
    if not marked and found and found.law is not None:
        marked = [part for word, part in PLACE_PARTS.items() if word in found.law.place]
    alternatives = [other for c in certain for other in c["others"]]
    for letter, other in zip(string.ascii_lowercase, alternatives, strict=False):
        other["letter"] = letter
    numbered = [*((str(k), c) for k, c in enumerate(rivals, start=1)), *((o["letter"], o) for o in alternatives)]
    # of the pictures, the run and signal that is called the worst is shown first, else the largest misfit
    first, worst = max(range(len(panels)), key=lambda k: panels[k].misfit, default=0), d.where.worst
    for k, p in reversed(list(enumerate(panels))):
        if worst is not None and p.run == worst.run and worst.signal in p.title.split(",")[0].split():
            first = k
    nowhere = d.where.sentence.startswith("Nowhere")  # no single run, signal and stretch is beyond its uncertainty
    together = "No single stretch is beyond its uncertainty: only all runs together show the misfit. "
    together = together if nowhere and d.verdict is not Verdict.ADEQUATE else ""
    text = page.get_template("report.html.j2").render(
        d=d,
        schema=DIAGNOSIS,
        degree=DEGREE,
        today=f"{datetime.date.today():%d %B %Y}".lstrip("0"),
        tone="partly" if d.headline != d.verdict.headline else d.verdict.value,
        lead=plant_headline(d, certain, rivals),
        cards=certain,
        rivals=rivals,
        many=words.count(len(rivals)),
        marked=list(dict.fromkeys(marked)),
        **sketch_numbers([*numbered, *(("", c) for c in certain)]),
        alternatives=alternatives,
        pictures=pictures or {},
        boxes=re.findall('data-box="([^"]*)"', pictures["overlay"]) if pictures and panels else [],
        panels=panels,
        first=first,
        bars=bars(d.ranking),
        falls=falls(d.error),
        discovery=found,
        numbers=lambda effect, numbers: number_texts(effect, numbers, d.drawings.machine),
        where=f"{together}{d.where.sentence}",
        fails=not nowhere,
    )
    return words.in_print(text)


#: where the sensors of each place stand on the sketch
SENSOR_SPOTS = dict(zip(PLACES, [(520, 36), (520, 144), (120, 144), (120, 36), (320, 36), (320, 124)], strict=False))
SENSORS_ABOVE = tuple(float(SENSOR_SPOTS[f"point_{k}"][0]) for k in (4, 1))  # where their names stand above the span
NUMBER_ROOM = 16.0  # of the sketch, between two numbers side by side
#: where a number stands on a part of the sketch
PART_SPOTS = {"head": (100, 90), "encoder": (100, 90), "tail": (540, 90), "tensioner": (605, 112), "belt": (52, 90)}
PART_SPOTS |= {"upper": (230, 50), "lower": (230, 130), "sensors": (162, 36), "unknown": (270, 175)}


def sketch_numbers(cards: Sequence[tuple[str, Mapping[str, Any]]]) -> dict[str, list[tuple[Any, ...]]]:
    """Where the numbers of explanations, and letters of alternatives, stand on the sketch: marks (share of the span, x
    of the number, numbers, words) of each place of a span; spots (x, y, number) at parts."""
    there: dict[tuple[int, int], list[str]] = {}
    places: dict[tuple[float, str], list[str]] = {}  # explanations that act at one place of a span
    for number, c in cards:
        for share, place in c["marks"]:
            places.setdefault((round(share, 3), place), []).append(number)
        parts = c["parts"] or (["unknown"] if c["id"] else [])  # something unknown acts who knows where
        for spot in dict.fromkeys(PART_SPOTS[part] for part in parts if number and (part != "upper" or not c["marks"])):
            there.setdefault(spot, []).append(number)
    taken, marks = list(SENSORS_ABOVE), []
    for (share, place), numbers in sorted(places.items()):
        number = ", ".join(filter(None, numbers))
        x, room = 100.0 + 440.0 * share, NUMBER_ROOM * max(1.0, len(number) / 2.0)
        while number and (near := [other for other in taken if abs(other - x) < 0.99 * room]):
            x = max(near) + room
        taken += [x] if number else []
        marks.append((share, x, number, place))
    begins = {(x, y): x - 12.0 * (len(numbers) - 1) for (x, y), numbers in there.items()}
    spots = [(begins[at] + 24.0 * k, at[1], n) for at, numbers in there.items() for k, n in enumerate(numbers)]
    return {"marks": marks, "spots": spots}


#: colours of pictures -> of the page, light or dark
PAGE_COLOURS = {INK: "--ink", FAINT_INK: "--faint", GRID: "--line", RED: "--before", BLUE: "--after", GREEN: "--c3"}
PAGE_COLOURS |= {AMBER: "--c2", PINK: "--c5", CYCLE[6]: "--c6", PAPER: "--paper"}


def inline_svg(svg: str) -> Any:
    """Return a picture as part of the page: its colours are the page's, and no name occurs twice in it."""
    from markupsafe import Markup

    body = svg[svg.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    body = re.sub(r'(<svg[^>]*?) width="[^"]*" height="[^"]*"|(<svg[^>]*?) height="[^"]*" width="[^"]*"', r"\1\2", body)
    body = re.sub(r' id="[a-zA-Z0-9.]+_\d+"', "", body).replace('id="title"', 'class="headline"')
    for colour, name in PAGE_COLOURS.items():
        body = body.replace(colour, f"var({name})")
    return Markup(re.sub(r"\s*\n\s*", " ", body))


#: parts of the sketch by words that the place of an unknown is called with
PLACE_PARTS = {"tail": "tail", "head": "head", "upper": "upper", "lower": "lower", "sensor": "sensors", "span": "upper"}


def falls(error: Errors) -> list[dict]:
    """The error before and after, over all and by held-out condition: lengths [%] on one linear scale, and values."""
    own = "unseen runs, after correcting sensor zero and settings"
    there = ({own: error.own} if error.own is not None else {}) | error.rows()
    tested = [c for n, c in there.items() if "not testable" not in n]
    values = [v for change in tested for v in (change.before, change.after) if np.isfinite(v)]
    full = max([error.noise_floor, *values, 1e-12])
    shown = []
    for name, change in there.items():
        floor = change.floor if isinstance(change, OwnChange) else error.noise_floor
        shares = [v / full if np.isfinite(v) else 0.0 for v in (change.before, change.after, floor)]
        lengths = [round(100.0 * min(share, 1.0), 1) for share in shares]
        shown.append({"label": name, "change": change, **dict(zip(("before", "after", "floor"), lengths, strict=True))})
    return shown


def bars(ranking: Sequence[Candidate]) -> list[dict]:
    """Lengths [%] of the gains and of chance on one scale, log2(1 + gain / threshold)."""
    ratios = [max(c.gain, 0.0) / c.threshold if c.threshold else 0.0 for c in ranking]
    full = float(np.log2(1.0 + max([1.0, *ratios])))
    lengths = [(ratio, round(100.0 * float(np.log2(1.0 + ratio)) / full, 1)) for ratio in ratios]
    return [{"length": length, "chance": round(100.0 / full, 1), "beyond_chance": r > 1.0} for r, length in lengths]


EITHER = "tail or head"
#: parts of the sketch by the law that an effect of one's own changes
PARTS_OF_LAW: dict[str, tuple[str, ...]] = {"span": ("upper", "lower"), "drive": ("tail",), "sensor": ("sensors",)}
PARTS_OF_LAW |= dict.fromkeys(("run-up", "wrap"), ("tail", "head"))


def rival_cards(d: Diagnosis) -> list[dict[str, Any]]:
    """A card for each of several explanations that these runs cannot tell apart; none where one is likely."""
    machine, named, cards = d.drawings.machine, {e.id: e.parameters for e in d.effects}, []
    for rival in d.tied:
        own = [i for i in rival.effects if i != SOMETHING_UNKNOWN]
        single = [effect_card(i, rival.sizes.get(i) or named.get(i, {}), machine) for i in own]
        if not single:
            fault = "something acts that the catalogue does not have" if rival.effects else "there is nothing more"
            single = [dict.fromkeys(("parts", "sizes", "marks"), ()) | {"fault": fault, "about": "", "check": ""}]
        card: dict[str, Any] = {name: [x for c in single for x in c[name]] for name in ("parts", "sizes", "marks")}
        card |= {name: " ".join(c[name] for c in single) for name in ("about", "check")}
        card |= {"id": " + ".join(rival.effects), "fault": " and ".join(c["fault"] for c in single)}
        card |= {"sure": sureness(rival.probability, d.asked_for), "unsure": True, "stamp": ""}
        cards.append(card | {"of_model": all(c.get("of_model", False) for c in single)})
    return cards


def plant_card(e: FoundEffect, machine: MachineSizes | None = None, asked_for: int | None = None) -> dict[str, Any]:
    """Return the card of a named effect for people at the machine; see ``effect_card``. sure: how often such answers
    were right; unsure: marked as such; others: what it may be instead, lettered on the sketch."""
    card, others = effect_card(e.id, e.told, machine, e.by_explanation or (e.parameters,)), []
    where = " and pulley" if card["many_pulleys"] else ""
    differs = (f"size{where} not reliable: the explanations differ by so much",) if e.told != e.parameters else ()
    for ids in e.confusable_with:  # what each may be, and at which parts of the sketch
        each = [effect_card(one, {}, machine) for one in ids]
        said = " and ".join(c["fault"] for c in each)
        parts = [part for c in each for part in c["parts"]]
        others.append({"id": " + ".join(ids), "fault": said, "parts": parts, "marks": [], "letter": ""})
    return card | {
        "sizes": (*card["sizes"], *differs) if card["sizes"] else e.sizes_on(None),
        "sure": sureness(e.probability, asked_for),
        "unsure": e.probability < LIKELY_FROM,
        "others": others,
        "stamp": e.stamp,
    }


def effect_card(
    effect: str,
    numbers: Mapping[str, Estimate],
    machine: MachineSizes | None,
    explanations: Sequence[Mapping[str, Estimate]] = (),
) -> dict[str, Any]:
    """Return what a card says of an effect of such numbers; explanations: its numbers in each of several, if there are.

    fault: the clause of the headline; parts: ids of the sketch; marks: places on it (share of the span from the head
    pulley, words); sizes: a line a number; many_pulleys: whether explanations have it at different ones.
    """
    cls = library().get(effect)
    cause, known = (cls.cause, cls.parameters) if cls is not None else (None, {})
    pulleys = set()  # that it is at, by the larger of its fitted numbers
    for row in filter(None, explanations or (numbers,)):
        sure = {n: abs(p.value) / p.u if p.u > 0 else math.inf for n, p in row.items()}
        pulleys.add("head" if max(sure, key=sure.__getitem__).endswith("_head") else "tail")
    pulley = next(iter(pulleys)) if len(pulleys) == 1 else None
    texts, sizes, marks = number_texts(effect, numbers, machine), [], []
    for n, text in texts.items():
        meaning = known[n].meaning if n in known else n
        if machine is not None and meaning.startswith("share of the span's length"):
            meaning = "distance from the head pulley"
            if cause is None or "upper" in cause.parts:  # where the sketch marks places
                marks.append((min(max(numbers[n].value, 0.0), 1.0), text.split(" ")[0] + " m"))
        sizes.append(f"{meaning}: {text}")
    parts = cause.parts if cause else PARTS_OF_LAW.get(getattr(cls, "law", ""), ())
    return {
        "id": effect,
        "fault": cause.phrase.format(pulley=pulley or EITHER) if cause else f"the effect {effect} acts",
        "about": title_of(cls) if cls is not None else f"The effect {effect} of your own",
        "parts": (pulley,) if pulley and set(parts) >= {"tail", "head"} else parts,
        "marks": marks,
        "sizes": tuple(sizes),
        "check": cause.check.format(pulley=pulley or EITHER) if cause else "See the effect's own file.",
        "of_model": bool(cause and cause.of_model),
        "many_pulleys": len(pulleys) > 1,
    }


def sureness(probability: float, asked_for: int | None = None) -> str:
    """Return a probability in words, with how often such answers were right in blind tests; asked_for: the number of
    candidates where they were cut, of which no blind test tells."""
    with BLIND_TESTS.open(encoding="utf-8") as table:
        rows = [(float(low), *map(int, counts)) for low, _, *counts in list(csv.reader(table))[1:]]
    low, right, of, in_span, of_span = [row for row in rows if row[0] <= max(round(probability, 2), 0.0)][-1]
    word = "nearly certain" if low >= 0.99 else "likely" if low >= LIKELY_FROM else "uncertain"
    share = f"{100.0 * min(probability, 0.99):.0f} %" + (" or more" if low >= 0.99 else "")
    if asked_for:
        effects = "one effect that was" if asked_for == 1 else f"{asked_for} effects that were"
        return f"{word} ({share}), of the {effects} asked for"
    said = f"{word} ({share}): {right} of {of} such answers were right in blind tests"
    unlike = f", {in_span} of {of_span} where a span had changed in a way the library lacks"
    return said + (unlike if of_span and low >= LIKELY_FROM else "")


def plant_headline(d: Diagnosis, cards: Sequence[dict[str, Any]], rivals: Sequence[dict[str, Any]] = ()) -> str:
    """Return what is wrong, in one sentence of the plant; rivals: of which these runs cannot say which it is."""
    if d.verdict is Verdict.CANNOT_SAY:
        cause = "These readings are too few to show a fault"
        if any(s.severity == "stop" for s in d.suspicions):
            cause = "The data look damaged, or the sheet is wrong"
        return f"{cause}, so nothing can be said of the machine yet"
    at_machine = [c["fault"] for c in cards if not c["of_model"] and not c["unsure"]]
    perhaps = [c["fault"] for c in cards if not c["of_model"] and c["unsure"]]
    left_out = [c["fault"] for c in cards if c["of_model"]]
    said = [f"Most likely {words.join_words(at_machine)}"] if at_machine else []
    said += [f"Perhaps {'also ' if said else ''}{words.join_words(perhaps)}"] if perhaps else []
    if left_out and said:
        said.append(f"Besides, {words.join_words(left_out)}, which the model leaves out")
    elif left_out:
        none = [] if rivals else ["The machine shows no fault"]
        said += [*none, f"The model leaves out that {words.join_words(left_out)}"]
    if rivals:
        besides = [f"Besides, {one[:1].lower()}{one[1:]}" for one in said[:1]]
        return ". ".join([f"One of {words.count(len(rivals))}; these runs cannot say which", *besides, *said[1:]])
    if said:
        return ". ".join([*said, *(["Something unknown acts as well"] if d.verdict is Verdict.PARTLY else [])])
    if d.verdict is Verdict.ADEQUATE:
        sure = d.headline == d.verdict.headline
        return "No fault shows: the belt moves as the model says" if sure else f"No fault is certain. {d.sentence}"
    if d.headline == WRONG_MODEL:
        return f"{d.headline}: {d.sentence.rstrip('.')}"
    said = ["Something moves the belt that no known cause alone explains"]
    if any(s.kind == "sheet" for s in d.suspicions):
        said.append("Check the data sheet first: a mistake there may explain it")
    return ". ".join(said)
