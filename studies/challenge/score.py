"""One campaign, scored: the truth beside the answer, as fields that can be counted."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from enum import StrEnum
from typing import Any

from belt_sim.units import MM
from belt_sim.virtual_rig.hidden import LOOKALIKE_REMAINDER

#: what the finder calls a place -> what the generator does; {} is tail, head or both
_PLACES = {
    "yaw of": "yaw_{}",
    "turn of the belt": "runup_{}",
    "sideways drift": "runup_{}",
    "sideways shift": "wrap",
    "twist over": "wrap",
    "bend of": "span",
    "bending stiffness": "span_bending",
    "torsional stiffness": "span_torsion",
    "tension of one span": "span_tension",
    "tension of": "tension",
    "travel that": "travel",
    "readings of all": "sensor_all",
    "reading of": "sensor",
}
_NAMES = {"span": "span", "yaw": "yaw_{}", "turn": "runup_{}", "drift": "runup_{}", "shift": "wrap", "twist": "wrap"}
_NAMES |= {"bending": "span_bending", "torsion": "span_torsion", "pull": "span_tension"}
#: sign in a formula -> variable of the generator, the first that is there
_VARIABLES = (("σ", "tension"), ("β", "yaw"), ("κ", "curvature"), ("α", "contact_angle"), ("dy/dt", "y"), ("y", "y"))
#: mark of a shape in a formula -> form
_SHAPES = (
    ("saturating", "saturating"),
    ("beyond", "threshold"),
    ("below", "threshold"),
    ("above", "threshold"),
    ("stuck", "threshold"),
    ("|", "power"),
    ("²", "power"),
    ("³", "power"),
)
#: mark of a course along the travel -> forms that it may be called, the first that is there
_COURSES = (
    ("once a revolution", ("periodic",)),
    ("that fades", ("periodic", "exponential")),
    ("a wave of", ("periodic",)),
    ("a step", ("threshold", "constant")),
    ("(1 − exp(", ("exponential", "saturating")),
    ("exp(", ("exponential",)),
    ("after ", ("threshold", "saturating")),
    ("s²", ("power",)),
    ("√s", ("power", "saturating", "exponential")),
)
_TRAVEL = re.compile(r"(^|[ )])s$")
#: travel since the yaw was set, or time: courses all the same
_CLOCK = re.compile(r"(?<![a-z])[st]′|(?<![a-z])t(?=[²/]|$)")
#: What pushes sideways at a span acts on the march through the curvature at its run-up and nowhere else, so that these
#: places are the same to readings of y
SPAN = {"runup_tail", "runup_head", "runup_both"}
_WAVES = ("wave", "belt_phase", "pulley_phase", "travel")
CERTAIN = 2.0  # sigma
_ALONG = ("travel", "time_since_step")


def place_right(truth: Mapping[str, Any], said: Mapping[str, Any]) -> bool:
    """Whether a discovery has the generator's place, as its own or among what it cannot tell from it."""
    laws = [said["law"], *said.get("rivals", ())] if said.get("law") else said.get("places", [])[:1]
    texts = [text for one in laws for text in one["place"].split(" and ")]
    places = {generator_place(text) for text in (*texts, *said.get("alike", ()))}
    true = {truth["place"]}
    if truth["place"] == "span":
        true |= SPAN
    sensors = {one["place"] for one in said.get("places", ()) if one["place"].startswith("sensor_")}
    if truth["place"].startswith("sensor_") and (truth["place"] != "sensor_all" or len(sensors) == 1):
        true.add("sensor")  # the generator counts sensors, the finder calls them by their names
    return bool(places & true)


def generator_place(text: str) -> str:
    """A place of the finder, in words or by its short name, in the generator's words."""
    where = next((p for p in ("tail", "head", "both") if p in text), "tail")
    for begin, name in _PLACES.items():
        if text.startswith(begin):
            return name.format(where)
    kind, _, which = text.partition("_")
    if kind == "sensor":
        return "sensor_all" if which == "all" else "sensor"
    return _NAMES.get(kind, text).format(where)


