"""A found law in words: formula, sentence, and what usually has such a law."""

import math
from typing import Any

import numpy as np

from belt_sim.diagnosis.errors import errors_of
from belt_sim.discovery.linear_search import first_of_each
from belt_sim.discovery.search_data import SearchData, course_travel, form_inputs, variable
from belt_sim.discovery.selection import ROUND_SIGMAS, RUNS_OF_A_LAW, Estimates, LawChoice, MarchFit, SearchOutcome
from belt_sim.effects.law import ONE_SIDED, STIFFNESS, VARIABLES, Form, Law, number_name
from belt_sim.effects.load import save_effects
from belt_sim.io import provenance
from belt_sim.results import words
from belt_sim.results.diagnosis import Discovery, FoundLaw, LawPoints, PlaceEvidence, RivalLaw, UnknownCourse
from belt_sim.results.errors import CampaignLabel, Errors
from belt_sim.results.estimates import Estimate
from belt_sim.units import N_PER_MM2, shop_unit

# A law in words: its formula, what usually has such a law, and the sentence.


TENSIONS_TOLD = 5  # tensions that are told
SLIGHT = 1e-3  # relative change that is none
NEAR_WAVELENGTH = 0.01  # of a wavelength, within which it is called that of a machine part
#: shape in a formula; x: the sign of the variable
_SHAPES = {
    "linear": "{x}",
    "signed_square": "{x}|{x}|",
    "square": "{x}²",
    "cube": "{x}³",
    "saturation": "{x}, saturating at {knee}",
    "stick": "what of {x} is stuck within ±{knee}",
    "dead_zone": "the part of {x} beyond ±{knee}",
    "magnitude": "|{x}|",
    "magnitude_beyond": "the part of |{x}| beyond {knee}",
    "positive": "where {x} is above 0 (by {knee} and more)",
    "negative": "where {x} is below 0 (by {knee} and more)",
    "below": "(1 − {x}/({knee})) below {knee}",
    "above": "({x}/({knee}) − 1) above {knee}",
}
_COURSES = {
    "constant": "",
    "linear": "{s}",
    "quadratic": "{s}²",
    "square_root": "√{s}",
    "rise": "(1 − exp(−{s}/({at})))",
    "decay": "exp(−{s}/({at}))",
    "step": "after {at}",
    "interval": "from {at} on for {wide}",
    "belt_section": "once a revolution on {wide} of the belt",
    "wave": "a wave of {at}",
    "decaying_wave": "a wave of {at} that fades over {wide}",
}


def place_words(law: Law) -> str:
    """The places at which a law acts, in words."""
    return words.join_words(list(dict.fromkeys(t.place.words for t in law.terms)))


def formula(law: Law, numbers: Estimates | None = None) -> str:
    """A law as people write it, with its numbers where there are any."""
    numbers, terms = numbers or {}, []
    for k, t in enumerate(law.terms):
        x, form = VARIABLES[t.form.variable][2], t.form
        along = "s" if form.timed else "" if form.is_carried else "m"
        said = {"x": x, "s": ("t" if form.timed else "s") + "′" * (form.variable == "yaw_set")}
        for name, unit in (("knee", VARIABLES[form.variable][0] if x else ""), ("at", along), ("wide", along)):
            fitted = numbers.get(number_name(name, k))
            plain = f"{words.number(getattr(form, name))} {unit}".strip()
            said[name] = words.with_u(*fitted[:2], unit) if fitted else plain
        if form.variable == "sigma":
            said["knee"] = f"{numbers.get(number_name('knee', k), (form.knee or 0.0,))[0] / N_PER_MM2:.3g} N/mm²"
        parts = [p for p in (_SHAPES[form.shape].format(**said), _COURSES[form.course].format(**said)) if p]
        parts = parts or ["a step" if form.variable == "yaw_set" else "a constant"]
        value, u, _ = numbers.get(number_name("exponent", k), (t.exponent, 0.0, "1"))
        exponent = words.number(value, 2) if not u else f"({words.with_u(value, u)})"
        size = ""
        if sizes := [numbers[n][:2] for half in form.halves if (n := number_name(half, k)) in numbers]:  # of a wave two
            factor, shown = shop_unit(t.size_unit if len(sizes) == 1 else t.place.unit)
            high, own_u = (math.hypot(*(one[i] for one in sizes)) for i in (0, 1))
            high = sizes[0][0] if len(sizes) == 1 else high
            text = words.with_u(factor * high, factor * own_u / math.sqrt(len(sizes)))
            size = f"{text if text.startswith('(') else f'({text})'} {shown}".rstrip() + " × "
        terms.append(f"{size}{' '.join(parts)}{f' × tension^{exponent}' if value else ''}")
    return " and ".join(terms)


