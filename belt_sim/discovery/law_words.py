"""A law in words: its formula, what usually has such a law, and the sentence."""

import math
from typing import Any

import numpy as np

from belt_sim.discovery.form_dictionary import form_values
from belt_sim.discovery.march_fit import Estimates, MarchFit
from belt_sim.discovery.search_data import SearchData
from belt_sim.effects.law import ONE_SIDED, SPAN, STIFFNESS, TENSION, TRAVEL, VARIABLES, Law, Term, number_name
from belt_sim.results import words
from belt_sim.results.diagnosis import FoundLaw
from belt_sim.results.errors import Change
from belt_sim.units import N_PER_MM2, shop_unit

MOST = 5  # tensions that are told
SLIGHT = 1e-3  # relative change that is none
KNOWN = 2.0  # sigma from zero, below which a size is not known by itself
PLAIN = ("constant", "rise", "decay", "step", "interval")  # courses without a unit
NEAR = 0.01  # of a wavelength, within which it is called that of a machine part
SYMBOLS = {
    "none": "",
    "yaw_set": "",
    "sigma": "σ",
    "beta": "β",
    "y": "y",
    "alpha": "α",
    "kappa": "κ",
    "kappa_mean": "κ̄",
    "reading": "y",
    "reading_rate": "dy/dt",
}


def place_words(law: Law) -> str:
    """The places at which a law acts, in words."""
    return words.join_words(list(dict.fromkeys(t.place.words for t in law.terms)))


def formula(law: Law, numbers: Estimates | None = None) -> str:
    """A law as people write it, with its numbers where there are any."""
    return " and ".join(_term(t, k, numbers or {}) for k, t in enumerate(law.terms))


def _term(t: Term, k: int, numbers: Estimates) -> str:
    x, form = SYMBOLS[t.form.variable], t.form

    def number(name: str, fallback: float | None, unit: str) -> str:
        if number_name(name, k) in numbers:
            value, u, _ = numbers[number_name(name, k)]
            return words.with_u(value, u, unit)
        return f"{words.number(fallback)} {unit}".strip()

    knee = number("knee", form.knee, VARIABLES[form.variable][0] if form.variable not in ("none", "yaw_set") else "")
    if form.variable == "sigma":
        knee = f"{numbers.get(number_name('knee', k), (form.knee or 0.0,))[0] / N_PER_MM2:.3g} N/mm²"
    unit = "s" if form.timed else "" if form.is_carried else "m"
    at, wide = number("at", form.at, unit), number("wide", form.wide, unit)
    s = ("t" if form.timed else "s") + "′" * (x == "" and form.variable == "yaw_set")
    shape = {
        "linear": x,
        "signed_square": f"{x}|{x}|",
        "square": f"{x}²",
        "cube": f"{x}³",
        "saturation": f"{x}, saturating at {knee}",
        "stick": f"what of {x} is stuck within ±{knee}",
        "dead_zone": f"the part of {x} beyond ±{knee}",
        "magnitude": f"|{x}|",
        "magnitude_beyond": f"the part of |{x}| beyond {knee}",
        "positive": f"where {x} is above 0 (by {knee} and more)",
        "negative": f"where {x} is below 0 (by {knee} and more)",
        "below": f"(1 − {x}/({knee})) below {knee}",
        "above": f"({x}/({knee}) − 1) above {knee}",
    }[form.shape]
    course = {
        "constant": "",
        "linear": s,
        "quadratic": f"{s}²",
        "square_root": f"√{s}",
        "rise": f"(1 − exp(−{s}/({at})))",
        "decay": f"exp(−{s}/({at}))",
        "step": f"after {at}",
        "interval": f"from {at} on for {wide}",
        "belt_section": f"once a revolution on {wide} of the belt",
        "wave": f"a wave of {at}",
        "decaying_wave": f"a wave of {at} that fades over {wide}",
    }[form.course]
    parts = [p for p in (shape, course) if p] or ["a step" if form.variable == "yaw_set" else "a constant"]
    return f"{_size(t, k, numbers)}{' '.join(parts)}{_power(t, k, numbers)}"


def _power(t: Term, k: int, numbers: Estimates) -> str:
    """The power of the tension with which a term goes; empty where it does not."""
    value, u, _ = numbers.get(number_name("exponent", k), (t.exponent, 0.0, "1"))
    if not value:
        return ""
    return f" × tension^{words.number(value, 2) if not u else f'({words.with_u(value, u)})'}"


def _size(t: Term, k: int, numbers: Estimates) -> str:
    """The size of a term, before its shape; empty where nothing has been fitted."""
    if number_name("size", k) in numbers:
        value, u, _ = numbers[number_name("size", k)]
        return f"{_size_words(value, u, t.size_unit)} × "
    if number_name("cos", k) in numbers:
        (c, u, _), (s, v, _) = numbers[number_name("cos", k)], numbers[number_name("sin", k)]
        return f"{_size_words(math.hypot(c, s), math.hypot(u, v) / math.sqrt(2.0), t.place.unit)} × "
    return ""


