"""A law in words: formula, what it looks like, and the sentence."""

import math

from belt_sim.discovery.effect_file import parity, size_unit
from belt_sim.discovery.forms import UNITS
from belt_sim.discovery.places import SPAN, TENSION, TRAVEL
from belt_sim.discovery.refit import Refit
from belt_sim.discovery.survey import Law, Survey, Term
from belt_sim.results import words

KNOWN = 2.0  # sigma from zero, below which a size is not known by itself
PLAIN = ("always", "rise", "fade", "after", "during")  # courses without a unit
NEAR = 0.01  # of a wavelength, within which it is called that of a machine part
SYMBOLS = {"one": "", "set": "", "beta": "β", "y": "y", "alpha": "α", "kappa": "κ", "shown": "y", "rate": "dy/dt"}
CALLED = {
    "one": "travel alone",
    "set": "travel since the yaw was set",
    "beta": "the commanded yaw β",
    "y": "the belt's place y on the pulley",
    "alpha": "the contact angle α",
    "kappa": "the curvature κ at the run-up (the entry moment)",
    "shown": "the place y that the sensor sees",
    "rate": "the speed dy/dt that the sensor sees",
}


def formula(law: Law, numbers: dict[str, tuple[float, float, str]] | None = None) -> str:
    """A law as people write it, with its numbers where there are any."""
    return " and ".join(_term(t, "" if k == 0 else f"_{k + 1}", numbers) for k, t in enumerate(law.terms))


def _term(t: Term, tag: str, numbers) -> str:
    x, form = SYMBOLS[t.form.variable], t.form

    def number(name: str, fallback: float | None, unit: str) -> str:
        if numbers and f"{name}{tag}" in numbers:
            value, u, _ = numbers[f"{name}{tag}"]
            return words.with_u(value, u, unit)
        return f"{words.number(fallback)} {unit}".strip()

    knee = number("knee", form.knee, UNITS[form.variable] if form.variable not in ("one", "set") else "")
    unit = "s" if form.timed else "" if form.carried else "m"
    at, wide = number("at", form.at, unit), number("wide", form.wide, unit)
    s = ("t" if form.timed else "s") + "′" * (x == "" and form.variable == "set")
    shape = {
        "x": x,
        "x|x|": f"{x}|{x}|",
        "x^2": f"{x}²",
        "x^3": f"{x}³",
        "saturated": f"{x}, saturating at {knee}",
        "stuck": f"what of {x} is stuck within ±{knee}",
        "beyond": f"the part of {x} beyond ±{knee}",
    }[form.shape]
    course = {
        "always": "",
        "travel": s,
        "square": f"{s}²",
        "root": f"√{s}",
        "rise": f"(1 − exp(−{s}/({at})))",
        "fade": f"exp(−{s}/({at}))",
        "after": f"after {at}",
        "during": f"from {at} on for {wide}",
        "stretch": f"once a revolution on {wide} of the belt",
        "wave": f"a wave of {at}",
        "ring": f"a wave of {at} that fades over {wide}",
    }[form.course]
    parts = [p for p in (shape, course) if p] or ["a step" if form.variable == "set" else "a constant"]
    power = f" × tension^{t.exponent:.2g}" if not numbers and t.exponent else ""
    return f"{_size(t, tag, numbers or {})}{' '.join(parts)}{power}"


def _size(t: Term, tag: str, numbers) -> str:
    """The size of a term, before its shape; empty where nothing has been fitted."""
    if f"size{tag}" in numbers:
        value, u, _ = numbers[f"size{tag}"]
        unit = size_unit(t)
        return f"{_sized(value, u)} {'' if unit == '1' else unit + ' '}× "
    if f"cos{tag}" in numbers:
        (c, u, _), (s, v, _) = numbers[f"cos{tag}"], numbers[f"sin{tag}"]
        return f"{_sized(math.hypot(c, s), math.hypot(u, v) / math.sqrt(2.0))} {t.place.unit} × "
    return ""