_MACHINE = {
    "sensor": "a sensor or its stand", "yaw": "the stand of a pulley", "tension": "the tension",
    "travel": "the encoder or its wheel", "span": "what touches a span", **dict.fromkeys(STIFFNESS, "a belt"),
}  # fmt: skip


def looks_like(data: SearchData, law: Law) -> str:
    """What kind of thing usually has such a law."""
    t = law.terms[0]
    kind, v, shape, course = t.place.kind, t.form.variable, t.form.shape, t.form.course
    part, alone = _MACHINE.get(kind, "the surface of a pulley"), v in ("none", "yaw_set")
    if kind in STIFFNESS:
        if course in ("belt_section", "wave"):
            return "a stretch of the belt that is softer or stiffer than the rest: a joint, a repair, cracked edges"
        if kind == "pull":
            return "something between the pulleys that carries part of the pull: a support, a scraper, a bearing"
        if course != "constant":
            return "a belt that warms up, settles or cracks"
        if shape in ONE_SIDED:
            return "an edge that is cracked, or touches something, so that the belt is weaker to one side"
        if v in ("y", "kappa", "kappa_mean"):
            return "edges that go slack, or touch something, where the belt goes far"
        return "a cross-section unlike the sheet's: residual stress, curl, worn or cracked edges"
    if course == "decaying_wave":
        return "something that swings out after a step"
    if course == "belt_section":
        return "a stretch of the belt that is unlike the rest: greasy, worn or mended"
    if course == "wave":
        rig, at = data.bench.samples.cases.rig, float(t.form.at or 0.0)
        lengths = {
            "one turn of the tail pulley": 2.0 * math.pi * float(rig.tail_radius),
            "one turn of the head pulley": 2.0 * math.pi * float(rig.head_radius),
            "one revolution of the belt": float(rig.belt_length),
            "half a revolution of the belt": float(rig.belt_length) / 2.0,
        }
        own = next((name for name, length in lengths.items() if abs(at / length - 1.0) < NEAR_WAVELENGTH), "")
        unknown = "something that repeats, but with no part of the machine that the sheet knows"
        return f"something that comes once in {own}" if own else unknown
    if alone:
        settles = "it warms up or settles" if course in ("linear", "quadratic", "square_root", "rise") else ""
        return f"{part}: {settles or ('it is off all along' if course == 'constant' else 'it was changed in the run')}"
    if kind == "sensor":
        fault = "that sticks" if shape == "stick" else "whose scale is not straight"
        return f"a sensor {'that answers late' if v == 'reading_rate' else fault}"
    if v in ("beta", "y"):
        crown = "a pulley whose radius varies across the belt, as a crown does"
        return crown if v == "y" else "creep or play of the yaw drive"
    grip = "the grip of belt and pulley"
    if shape in ("saturation", "dead_zone"):
        return f"{grip}: play, or a limit of what it holds"
    return f"{grip}, which changes in the run" if course != "constant" else f"{grip}, as soft covers and slip have it"


