"""From the search to the result: what a discovery hands out."""

from typing import Any

import numpy as np

from belt_sim.diagnosis.describe import label
from belt_sim.diagnosis.errors.model_errors import errors_of
from belt_sim.discovery.form_dictionary import travel_of, variable
from belt_sim.discovery.latent_input import LatentInput
from belt_sim.discovery.law_words import formula, looks_like, place_words, sentence
from belt_sim.discovery.march_fit import FEWEST, Estimates, MarchFit, SearchOutcome
from belt_sim.discovery.selection import LawChoice
from belt_sim.discovery.states import States
from belt_sim.effects.law import VARIABLES, Form
from belt_sim.effects.load import save_effects
from belt_sim.io import provenance
from belt_sim.results import words
from belt_sim.results.diagnosis import Discovery, Estimate, FoundLaw, LawPoints, PlaceEvidence, RivalLaw, UnknownCourse
from belt_sim.results.errors import Errors

KEPT = 120  # points of a curve against a variable, a tension
DRAWN = 600  # points of the law as a line
OTHERS = 2  # places that are told beside that of the law


def describe(found: SearchOutcome, probability: float, config: Any = None) -> Discovery:
    """What was discovered, as a result; probability: that something unknown is there."""
    s = found.data
    common: dict[str, Any] = {
        "base_model": s.bench.forward.model.name,
        "campaign": label(s.bench.campaign),
        "beside": tuple(s.fit.ids),
        "found": found.choice is not None,
        "probability": probability,
        "places": _places(found),
        "limits": limits(found),
        "provenance": provenance(config) | {"data_sha256": s.bench.campaign.sha256},
    }
    if found.choice is None:
        return Discovery(**common, sentence=_nothing_sentence(found, probability))
    stretch = found.best is not None and found.best.scored.law.terms[0].place.is_stretch
    common |= {"unit": "1", "courses": ()} if stretch else _drawn_input(found)
    if found.best is None:
        return Discovery(**common, sentence=_no_law_sentence(found))
    best, law = found.best, _law(found, found.choice, found.best)
    error = errors_of(s.bench, s.fit, best.bench, best.fit)
    fall = error.fit or error.held_out
    assert fall is not None  # a law is fitted to some runs
    said = sentence(s, best, law, fall, worse=worse_predictions(error)) + _other_places(found, best)
    points, curve = _law_points(found, best)
    return Discovery(
        **common,
        sentence=said,
        law=law,
        rivals=tuple(
            RivalLaw(formula=formula(c.scored.law), place=place_words(c.scored.law), less=c.less) for c in found.close
        ),
        against=points,
        curve=curve,
        error=error,
        law_file=_law_file(found, law.frequency, best, said, probability),
    )


def _other_places(found: SearchOutcome, best: MarchFit) -> str:
    """The places at which another law does as well: a torsion that creeps and a bending that creeps act alike through
    EI/T, and a soft joint is a wave of the yaw as long as the belt."""
    own = place_words(best.scored.law)
    others = dict.fromkeys(place_words(c.scored.law) for c in found.close)
    alike = [f"the {place}" for place in others if place != own][:OTHERS]
    return f" A law of {' or of '.join(alike)} fits these readings as well." if alike else ""


def limits(found: SearchOutcome) -> tuple[str, ...]:
    """What these runs cannot show, whatever is missing."""
    samples = found.data.bench.samples
    said = []
    if len(samples.runs) < FEWEST:
        said.append(f"fewer than {FEWEST} runs: no law is guessed; repeat the run, and run another tension and yaw")
    if len({r.tension for r in samples.runs}) == 1:
        said.append("one tension was run: how the unknown depends on tension cannot be known")
    if len({np.sign(r.yaw or r.yaw_head) for r in samples.runs}) == 1:
        said.append("one sign of yaw was run: whether the unknown is odd or even in yaw cannot be known")
    if len({abs(r.yaw or r.yaw_head) for r in samples.runs}) == 1:
        said.append("one size of yaw was run: powers of the yaw cannot be told apart")
    if len({r.speed for r in samples.runs}) == 1:
        said.append("one speed was run: travel cannot be told from time")
    if sum(s.kind == "lateral" for s in samples.signals) == 1:
        said.append("one sensor: an error of it cannot be told from a movement of the belt")
    acts = () if found.choice is None else found.best.scored.law.terms if found.best else (found.latent,)
    if any(t.place.kind == "turn" for t in acts):
        said.append("a turn of the belt at a run-up cannot be told from a sideways push on the span before it")
    return tuple(said)