def law_right(truth: Mapping[str, Any], said: Mapping[str, Any]) -> bool:
    """Whether one of the pairs (variable, form) that the law or its rivals can be called by is the generator's.

    Neither's words were written with the other's in sight. What the answer cannot tell from its law counts as said.
    """
    if not said.get("law"):
        return False
    true = {(truth["variable"], truth["form"]), *(tuple(pair) for pair in truth.get("also", ()))}
    formulas = [law["formula"] for law in (said["law"], *said.get("rivals", ()))]
    called = {pair for formula in formulas for term in formula.split(" and ") for pair in pairs(term)}
    terms = said["law"]["formula"].split(" and ")
    if any(term.partition(" × tension^")[0].endswith("a constant") for term in terms):  # along every run
        called |= tension_pairs(said["law"].get("exponent"))
    return bool(called & true)


def tension_pairs(exponent: Mapping[str, float] | None) -> set[tuple[str, str]]:
    """What a constant can be called that goes with a power of the tension, known within u."""
    if not exponent or abs(exponent["value"]) < CERTAIN * exponent["u"]:
        return set()
    linear = abs(exponent["value"] - 1.0) < CERTAIN * exponent["u"]
    return {("tension", "power")} | ({("tension", "linear")} if linear else set())


def pairs(term: str) -> set[tuple[str, str]]:
    """(variable, form) that one term of a formula can be called by: size × shape of a variable, course × tension^n."""
    body = _CLOCK.sub("s", term.partition(" × tension^")[0].rpartition(" × ")[2])
    variable = next((name for sign, name in _VARIABLES if sign in body), "")
    course = next((forms for mark, forms in _COURSES if mark in body), ("linear",) if _TRAVEL.search(body) else ())
    found = {(v, form) for form in course for v in (_WAVES if form == "periodic" else _ALONG)}
    found |= {("time_since_step", "periodic")} if "that fades" in body else set()
    if variable:
        shape = next((form for mark, form in _SHAPES if mark in body), "linear")
        return found | {(variable, form) for form in (shape, *course)}
    return found or {("travel", "constant")}


SURE = 0.9  # probability from which a name is said with confidence
NAMING = ("explained", "partly")
#: an error is reducible where the held-out error exceeds the noise floor by this factor
REDUCIBLE = 1.1
STOPS = "cannot_say"
CRASH = "crash"  # in place of what could not be worked out
MOST_REASONS = 3


class HeldBack(StrEnum):
    """Why a hidden effect was flagged as unknown and not named, the weightiest first."""

    NO_CANDIDATE = "it is no candidate"
    NOT_VISIBLE = "the readings cannot show it"
    BELOW_THRESHOLD = "it is below its threshold"
    IMPLAUSIBLE = "its value is taken for implausible"
    REST_FAILS = "what is left fails with it"