def _size_words(value: float, u: float, unit: str) -> str:
    """A size ± u in units of the shop, in brackets."""
    factor, shown = shop_unit(unit)
    text = words.with_u(factor * value, factor * u)
    return f"{text if text.startswith('(') else f'({text})'} {shown}".rstrip()


def looks_like(data: SearchData, law: Law, numbers: Estimates) -> str:
    """What kind of thing usually has such a law.

    What has not begun to settle when the record ends has no time constant, and is no creep.
    """
    t = law.terms[0]
    if rate := _steady_rate(data, t, numbers):
        return f"{_part_of_machine(t.place.kind)} that drifts at a steady rate of {rate}"
    kind, v, shape, course = t.place.kind, t.form.variable, t.form.shape, t.form.course
    if t.place.kind in STIFFNESS:
        return _stiffness(t)
    if course == "decaying_wave":
        return "something that swings out after a step"
    if course == "belt_section":
        return "a stretch of the belt that is unlike the rest: greasy, worn or mended"
    if course == "wave":
        return _wave(data, float(t.form.at or 0.0))
    if v in ("none", "yaw_set"):
        when = "it was changed in the run"
        if course == "constant":
            when = "it is off all along"
        elif course in ("linear", "quadratic", "square_root", "rise"):
            when = "it warms up or settles"
        return f"{_part_of_machine(kind)}: {when}"
    if kind == "sensor":
        return (
            "a sensor that answers late"
            if v == "reading_rate"
            else "a sensor that sticks"
            if shape == "stick"
            else "a sensor whose scale is not straight"
        )
    if v == "beta":
        return "creep or play of the yaw drive"
    if v == "y":
        return "a pulley whose radius varies across the belt, as a crown does"
    grip = "the grip of belt and pulley"
    if shape in ("saturation", "dead_zone"):
        return f"{grip}: play, or a limit of what it holds"
    return f"{grip}, which changes in the run" if course != "constant" else f"{grip}, as soft covers and slip have it"


def _part_of_machine(kind: str) -> str:
    """What it is that changes at a kind of place."""
    thing = {"sensor": "a sensor or its stand", "yaw": "the stand of a pulley"}
    thing |= {TENSION: "the tension", TRAVEL: "the encoder or its wheel", SPAN: "what touches a span"}
    return (thing | dict.fromkeys(STIFFNESS, "a belt")).get(kind, "the surface of a pulley")


def _steady_rate(data: SearchData, t: Term, numbers: Estimates) -> str:
    """The rate at which a term of time alone, or of the yaw, grows all along the record; empty where it does not."""
    if t.form.variable not in ("none", "yaw_set", "beta") or "size" not in numbers or t.form.timed:
        return ""
    at = numbers.get("at", (0.0,))[0]
    if t.form.course != "linear" and not (t.form.course == "rise" and at > float(data.states.s[-1])):
        return ""
    rate = numbers["size"][0] / (1.0 if t.form.course == "linear" else at)
    unit = "1" if t.form.variable == "beta" and t.place.unit == "rad" else t.place.unit
    per = " per rad of yaw" if t.form.variable == "beta" and unit != "1" else ""
    return f"{words.number(abs(rate), 2)} {f'{unit} per m' if unit != '1' else 'per m'}{per}"


def _stiffness(t: Term) -> str:
    """What changes how easily a span bends or twists, or how hard it is pulled."""
    if t.form.course in ("belt_section", "wave"):
        return "a stretch of the belt that is softer or stiffer than the rest: a joint, a repair, cracked edges"
    if t.place.kind == "pull":
        return "something between the pulleys that carries part of the pull: a support, a scraper, a bearing"
    if t.form.course != "constant":
        return "a belt that warms up, settles or cracks"
    if t.form.variable in ("y", "kappa", "kappa_mean"):
        if t.form.shape in ONE_SIDED:
            return "an edge that is cracked, or touches something, so that the belt is weaker to one side"
        return "edges that go slack, or touch something, where the belt goes far"
    return "a cross-section unlike the sheet's: residual stress, curl, worn or cracked edges"


def _wave(data: SearchData, at: float) -> str:
    rig = data.bench.samples.cases.rig
    parts = {
        "one turn of the tail pulley": 2.0 * math.pi * float(rig.tail_radius),
        "one turn of the head pulley": 2.0 * math.pi * float(rig.head_radius),
        "one revolution of the belt": float(rig.belt_length),
        "half a revolution of the belt": float(rig.belt_length) / 2.0,
    }
    for name, length in parts.items():
        if abs(at / length - 1.0) < NEAR:
            return f"something that comes once in {name}"
    return "something that repeats, but with no part of the machine that the sheet knows"