def _nothing_sentence(found: SearchOutcome, probability: float) -> str:
    if len(found.data.bench.samples.runs) < FEWEST:
        return "Too few runs to say what is missing."
    return f"Nothing is missing that these readings show (probability of something unknown: {probability:.2g})."


def _no_law_sentence(found: SearchOutcome) -> str:
    c = found.latent
    pooled = "differs from run to run" if c.pool == "each run" else f"{c.pool} in yaw"
    return (
        f"Something acts on the {c.place.words} ({pooled}, changing over {c.length:.0f} m), "
        "and no law of one or two terms describes it and predicts the runs that are left out; u(travel) is shown."
    )


def _places(found: SearchOutcome) -> tuple[PlaceEvidence, ...]:
    best: dict[str, LatentInput] = {}
    for c in sorted((*found.latent_inputs, *([found.latent] if found.best else [])), key=lambda c: -c.gain):
        best.setdefault(c.place.name, c)
    return tuple(
        PlaceEvidence(place=c.place.name, words=c.place.words, pool=c.pool, gain=c.gain, length=float(c.length))
        for c in best.values()
    )


def _drawn_input(found: SearchOutcome) -> dict[str, Any]:
    """The unit and the courses of the latent input that is shown."""
    runs, latent = found.data.bench.samples.runs, found.latent
    told = []
    for weights, mean, sd in zip(latent.weights, latent.mean, latent.sd, strict=True):
        own = [r for r, w in zip(runs, weights, strict=True) if w]
        name = own[0].name if latent.pool == "each run" else f"{words.tension(own[0].tension)} N/mm²"
        name += "" if own[0].direction > 0 else ", reversed"
        told.append(UnknownCourse(label=name, tension=own[0].tension, travel=latent.knots, u=mean, sd=sd))
    return {"unit": latent.place.unit, "courses": tuple(sorted(told, key=lambda c: (c.tension, c.label)))}


def _law(found: SearchOutcome, choice: LawChoice, best: MarchFit) -> FoundLaw:
    law, numbers = best.scored.law, best.estimates()
    many = len({r.tension for r in found.data.bench.samples.runs}) > 1
    made = {n: Estimate(v, u, unit, True) for n, (v, u, unit) in numbers.items()}
    first = law.terms[0]
    return FoundLaw(
        formula=formula(law, numbers),
        place=place_words(law),
        variable=VARIABLES[first.form.variable][1],
        variable_unit=VARIABLES[first.form.variable][0],
        parity=law.parity,
        exponent=Estimate(*best.exponent, "1", True) if many else None,
        parameters=made,
        share=min(1.0, best.gain / max(choice.possible, 1e-9)),
        frequency=choice.frequency,
        looks_like=looks_like(found.data, law, numbers),
    )