@dataclass(frozen=True, kw_only=True)
class ScoredCase:
    """One campaign, scored.

    kind: of the truth, or not_drawn where the generator failed; d: sizes of what is
    hidden; distance: of what is outside the library, after the best known effects, or after those that were named where
    these leave less; unknown: its place, variable and
    form; named: effect -> probability; aliases: effect -> sets of effects that the answer says it cannot be told from;
    outcome: see ``outcome_of``; covered: for each true parameter of a rightly named effect, whether it
    lies in its 95 % interval; removed: share of the reducible held-out error; advice: whether the advised run told the
    pair apart (None: not followed), promised: by so many sigma it was to; place, law: whether a discovered law has the
    right place, variable and form (None: nothing to compare); p: of what is left, by chance; why: what went wrong,
    empty when nothing did; held_back: why what is hidden was flagged and not named.
    """

    seed: int
    source: str
    kind: str
    plan: str = ""
    base: str = ""
    hidden: list[str] = field(default_factory=list)
    d: list[float | None] = field(default_factory=list)
    lookalikes: list[str] = field(default_factory=list)
    distance: float | None = None
    unknown: list[str] = field(default_factory=list)
    dirt: str | None = None
    verdict: str = ""
    named: dict[str, float] = field(default_factory=dict)
    aliases: dict[str, list[tuple[str, ...]]] = field(default_factory=dict)
    outcome: str = ""
    suspected: list[str] = field(default_factory=list)
    caught: bool = False
    covered: list[bool] = field(default_factory=list)
    removed: float | None = None
    advice: bool | None = None
    promised: float | None = None
    discovered: str | None = None
    place: bool | None = None
    law: bool | None = None
    p: float | None = None
    seconds: float | None = None
    sentence: str = ""
    why: str = ""
    held_back: HeldBack | None = None

    @property
    def size(self) -> float | None:
        """d of the smallest hidden effect; None where it was not measured."""
        return min((d for d in self.d if d is not None), default=None)

    @property
    def right(self) -> bool:
        """Everything hidden was named, and nothing else, up to aliases that the answer declares."""
        return self.outcome in ("right", "alias")

    @property
    def answer_set(self) -> set[str]:
        """What was named, with everything that the answer says it could be instead."""
        return set(self.named).union(*(alias for aliases in self.aliases.values() for alias in aliases))

    @property
    def told_by_an_alias(self) -> bool:
        """Whether one set that the answer says it cannot tell from its own is what is hidden, neither more nor less."""
        sets = (set(self.named) - {name} | set(alias) for name, aliases in self.aliases.items() for alias in aliases)
        return any(one == set(self.hidden) for one in sets)

    @property
    def false_names(self) -> dict[str, float]:
        """Effects that were named, and neither are hidden nor declared to be like a hidden one -> probability."""
        return {n: p for n, p in self.named.items() if n not in self.hidden and not self._stands_for(n)}

    def _stands_for(self, name: str) -> list[str]:
        """Hidden effects that a name may stand for: declared aliases that were not named themselves, or all at once."""
        aliases = self.aliases.get(name, [])
        if any(len(alias) > 1 and set(alias) == set(self.hidden) for alias in aliases):
            return self.hidden
        return [h for h in self.hidden if h not in self.named and (h,) in aliases]

    def row(self) -> dict[str, Any]:
        """As JSON, without what is empty."""
        content = {k: v for k, v in asdict(self).items() if v not in (None, [], {}, "")}
        if self.aliases:
            content["aliases"] = {name: [list(alias) for alias in sets] for name, sets in self.aliases.items()}
        return content | ({"held_back": self.held_back.name} if self.held_back else {})

    @classmethod
    def from_row(cls, row: Mapping[str, Any]) -> "ScoredCase":
        """From JSON; in files of version 0.1 the effects of one set are joined in one text."""
        aliases = {name: [_as_set(alias) for alias in sets] for name, sets in row.get("aliases", {}).items()}
        held = {"held_back": HeldBack[row["held_back"]]} if "held_back" in row else {}
        return cls(**{**row, "aliases": aliases, **held})


def _as_set(alias: str | Sequence[str]) -> tuple[str, ...]:
    return tuple(alias.split(" + ") if isinstance(alias, str) else alias)


def score_case(result: Mapping[str, Any]) -> ScoredCase:
    """The facts of a result."""
    truth, answer = result["truth"], result["answer"]
    known = {"seed": result["seed"], "source": result["source"], "seconds": result["seconds"].get("answer")}
    if truth is None:
        return ScoredCase(
            **known, kind="not_drawn", verdict=answer["verdict"], outcome="crash", sentence=answer["sentence"]
        )
    effects, discovered, advice = answer["effects"], answer.get("discovery") or {}, result.get("advice") or {}
    stated, left = truth["distance"], result.get("left_by_named")  # the stated one is linear in the sizes of effects
    found = ScoredCase(
        **known,
        kind=kind_of(truth),
        plan=" ".join(str(truth.get("plan") or "").split()[:1]),
        base=truth["base"],
        hidden=[e["id"] for e in truth["effects"]],
        d=[_round(e.get("d")) for e in truth["effects"]],
        lookalikes=list(truth["lookalikes"]),
        distance=_round(min(stated, left) if isinstance(left, float) and stated is not None else stated),
        unknown=[truth[k] for k in ("place", "variable", "form")] if truth.get("place") else [],
        dirt=(truth["dirty"] or {}).get("kind"),
        verdict=answer["verdict"],
        named={e["id"]: round(e["probability"], 4) for e in effects},
        aliases={e["id"]: [_as_set(a) for a in e["confusable_with"]] for e in effects if e["confusable_with"]},
        suspected=sorted({s["kind"] for s in answer.get("suspicions", [])}),
        caught=damage_caught(truth, answer),
        removed=error_removed(error_of(answer), result.get("least")),
        advice=advice.get("resolved"),
        promised=_round(advice.get("sigma_after")),
        p=1.0 - discovered["probability"] if "probability" in discovered else discovered.get("p"),  # (earlier answers)
        sentence=answer.get("sentence", ""),
    )
    more = {"outcome": outcome_of(found), "covered": parameters_covered(truth, answer)} | discovery(truth, answer)
    scored = replace(found, **more)
    if scored.right:
        return scored
    held = held_back(scored, answer) if scored.outcome == "unnamed" else None
    return replace(scored, why=explain(scored, answer), held_back=held)