def sentence(data: SearchData, made: MarchFit, law: FoundLaw, error: Errors) -> str:
    """The law in sentences: place, terms with all numbers, parity, tension, by how much the error falls, which runs
    that were left out it predicts worse than none does, what it looks like."""
    law_found, numbers, place = made.scored.law, made.estimates(), made.scored.law.terms[0].place
    terms = formula(law_found, numbers)
    if place.is_stretch and len(law_found.terms) == 1:  # it differs as so much more or less belt would
        (size, u, _), length = numbers["size"], float(data.bench.samples.cases.rig.span_length)
        more, does = "more" if size < 0.0 else "less", "twists" if place.relative == "torsion" else "bends"
        so = f"as with {words.with_u(length * abs(size), length * u, 'm')} {more} of belt in it"
        said = f"A stretch of the belt {does} {more} easily, {so}: {terms}"
    elif len({t.place.name for t in law_found.terms}) == 1 and place.kind in STIFFNESS and not place.is_stretch:
        said = f"The {place.words} is {_by_how_much(data, law_found, numbers)}: relative change {terms}"
    else:
        several = len({t.place.words for t in law_found.terms}) > 1
        said = f"The {place_words(law_found)} {'lack' if several else 'lacks'} {terms}"
    for k, t in enumerate(law_found.terms):
        if t.form.is_carried:  # where on the belt its stretches are, to be found there
            at, u, _ = numbers[number_name("at", k)]
            said += f"; the middle of the stretch runs up the tail pulley {words.with_u(at % 1.0, u)} "
            said += "belt lengths after the start of a forward run"
    said += f"; {law.parity} in yaw" if law.parity != "mixed" else "; neither odd nor even in yaw"
    value, u = made.exponent
    powers = [numbers[n][0] for n in ("exponent", "exponent_2") if n in numbers]
    if u > 0.0 and not powers[0]:
        known = abs(value) < ROUND_SIGMAS * u and u < 0.4
        said += f"; {'no dependence on' if known else 'may depend on'} tension (exponent {words.with_u(value, u)})"
    elif abs(value) < ROUND_SIGMAS * u:  # as of a stiffness so high that more of it changes nothing
        said += f"; these runs do not tell that exponent from 0 ({words.with_u(value, u)})"
    said += f"; sizes hold at {data.tension / N_PER_MM2:g} N/mm²" if any(powers) else ""
    rms, own = error.fit or error.held_out, error.own
    assert rms is not None  # a law is fitted to some runs
    change = f"{words.thousandths(rms.before)} to {words.thousandths(rms.after)} mm"
    said += f". With it the rms error of fitted runs, sensor zero and settings as stated, falls from {change}"
    worse = [f"{n}: {words.thousandths(c.before)} to {words.thousandths(c.after)} mm" for n, c in error.worse().items()]
    if worse:
        said += f"; but left-out runs are predicted worse with it ({', '.join(worse)})"
    elif own is not None and own.after > max(own.before, own.floor):
        said += "; but left-out runs are predicted worse with it than without"
    return f"{said}. It looks like {law.looks_like}." if law.looks_like else f"{said}."


def _by_how_much(data: SearchData, law: Law, numbers: Estimates) -> str:
    """By how much a stiffness is lower or higher than in the model, at every tension (five at most)."""
    fitted = law.with_numbers({name: value for name, (value, *_) in numbers.items()})
    parts: list[Any] = [0.0, 0.0]
    for part in (0, 1):
        for k, t in enumerate(fitted.terms):
            values = form_inputs(data.states, [*t.form.halves.values()], part, None).swapaxes(0, 1)
            own = sum(numbers[number_name(n, k)][0] * x for n, x in zip(t.form.halves, values, strict=True))
            parts[part] = parts[part] + own * data.weight(t.exponent)[:, None]
    change = np.maximum(np.where(np.abs(parts[0]) >= np.abs(parts[1]), *parts), -1.0)  # (R, J), where it is the larger
    steady = all(t.form.course == "constant" and t.form.variable in ("none", "sigma") for t in law.terms)
    tensions = np.unique(data.stated_tension)
    some = tensions[np.unique(np.linspace(0, len(tensions) - 1, TENSIONS_TOLD).round().astype(int))]
    found = []
    for tension in some:
        rows = change[data.stated_tension == tension]
        found.append(float(rows.ravel()[np.argmax(np.abs(rows))]))
    signs, up_to = {x > 0.0 for x in found if abs(x) > SLIGHT}, "" if steady else "up to "
    # two digits, never an exponent: 0.0035, 19, 190
    by = [f"{float(f'{100.0 * abs(x):.2g}'):g} % at {t / N_PER_MM2:g} N/mm²" for x, t in zip(found, some, strict=True)]
    if len(signs) == 1:
        return f"{'higher' if signs.pop() else 'lower'} than in the model by {up_to}{', '.join(by)}"
    by = [f"{up_to}{'+' if x > 0.0 else '−'}{text}" for x, text in zip(found, by, strict=True)]
    return f"another than in the model: {', '.join(by)}"


# From the search to the result: what a discovery hands out.


CURVE_POINTS = 120  # points of a curve against a variable, a tension
LAW_POINTS = 600  # points of the law as a line
OTHERS = 2  # places that are told beside that of the law