def _law_points(found: SearchOutcome, best: MarchFit) -> tuple[tuple[LawPoints, ...], LawPoints | None]:
    """The unknown of the first term against its variable (travel, where it depends on travel alone), and the law."""
    s, term, latent = found.data, best.scored.law.terms[0], found.latent
    numbers, fitted, length = best.estimates(), best.fitted_law.terms[0].form, s.states.belt_length
    if term.place.is_stretch:
        line = np.linspace(0.0, length, DRAWN)
        return (), LawPoints(tension=0.0, x=line, u=_law_curve(fitted, numbers, length, line, by_travel=True))
    part, u = term.place.parts[0][1], latent.inputs(s.design.grid)
    slack = s.weight(numbers["exponent"][0])[:, None]
    by_travel = not term.form.reads_belt
    x = np.broadcast_to(_drawn_travel(s.states, term.form, part), u.shape)
    if not by_travel:
        x = variable(s.states, term.form.variable, part, term.place.parts[0][0])
    if term.form.variable == "sigma":
        slack = slack * term.form.shape_value(s.states.tension[:, None], None, np)
    if term.form.variable == "beta":
        slack = slack * s.states.beta
    elif not by_travel and term.form.course != "constant":
        along = travel_of(s.states, term.form, part) if term.form.is_carried else s.states.s[None]
        slack = slack * fitted.course_value(along, np)
    told = np.abs(slack) > 0.2 * np.abs(slack).max()
    reduced = np.where(told, u / np.where(told, slack, 1.0), np.nan)
    points = []
    for tension in np.unique(s.stated_tension):
        rows = s.stated_tension == tension
        px, pu = x[rows].ravel(), np.broadcast_to(reduced, u.shape)[rows].ravel()
        keep = np.flatnonzero(np.isfinite(pu))
        keep = keep[:: max(1, len(keep) // KEPT)]
        points.append(LawPoints(tension=float(tension), x=px[keep], u=pu[keep]))
    line = np.linspace(float(np.min(x)), float(np.max(x)), DRAWN)
    return tuple(points), LawPoints(tension=0.0, x=line, u=_law_curve(fitted, numbers, length, line, by_travel))


def _drawn_travel(states: States, form: Form, part: int | None) -> np.ndarray:
    """The travel that a law is drawn against: of what the belt carries the one of a forward run's first turn that
    brings the same part of the belt to the tail pulley."""
    return states.belt_length * (states.belt_part[:, part or 0] % 1.0) if form.is_carried else states.s


def _law_curve(form: Form, numbers: Estimates, length: float, line: np.ndarray, by_travel: bool) -> np.ndarray:
    """u of a law along ``line``; form: with its fitted numbers; length: of the belt [m]."""
    if form.is_wave:
        values = [half.course_value(line, np) for half in (form, form.sine())]
        return np.asarray(numbers["cos"][0] * values[0] + numbers["sin"][0] * values[1])
    s = line / length if form.is_carried else line
    return np.asarray(numbers["size"][0] * (form.course_value(s, np) if by_travel else form.shape_value(s, s, np)))


def worse_predictions(error: Errors) -> str:
    """Which runs that were left out a law predicts worse than none does; empty where it predicts none worse."""
    worse = [f"{n}: {words.thousandths(c.before)} to {words.thousandths(c.after)} mm" for n, c in error.worse().items()]
    if worse:
        return f"but left-out runs are predicted worse with it ({', '.join(worse)})"
    own = error.own
    if own is not None and own.after > max(own.before, own.floor):
        return "but left-out runs are predicted worse with it than without"
    return ""


def _law_file(found: SearchOutcome, frequency: float, best: MarchFit, said: str, probability: float) -> str:
    """The text of found_law.yaml, with the numbers of the march."""
    campaign = found.data.bench.campaign
    data = f"{campaign.title} ({len(campaign.runs)} runs"
    data += f", SHA-256 {campaign.sha256[:12]})" if campaign.sha256 else ")"
    beside = ", ".join(found.data.fit.ids) or f"the {found.data.bench.forward.model.name} model alone"
    sure = f"probability {probability:.3g}; first again in {frequency:.0%} of repetitions"
    spread = {name: u for name, (_, u, _) in best.estimates().items()}
    notes = (said, f"Found in: {data}, beside {beside}; {sure}.")
    return save_effects([best.fitted_effect], {best.effect.id: spread}, notes)