def kind_of(truth: Mapping[str, Any]) -> str:
    """The kind of truth; what was stated on purpose counts as what it is."""
    if truth["kind"] != "stated":
        return truth["kind"]
    return {0: "nothing", 1: "library"}.get(len(truth["effects"]), "two")


def outcome_of(f: ScoredCase) -> str:
    """What an answer is worth, in one word.

    right: what is hidden is named and nothing else (nothing hidden: adequate; outside: flagged as unknown without a
    false name; dirty: caught). alias: right up to aliases that the answer declares. missed: adequate. unnamed: flagged
    as unknown. part: something hidden is not named, though it may be told as what cannot be excluded. beside: a false
    name stands beside the true ones. lookalike: the generator itself cannot tell the name from the truth, but the
    answer does not say so. crash; otherwise wrong.
    """
    if f.verdict in ("crash", STOPS) and f.kind not in ("dirty", "mistake"):
        return "crash" if f.verdict == "crash" else "wrong"
    if f.kind in ("nothing", "below_noise") and f.verdict == "adequate":
        return "right"
    if f.kind == "nothing":
        return "wrong"
    if f.kind == "outside":
        if f.verdict == "adequate":
            return "missed"
        if f.verdict != "explained" and not f.false_names:
            return "right"
        return "lookalike" if f.named and f.distance is not None and f.distance < LOOKALIKE_REMAINDER else "wrong"
    if f.kind in ("dirty", "mistake"):
        return "crash" if f.verdict == "crash" else "right" if f.caught else "wrong"
    return _naming(f)


def _naming(f: ScoredCase) -> str:
    """Outcome where effects of the library are hidden."""
    if f.verdict not in NAMING:
        return "missed" if f.verdict == "adequate" else "unnamed"
    named, hidden = set(f.named), set(f.hidden)
    if named == hidden:
        return "right"
    if len(named) == len(hidden) and not f.false_names:
        return "alias"
    if named < hidden or f.told_by_an_alias:
        return "part"
    if named > hidden:
        return "beside"
    return "lookalike" if named and named <= hidden | set(f.lookalikes) else "wrong"


def damage_caught(truth: Mapping[str, Any], answer: Mapping[str, Any]) -> bool:
    """Whether damaged data were recognised: nothing is said of the model, or the damaged run and signal are named."""
    dirt = truth["dirty"]
    if not dirt or answer["verdict"] == "crash":
        return False
    if answer["verdict"] == STOPS:
        return True
    return any(
        s.get("run") in (None, dirt["run"]) and s.get("signal") in (None, dirt["signal"])
        for s in answer.get("suspicions", [])
    )


def parameters_covered(truth: Mapping[str, Any], answer: Mapping[str, Any]) -> list[bool]:
    """For each true parameter, whether the interval of the effect of its name holds it.

    Only where exactly the hidden effects are named and nothing is left: elsewhere values are effective ones.
    """
    found = {e["id"]: e["parameters"] for e in answer["effects"]}
    if answer["verdict"] != "explained" or set(found) != {e["id"] for e in truth["effects"]}:
        return []
    inside = []
    for effect in truth["effects"]:
        for name, true in effect["parameters"].items():
            estimate = found[effect["id"]].get(name)
            if estimate is not None:
                low, high = estimate["interval_95"]
                inside.append(bool(low <= true <= high))
    return inside