def sentence(data: SearchData, made: MarchFit, law: FoundLaw, rms: Change, *, worse: str = "") -> str:
    """The law in sentences: place, terms with all numbers, parity, tension, by how much the error falls, what it looks
    like; worse: what it predicts worse than no law does.
    """
    said = _place_and_terms(data, made)
    numbers = made.estimates()
    said += _section_middles(made.scored.law, numbers) + _known_products(made, numbers)
    said += f"; {law.parity} in yaw" if law.parity != "mixed" else "; neither odd nor even in yaw"
    value, u = made.exponent
    powers = [numbers[n][0] for n in ("exponent", "exponent_2") if n in numbers]
    if u > 0.0 and not powers[0]:
        known = abs(value) < 2.0 * u and u < 0.4
        said += f"; {'no dependence on' if known else 'may depend on'} tension (exponent {words.with_u(value, u)})"
    if any(powers):
        said += f"; sizes hold at {words.tension(data.tension)} N/mm²"
    said += f". With it the rms error falls from {words.thousandths(rms.before)} to {words.thousandths(rms.after)} mm"
    said += f"; {worse}" if worse else ""
    return f"{said}. It looks like {law.looks_like}." if law.looks_like else f"{said}."


def _place_and_terms(data: SearchData, made: MarchFit) -> str:
    law, numbers = made.scored.law, made.estimates()
    if law.terms[0].place.is_stretch and len(law.terms) == 1:
        return f"A stretch of the belt {_as_belt(data, law.terms[0], numbers)}: {formula(law, numbers)}"
    of_stiffness = law.terms[0].place.kind in STIFFNESS and not law.terms[0].place.is_stretch
    if len({t.place.name for t in law.terms}) == 1 and of_stiffness:
        how = _by_how_much(data, law, numbers)
        return f"The {law.terms[0].place.words} is {how}: relative change {formula(law, numbers)}"
    return f"The {place_words(law)} lacks {formula(law, numbers)}"


def _as_belt(data: SearchData, term: Term, numbers: Estimates) -> str:
    """How a stretch of another stiffness differs, as so much more or less belt would."""
    size, u, _ = numbers["size"]
    length = float(data.bench.samples.cases.rig.span_length)
    more = "more" if size < 0.0 else "less"
    does = "twists" if term.place.relative == "torsion" else "bends"
    return f"{does} {more} easily, as with {words.with_u(length * abs(size), length * u, 'm')} {more} of belt in it"


def _by_how_much(data: SearchData, law: Law, numbers: Estimates) -> str:
    """By how much a stiffness is lower or higher than in the model, at every tension (five at most)."""
    change = _change(data, law, numbers)
    steady = all(t.form.course == "constant" and t.form.variable in ("none", "sigma") for t in law.terms)
    tensions = np.unique(data.stated_tension)
    some = tensions[np.unique(np.linspace(0, len(tensions) - 1, MOST).round().astype(int))]
    found = []
    for tension in some:
        rows = change[data.stated_tension == tension]
        found.append(float(rows.ravel()[np.argmax(np.abs(rows))]))
    signs = {x > 0.0 for x in found if abs(x) > SLIGHT}
    up_to = "" if steady else "up to "
    if len(signs) == 1:
        direction = "higher" if signs.pop() else "lower"
        by = [f"{100 * abs(x):.2g} % at {words.tension(t)} N/mm²" for x, t in zip(found, some, strict=True)]
        return f"{direction} than in the model by {up_to}{', '.join(by)}"
    by = [f"{up_to}{'+' if x > 0.0 else '−'}{100 * abs(x):.2g} % at {words.tension(t)} N/mm²"
          for x, t in zip(found, some, strict=True)]  # fmt: skip
    return f"another than in the model: {', '.join(by)}"


def _change(data: SearchData, law: Law, numbers: Estimates) -> np.ndarray:
    """The relative change (R, J) that a law of a stiffness is, at the pulley where it is the larger."""
    found: list[np.ndarray] = []
    for part in (0, 1):
        total: Any = 0.0
        for k, t in enumerate(law.with_numbers({name: value for name, (value, *_) in numbers.items()}).terms):
            halves = [("cos", t.form), ("sin", t.form.sine())] if t.form.is_wave else [("size", t.form)]
            own = sum(numbers[number_name(n, k)][0] * form_values(f, data.states, part, None) for n, f in halves)
            total = total + own * data.weight(t.exponent)[:, None]
        found.append(np.asarray(total))
    return np.maximum(np.where(np.abs(found[0]) >= np.abs(found[1]), *found), -1.0)


def _section_middles(law: Law, numbers: Estimates) -> str:
    """Where on the belt the stretches of a law are, to be found there; empty where it has none."""
    said = ""
    for k, t in enumerate(law.terms):
        if t.form.is_carried:
            value, u, _ = numbers[number_name("at", k)]
            said += f"; the middle of the stretch runs up the tail pulley {words.with_u(value % 1.0, u)} "
            said += "belt lengths after the start of a forward run"
    return said


def _known_products(made: MarchFit, numbers: Estimates) -> str:
    """Size times knee of terms of which the readings know no more; empty where they know the size too."""
    said = ""
    for k, t in enumerate(made.scored.law.terms):
        if t.form.shape == "saturation" and t.form.course in PLAIN:
            size, u, _ = numbers[number_name("size", k)]
            if abs(size) < KNOWN * u:
                product = words.with_u(*made.size_times_knee(k), t.place.unit)
                said += f"; of its size and its knee only the product is known: {product}"
    return said