def _sized(value: float, u: float) -> str:
    """A size ± u, in brackets."""
    text = words.with_u(value, u)
    return text if text.startswith("(") else f"({text})"


def looks_like(survey: Survey, law: Law) -> str:
    """What kind of thing usually has such a law; empty when nothing comes to mind."""
    t = law.terms[0]
    kind, v, shape, course = t.place.kind, t.form.variable, t.form.shape, t.form.course
    if course == "ring":
        return "something that swings out after a step"
    if course == "stretch":
        return "a stretch of the belt that is unlike the rest: greasy, worn or mended"
    if course == "wave":
        return _wave(survey, float(t.form.at or 0.0))
    if v in ("one", "set"):
        slow = (
            "it warms up or settles" if course in ("travel", "square", "root", "rise") else "it was changed in the run"
        )
        thing = {"sensor": "a sensor or its stand", "yaw": "the stand of a pulley"}
        thing |= {TENSION: "the tension", TRAVEL: "the encoder or its wheel", SPAN: "what touches a span"}
        return f"{thing.get(kind, 'the surface of a pulley')}: {slow}"
    if kind == "sensor":
        return (
            "a sensor that answers late"
            if v == "rate"
            else "a sensor that sticks"
            if shape == "stuck"
            else "a sensor whose scale is not straight"
        )
    if v == "beta":
        return "creep or play of the yaw drive"
    if v == "y":
        return "a pulley whose radius varies across the belt, as a crown does"
    grip = "the grip of belt and pulley"
    if shape in ("saturated", "beyond"):
        return f"{grip}: play, or a limit of what it holds"
    return f"{grip}, which changes in the run" if course != "always" else f"{grip}, as soft covers and slip have it"


def _wave(survey: Survey, at: float) -> str:
    rig = survey.bench.samples.cases.rig
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


def sentence(survey: Survey, refit: Refit, share: float, looks: str, *, alone: bool, carries: bool) -> str:
    """One sentence: place, law, numbers, parity, tension, share, whether it carries over to runs that it has not seen,
    what it looks like.
    """
    law, numbers = refit.scored.law, refit.estimates()
    places = words.listed(list(dict.fromkeys(t.place.words for t in law.terms)))
    said = f"The {places} lacks {formula(law, numbers)}"
    said += _middles(law, numbers) + _limits(refit, numbers)
    odd = parity(law)
    said += f"; {odd} in yaw" if odd != "mixed" else "; neither odd nor even in yaw"
    value, u = refit.exponent
    if u > 0.0:
        none = abs(value) < 2.0 * u and u < 0.4
        said += f"; {'no dependence on' if none else 'depends on'} tension (exponent {words.with_u(value, u)})"
    said += f"; explains {100.0 * share:.0f} % of what the base model leaves" if alone else \
        f"; explains {100.0 * share:.0f} % of what is left"  # fmt: skip
    if not carries:
        said += "; does not carry over: runs that were left out are predicted worse with it than without"
    return f"{said}; looks like {looks}." if looks else f"{said}."


def _middles(law: Law, numbers: dict[str, tuple[float, float, str]]) -> str:
    """Where on the belt the stretches of a law are, to be found there; empty where it has none."""
    said = ""
    for k, t in enumerate(law.terms):
        if t.form.carried:
            value, u, _ = numbers["at" if k == 0 else f"at_{k + 1}"]
            said += f"; the middle of the stretch runs up the tail pulley {words.with_u(value % 1.0, u)} "
            said += "belt lengths after the start of a forward run"
    return said


def _limits(refit: Refit, numbers: dict[str, tuple[float, float, str]]) -> str:
    """Size times knee of terms of which the readings know no more; empty where they know the size too."""
    said = ""
    for k, t in enumerate(refit.scored.law.terms):
        tag = "" if k == 0 else f"_{k + 1}"
        if t.form.shape == "saturated" and t.form.course in PLAIN:
            size, u, _ = numbers[f"size{tag}"]
            if abs(size) < KNOWN * u:
                product = words.with_u(*refit.limit(tag), t.place.unit)
                said += f"; of its size and its knee only the product is known: {product}"
    return said