def error_removed(error: Mapping[str, Any] | None, least: Mapping[str, float] | None = None) -> float | None:
    """(before - after) / (before - least) of the held-out rms, in mm or m; None with nothing to remove.

    least: what a law that knows the truth would have left of these readings (oracle.py); where nobody worked that out
    it is the noise floor that the answer tells. All beside what every held-out run's own zero, gain and settings most
    likely are, where the answer tells that error: no effect can know those.
    """
    if not error or not error.get("held_out"):
        return None
    own = error.get("beside_settings") or error.get("own")  # as a set of effects tells it, or a discovered law
    told = own or error["held_out"]
    unit = "_mm" if "before_mm" in told else ""
    before, after = told[f"before{unit}"], told[f"after{unit}"]
    floor = next(d[k] for d in (told, error) for k in (f"noise_floor{unit}", "floor") if k in d)
    if least and CRASH not in least:
        floor = least["beside_settings_mm" if own else "plain_mm"] * (1.0 if unit else MM)
    if not before > REDUCIBLE * floor:
        return None
    return round(min(1.0, (before - after) / (before - floor)), 4)


def error_of(answer: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The error with everything that was found: effects, or else the discovered law."""
    said = answer.get("discovery") or {}
    return said["error"] if said.get("found") and said.get("error") else answer.get("error")


def discovery(truth: Mapping[str, Any], answer: Mapping[str, Any]) -> dict[str, Any]:
    """The law that the answer says it discovered, and whether place, and variable and form, are the true ones."""
    said = answer.get("discovery")
    if not said or not said.get("found"):
        return {}
    told = {"discovered": said["sentence"]}
    if not truth.get("place"):
        return told
    return told | {"place": place_right(truth, said), "law": law_right(truth, said)}


def _round(value: float | None) -> float | None:
    return None if value is None else round(float(value), 3)


def explain(case: ScoredCase, answer: Mapping[str, Any]) -> str:
    """Which hidden effect was held back by what, which false name got in with what, or the words of a crash."""
    if case.outcome == "crash":
        return case.sentence
    if case.verdict == STOPS:
        return f"suspects {', '.join(case.suspected) or 'damage'}"
    tried = {t["id"]: t for t in answer.get("ranking", [])}
    said = [_explain_one(name, tried.get(name)) for name in case.hidden if name not in case.named]
    said += [f"{name} at probability {sure:.2f}" for name, sure in case.false_names.items()]
    if case.kind in ("nothing", "below_noise") and not case.named:
        said.append(case.verdict)
    return "; ".join(said[:MOST_REASONS])


def held_back(case: ScoredCase, answer: Mapping[str, Any]) -> HeldBack:
    """What kept the hidden effects from being named; the weightiest reason of several."""
    tried = {t["id"]: t for t in answer.get("ranking", [])}
    found = {_held_back_by(tried.get(name)) for name in case.hidden if name not in case.named}
    return next((reason for reason in HeldBack if reason in found), HeldBack.REST_FAILS)


def _held_back_by(trial: Mapping[str, Any] | None) -> HeldBack:
    if trial is None:
        return HeldBack.NO_CANDIDATE
    if trial["threshold"] is None:
        return HeldBack.NOT_VISIBLE
    if trial["gain"] <= trial["threshold"]:
        return HeldBack.BELOW_THRESHOLD
    return HeldBack.REST_FAILS if trial["plausible"] else HeldBack.IMPLAUSIBLE


def _explain_one(name: str, trial: Mapping[str, Any] | None) -> str:
    """What the ranking says of an effect that is hidden and was not named."""
    reason = _held_back_by(trial)
    if trial is None or reason is HeldBack.NO_CANDIDATE:
        return f"{name} is no candidate"
    if reason is HeldBack.NOT_VISIBLE:
        return f"the readings cannot show {name}"
    if reason is HeldBack.BELOW_THRESHOLD:
        return f"{name}: gain {trial['gain']:.1f} under its threshold {trial['threshold']:.1f}"
    return f"{name}: gain {trial['gain']:.1f} over {trial['threshold']:.1f}, {trial['note']}"