def describe_discovery(found: SearchOutcome, probability: float, config: Any = None) -> Discovery:
    """What was discovered, as a result; probability: that something unknown is there."""
    s = found.data
    ranked = sorted((*found.latent_inputs, *([found.latent] if found.best else [])), key=lambda c: -c.gain)
    common: dict[str, Any] = {
        "base_model": s.bench.forward.model.name,
        "campaign": CampaignLabel.of(s.bench.campaign),
        "beside": tuple(s.fit.ids),
        "found": found.choice is not None,
        "probability": probability,
        "places": tuple(
            PlaceEvidence(place=c.place.name, words=c.place.words, pool=c.pool, gain=c.gain, length=float(c.length))
            for c in first_of_each(ranked, lambda c: c.place.name)
        ),
        "alike": tuple(p.words for p in found.alike),
        "limits": limits_of_law(found),
        "provenance": provenance(config) | {"data_sha256": s.bench.campaign.sha256},
    }
    if found.choice is None:
        said = "Too few runs to say what is missing."
        if len(s.bench.samples.runs) >= RUNS_OF_A_LAW:
            said = f"Nothing is missing that these readings show (probability of something unknown: {probability:.2g})."
        return Discovery(**common, sentence=said)
    common |= {"unit": "1", "courses": ()}
    if found.best is None or not found.best.scored.law.terms[0].place.is_stretch:
        latent, courses = found.latent, list[UnknownCourse]()
        for weights, mean, sd in zip(latent.weights, latent.mean, latent.sd, strict=True):
            own = next(r for r, w in zip(s.bench.samples.runs, weights, strict=True) if w)
            name = own.name if latent.pool == "each run" else f"{own.tension / N_PER_MM2:g} N/mm²"
            name += "" if own.direction > 0 else ", reversed"
            courses.append(UnknownCourse(label=name, tension=own.tension, travel=latent.knots, u=mean, sd=sd))
        ordered = tuple(sorted(courses, key=lambda c: (c.tension, c.label)))
        common |= {"unit": latent.place.unit, "courses": ordered}
    if found.best is None:
        c = found.latent
        pooled = "differs from run to run" if c.pool == "each run" else f"{c.pool} in yaw"
        said = (
            f"Something acts on the {c.place.words} ({pooled}, changing over {c.length:.0f} m), "
            "and no law of one or two terms describes it and predicts the runs that are left out; u(travel) is shown."
        )
        return Discovery(**common, sentence=said + _other_places(found, c.place.words))
    return Discovery(**common, **_law_fields(found, found.best, found.choice, probability))


def _law_fields(found: SearchOutcome, best: MarchFit, choice: LawChoice, probability: float) -> dict[str, Any]:
    """The fields of a Discovery that tell of the law."""
    s, law, numbers = found.data, best.scored.law, best.estimates()
    variable_unit, variable_name, _ = VARIABLES[law.terms[0].form.variable]
    told = FoundLaw(
        formula=formula(law, numbers),
        place=place_words(law),
        variable=variable_name,
        variable_unit=variable_unit,
        parity=law.parity,
        exponent=Estimate(*best.exponent, "1", True) if len(np.unique(s.stated_tension)) > 1 else None,
        parameters={n: Estimate(v, u, unit, True) for n, (v, u, unit) in numbers.items()},
        share=min(1.0, best.gain / max(choice.possible, 1e-9)),
        looks_like="" if found.alike else looks_like(s, law),  # no cause of what may act elsewhere
    )
    error = errors_of(s.bench, s.fit, best.bench, best.fit)
    said = sentence(s, best, told, error) + _other_places(found, place_words(law))
    # found_law.yaml, with the numbers of the march
    campaign = s.bench.campaign
    data = f"{campaign.title} ({len(campaign.runs)} runs"
    data += f", SHA-256 {campaign.sha256[:12]})" if campaign.sha256 else ")"
    beside = ", ".join(s.fit.ids) or f"the {s.bench.forward.model.name} model alone"
    source = f"Found in: {data}, beside {beside}; probability {probability:.3g}."
    made = best.effect(**{name: value for name, (value, _, _) in numbers.items()})
    of_numbers = {best.effect.id: {name: u for name, (_, u, _) in numbers.items()}}
    points, curve = _law_points(found, best)
    return {
        "sentence": said,
        "law": told,
        "rivals": tuple(
            RivalLaw(formula=formula(c.scored.law), place=place_words(c.scored.law), less=c.less) for c in found.close
        ),
        "against": points,
        "curve": curve,
        "error": error,
        "law_file": save_effects([made], of_numbers, (said, source)),
    }


def _other_places(found: SearchOutcome, told: str) -> str:
    """The places at which another law does as well, by the readings, and those of ``SearchOutcome.alike``."""
    fitted = dict.fromkeys(place_words(c.scored.law) for c in found.close)
    alike = dict.fromkeys(p.words for p in found.alike)
    fitting, acting = ([f"the {words}" for words in some if words != told] for some in (fitted, alike))
    acting = [words for words in acting if words not in fitting[:OTHERS]]
    said = f" A law of {' or of '.join(fitting[:OTHERS])} fits these readings as well." if fitting else ""
    if not acting:
        return said
    many = f"{len(acting)} other places fit" if len(acting) > 1 else "another place fits"
    first = "; the first are " if len(acting) > OTHERS else ": "
    return f"{said} These runs cannot say where it acts: {many} alike{first}{' and '.join(acting[:OTHERS])}."


def limits_of_law(found: SearchOutcome) -> tuple[str, ...]:
    """What these runs cannot show, whatever is missing."""
    samples = found.data.bench.samples
    said = []
    if len(samples.runs) < RUNS_OF_A_LAW:
        more = "repeat the run, and run another tension and yaw"
        said.append(f"fewer than {RUNS_OF_A_LAW} runs: no law is guessed; {more}")
    yaws = [r.yaw or r.yaw_head for r in samples.runs]
    alike = {
        "one tension was run: how the unknown depends on tension cannot be known": {r.tension for r in samples.runs},
        "one sign of yaw was run: whether the unknown is odd or even in yaw cannot be known": {*map(np.sign, yaws)},
        "one size of yaw was run: powers of the yaw cannot be told apart": {*map(abs, yaws)},
        "one speed was run: travel cannot be told from time": {r.speed for r in samples.runs},
    }
    said += [text for text, values in alike.items() if len(values) == 1]
    if sum(s.kind == "lateral" for s in samples.signals) == 1:
        said.append("one sensor: an error of it cannot be told from a movement of the belt")
    acts = () if found.choice is None else found.best.scored.law.terms if found.best else (found.latent,)
    if any(t.place.kind == "turn" for t in acts):
        said.append("a turn of the belt at a run-up cannot be told from a sideways push on the span before it")
    return tuple(said)


def _law_points(found: SearchOutcome, best: MarchFit) -> tuple[tuple[LawPoints, ...], LawPoints | None]:
    """The unknown of the first term against its variable (travel, where it depends on travel alone), and the law."""
    s, term, latent = found.data, best.scored.law.terms[0], found.latent
    numbers, length = best.estimates(), s.states.belt_length
    fitted = best.scored.law.with_numbers({name: value for name, (value, _, _) in numbers.items()}).terms[0].form
    if term.place.is_stretch:
        line = np.linspace(0.0, length, LAW_POINTS)
        return (), LawPoints(tension=0.0, x=line, u=_law_curve(fitted, numbers, length, line, by_travel=True))
    part, u = term.place.parts[0][1], latent.inputs(s.states.s)
    slack = s.weight(numbers["exponent"][0])[:, None]
    by_travel = not term.form.reads_belt
    carried, first_turn = term.form.is_carried, s.states.belt_length * (s.states.belt_part[:, part or 0] % 1.0)
    x = np.broadcast_to(first_turn if carried else s.states.s, u.shape)  # the travel at which a part is at the tail
    if not by_travel:
        x = variable(s.states, term.form.variable, part, term.place.parts[0][0])
    if term.form.variable == "sigma":
        slack = slack * term.form.shape_value(s.states.tension[:, None], None, np)
    if term.form.variable == "beta":
        slack = slack * s.states.beta
    elif not by_travel and term.form.course != "constant":
        along = course_travel(s.states, term.form, part) if term.form.is_carried else s.states.s[None]
        slack = slack * fitted.course_value(along, np)
    told = np.abs(slack) > 0.2 * np.abs(slack).max()
    reduced = np.where(told, u / np.where(told, slack, 1.0), np.nan)
    points = []
    for tension in np.unique(s.stated_tension):
        rows = s.stated_tension == tension
        px, pu = x[rows].ravel(), np.broadcast_to(reduced, u.shape)[rows].ravel()
        keep = np.flatnonzero(np.isfinite(pu))
        keep = keep[:: max(1, len(keep) // CURVE_POINTS)]
        points.append(LawPoints(tension=float(tension), x=px[keep], u=pu[keep]))
    line = np.linspace(float(np.min(x)), float(np.max(x)), LAW_POINTS)
    return tuple(points), LawPoints(tension=0.0, x=line, u=_law_curve(fitted, numbers, length, line, by_travel))


def _law_curve(form: Form, numbers: Estimates, length: float, line: np.ndarray, by_travel: bool) -> np.ndarray:
    """u of a law along ``line``; form: with its fitted numbers; length: of the belt [m]."""
    s = line / length if form.is_carried else line
    halves = {n: half.course_value(s, np) if by_travel or form.is_wave else half.shape_value(s, s, np)
              for n, half in form.halves.items()}  # fmt: skip
    return np.asarray(sum(numbers[n][0] * x for n, x in halves.items()))
