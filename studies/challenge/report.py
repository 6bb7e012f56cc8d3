"""How often the diagnosis is right, written from the stored scores: a page for readers, and the full record.

The page (docs/how_often_right.md) counts the newest answers alone, its conclusion first. The record
(docs/data/how_often_right_record.md) has every campaign: targets, tables, failures.
"""

import json
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.io import ROOT, provenance, write_text
from belt_sim.results.words import join_words
from belt_sim.show import style
from belt_sim.show.report import BLIND_TESTS
from belt_sim.show.style import AFTER_COLOUR, FAINT_INK
from belt_sim.virtual_rig.hidden import LOOKALIKE_REMAINDER
from studies.challenge.registry import OWN
from studies.challenge.score import CRASH, STOPS, HeldBack, ScoredCase, score_case
from studies.challenge.targets import (
    GOOD_REMOVAL,
    SEEN,
    SIZES,
    Share,
    Target,
    confidently_wrong,
    of_kind,
    share_of,
    size_class,
    targets,
)

SCHEMA = "belt-challenge-facts/1"
SPACE, SPAN, PLANTS = "space", "span", ("plant", "plant_span")  # sources that are told by themselves
PICTURE = "challenge_reliability.png"
#: commits that decide alike: what cant and a yielding bearing do was mended between them and after the second
SAME_DECISION = ("5ef112bee7", "0428559535")
_SENTENCE = 160  # characters that are kept of an answer's sentence, of its law, and of why it is wrong
_LISTED = 12  # ranges of seeds that are listed one by one
_COMMON = 6  # so many of what is hidden are listed beside a cause
_VISIBLE = 4.5  # d: a smaller effect may be overlooked
_LEVELS = (0.01, 0.05, 0.1, 0.25, 0.5)
_EDGES = (0.0, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)  # of bins of probability
_DISTANCES = {"under 8": (0.0, 8.0), "8 - 12": (8.0, 12.0), "12 - 20": (12.0, 20.0), "20 and more": (20.0, np.inf)}
_FAR = 8.0  # distance from which a law is expected to be found

RECORD = Path("data") / "how_often_right_record.md"
_PAGE = """# How often the diagnosis is right

<!-- Written by `python -m studies.challenge count=0 publish=docs` (`make how_often_right`); do not edit. -->

{conclusion}

The present [decision](diagnosis.md) gave these figures.

## How this was measured

The virtual rig makes a campaign and [hides an effect](simulate.md#a-campaign-with-a-hidden-effect) in it. Its physics
is separate code. The truth is sealed with a SHA-256 hash before anyone answers.

- Every answered campaign counts, and a crash counts as wrong. Intervals are Wilson's, 95 %.
- The size d of a hidden effect is its distance from "nothing hidden" in units of noise, after what nuisance
  parameters can explain.
- The *distance* of an unknown effect is what the best three effects of the catalogue leave over of it.
- An alias counts as right if the answer itself says that the two cannot be told apart.
- Hidden `pulley_deflection` had a [wrong law](theory.md#bent-pulleys).

**No campaign comes from a real machine.** Noise, plausible sizes and kinds of faults are our assumptions ([how far to
believe each effect](how_far.md)).

## Targets

{targets}

## What a probability is worth

Names by probability, over all versions; in changed spans {spans_sure} from 99 % on.

![Probability said against share truly hidden](images/challenge_reliability.png)

{span}

{space}

{plants}

## The record

{{download}}`All campaigns of all versions <data/how_often_right_record.md>` has tables by size and by effect, and
every failure with its reason. `python -m studies.challenge count=40 first_seed=1000` answers new campaigns.
"""
_PAGE_SPAN = """## Changes inside a span

In {campaigns} further campaigns a span itself is another than the sheet says: its bending or twisting stiffness, or
its tension, goes with the tension, the time or its own bend. {outcomes}

{conclusion} The law has the right place in {place}, the right form in {form}.

Under 3 units of noise nobody can tell a name from the truth: with few tensions flatness, or a load cell that errs,
does what one change of a span does."""
_PAGE_SPACE = """## Measured on the 3D belt

In {campaigns} further campaigns the measurement comes from a belt in three dimensions. No span law is in
it. The machine is short.

{conclusion}"""
SET = 100_000  # seeds of one set of changed spans
APART = 3.0  # sigma, from which places can be told apart
_PAGE_PLANTS = """## As plants measure

Running belts, repeats that disagree, wrong sheets (`python -m studies.challenge source=plant first_seed={first}
count={many}`): told, tied or rightly silent in {told}; sure and wrong in {sure}.
Changed spans there (`source=plant_span first_seed={newest}`): place right or told as alike in {place},
where one was told in {of_told}; look-alikes named in {alike}. Only in
{apart} do laws at other places leave 3 sigma of the hidden change
(`python -m studies.challenge.places {newest} 40`)."""
_INTRO = """# How often the diagnosis is right: the record

Written by `python -m studies.challenge count=0 publish=docs` from the files in `studies/challenge/stored`; do not edit.

Every campaign is drawn by the virtual rig, whose code shares nothing with the fitter but the file format. The SHA-256
of its truth is written before anybody answers; the answer is made from the campaign's folder alone and kept; then the
truth is opened. All campaigns that were answered count; a crash is wrong. d is the size of what is hidden in units of
noise, after what nuisances can explain. Intervals are Wilson's, 95 %. An alias counts as right where the answer itself
says that the two cannot be told apart.

Campaigns with a hidden pulley_deflection were drawn and answered with a former law, a pulley that becomes hollow; a
pulley that bends keeps its radius ([Theory](../theory.md)). Their answers show that both codes agreed, not that the law
was right.
"""
_IN_SPAN = """## Campaigns of changed spans

A span itself is another than the sheet says. They are not in the figures above. The distance of a wrong name is what
it leaves of what is hidden, at its best numbers, by the generator's own laws (`studies/challenge/oracle.py`).
"""
_IN_SPACE = """## Campaigns of the 3D belt

Measured in three dimensions on a short rig (a = 2 m, five runs of 8 m, two sensors): membrane, pulleys and whatever is
hidden are geometry, friction or gravity of the scene, and no span law or effect is in it. Every twenty campaigns meet
each of fourteen faults once, and nothing six times. They are not in the figures above. The law and this belt differ by
0.3 % of a reading and 1.6 um, which these sensors hardly see (d = 1.6, `python -m studies.space_error`); the campaign's
file states it. In 8 m the belt goes round once and a half, so that a weld passes every pulley once or twice.
"""
_IN_PLANTS = """## Campaigns as plants measure

Belts 0.2 to 2 m wide on spans of 1 to 8 m, 3 to 12 runs, 2 to 4 sensors; records begin anywhere on the belt or on a
running one, repeats disagree, sheets are wrong; then changed spans on such plans. They are not in the figures above.
"""
_TARGETS = "## Targets\n\n{} campaigns.\n\n"
_WORTH = """## What probabilities are worth

![Probability said against share truly hidden](../images/{})
"""
_PAIRS = """## Two hidden effects

By what the best single effect of the generator's library leaves of both, in units of noise. Where that is less than 3 a
second effect lowers chi2 by 9 more than chance does at most; chance alone does as much, for one of thirty candidates,
in 1 - 0.9973^30 = 8 % of campaigns.

"""
_OUTSIDE = """## What is not in the library

The distance is what the best three effects of the library leave over of the hidden law, in units of noise. A place, and
a variable with its form, are right where the discovered law, or one that the answer cannot tell from it, has the
generator's; where no law is told they are wrong. The tables by form and law count distances of 8 and more.
"""
# ---- stored scores


@dataclass(frozen=True, kw_only=True)
class StoredScores:
    """One challenge: how it was run, and its scores."""

    about: dict[str, Any]
    cases: list[ScoredCase]

    @property
    def code(self) -> str:
        """Commits of the code that answered."""
        return ", ".join(c[:10] for c in self.about["commits"])

    @property
    def unanswered_seeds(self) -> list[int]:
        """Seeds between the first and the last that have no answer."""
        first, last = self.about["seeds"]
        return sorted(set(range(first, last + 1)) - {f.seed for f in self.cases})


def publish(results: Sequence[Mapping[str, Any]], top: Path, stored: Path, drawn: Sequence[int] = ()) -> Path:
    """Write ``stored``/NAME.json from results; write the page, the record and their pictures into ``top``.

    NAME is the source, its first seed and who answered: new results take the place of those of the same campaigns, and
    stand beside others, which are deleted by hand. drawn: seeds of all campaigns that were sealed, so that those
    without an answer are listed. Returns the record's path.
    """
    if results:
        first = min([r["seed"] for r in results] + list(drawn))
        name = f"{results[0]['source']}_{first}_{results[0]['ablation']}".replace(":", "_")
        write_text(stored / f"{name}.json", stored_text(results, drawn))
    every = read_stored(stored)
    write_page(top, every)
    return write_record(top, every)


def stored_text(results: Sequence[Mapping[str, Any]], drawn: Iterable[int] = ()) -> str:
    """Scores of results as JSON, a campaign a line, so that a change shows as one; drawn: seeds of campaigns that were
    sealed, answered or not."""
    results = sorted(results, key=lambda r: r["seed"])
    seeds = [*(r["seed"] for r in results), *drawn]
    about = {name: results[0][name] for name in ("source", "ablation", "bootstraps")}
    about |= {"seeds": [min(seeds), max(seeds)], "campaigns": len(results)}
    about |= {"commits": sorted({str(r["commit"]) for r in results}), "versions": provenance()["versions"]}
    lines = []
    for case in map(score_case, results):
        words = {n: said[:_SENTENCE] for n in ("sentence", "discovered", "why") if (said := getattr(case, n))}
        lines.append(json.dumps(replace(case, **words).row(), allow_nan=False))  # type: ignore[arg-type]
    head, rows = json.dumps({"schema": SCHEMA, **about}, allow_nan=False), ",\n".join(lines)
    return f'{head[:-1]}, "rows": [\n{rows}\n]}}\n'


def read_stored(folder: Path) -> list[StoredScores]:
    """Every file of scores in a folder, by name."""
    contents = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(folder.glob("*.json"))]
    return [
        StoredScores(about=c, cases=[ScoredCase.from_row(row) for row in c.pop("rows")])
        for c in contents
        if c.get("schema") == SCHEMA
    ]


# ---- the document


def write_page(top: Path, stored: Sequence[StoredScores]) -> Path:
    """Write the page for readers into a folder of documents: the newest answers alone, the conclusion first."""
    *newer, plants = _parts(stored)
    line, span, space = (_own(newest(part)) for part in newer)
    laws = _far_unknowns(span)
    in_span = _PAGE_SPAN.format(
        campaigns=len(span),
        outcomes=_outcomes(span),
        conclusion=conclusion(span),
        place=with_interval([bool(f.place) for f in laws]),
        form=with_interval([bool(f.law) for f in laws]),
    )
    in_space = _PAGE_SPACE.format(campaigns=len(space), conclusion=conclusion(space)) if space else ""
    text = _PAGE.format(
        conclusion=conclusion(line),
        targets=target_table(line, notes=False),
        span=in_span if span else "",
        space=in_space,
        plants=_of_plants(_own(plants)) if plants else "",
        spans_sure=next((count_text(b.true) for b in reliability(_changed_spans(stored)) if b.high == 1.0), "none"),
    )
    return write_text(top / "how_often_right.md", re.sub("\n{3,}", "\n\n", text))


def _outcomes(cases: Sequence[ScoredCase]) -> str:
    """In how many campaigns the unknown was told, imitated, told as something else or overlooked; stops, crashes."""
    count = Counter(STOPS if f.verdict == STOPS else f.outcome for f in cases)
    return (
        f"Something unknown was told in {count['right']}; names that imitate it to less than {LOOKALIKE_REMAINDER:g} "
        f"units of noise in {count['lookalike']}; other names in {count['wrong']}; {count[STOPS]} ended with a doubt "
        f"of the sheet; nothing in {count['missed']}; {count[CRASH]} crashed."
    )


def _of_plants(cases: Sequence[ScoredCase]) -> str:
    """The section of campaigns as plants measure, and of changed spans on such plans."""
    span, own = ([f for f in cases if (f.source == PLANTS[1]) is whether] for whether in (True, False))
    seeds = [f.seed for f in own]
    newest = max((f.seed for f in span), default=0) // SET * SET  # the set of the newest version only
    span = [f for f in span if f.seed >= newest]
    return _PAGE_PLANTS.format(
        first=min(seeds),
        many=len(seeds),
        told=with_interval([f.right or (bool(f.hidden) and set(f.hidden) <= f.answer_set) for f in own]),
        sure=with_interval([confidently_wrong(f) for f in own]),
        newest=newest,
        place=with_interval([bool(f.place) for f in span]),
        of_told=with_interval([bool(f.place) for f in span if f.place is not None]),
        alike=with_interval([f.outcome == "lookalike" for f in span]),
        apart=with_interval(_apart(newest)),
    )


def _apart(first: int) -> list[bool]:
    """Whether the true place can be told from every other, of each campaign that ``places`` was asked for."""
    kept = Path(__file__).with_name("stored") / f"places_{first}.txt"
    lines = kept.read_text(encoding="utf-8").splitlines()[:-1] if kept.exists() else []
    return [float(re.split(r"left: \S+ |,", line)[1]) >= APART for line in lines]


def _parts(stored: Sequence[StoredScores]) -> tuple[list[StoredScores], ...]:
    """Those of a whole machine, of changed spans, of the belt in 3D, and as plants measure."""
    apart = ((SPAN,), (SPACE,), PLANTS)
    found = [[p for p in stored if p.about["source"] in names] for names in apart]
    return [p for p in stored if not any(p in part for part in found)], *found


def newest(stored: Sequence[StoredScores]) -> list[StoredScores]:
    """Answers of the whole diagnosis by the decision that answered the campaigns with the highest seeds."""
    answered = [p for p in stored if p.about["ablation"] == OWN]
    if not answered:
        return []
    mixed = [p for p in answered if p.about["source"] == "mix"] or answered
    code = max(mixed, key=lambda p: p.about["seeds"][0]).code
    return [p for p in answered if p.code in (SAME_DECISION if code in SAME_DECISION else (code,))]


def conclusion(cases: Sequence[ScoredCase]) -> str:
    """The answer in a few sentences, each with its count."""
    nothing, large, two = of_kind(cases, "nothing"), _large(cases), of_kind(cases, "two")
    small = [f for f in of_kind(cases, "library") if size_class(f.size) == SIZES[0]]
    said = [
        ("**Nothing is wrong**: it says so in {} campaigns.", [f.right for f in nothing]),
        (
            "**An effect is plain to see** (d of 6 and more): it names the truth, or lists it among the "
            "explanations that it cannot tell apart, in {} campaigns.",
            [set(f.hidden) <= f.answer_set for f in large],
        ),
        ("**It is sure and wrong** in {} of these.", [confidently_wrong(f) for f in large]),
        (
            "**An effect is barely visible** (d = 3): it names it in {} campaigns, else it stays silent.",
            [f.right for f in small],
        ),
        ("**Two effects act at once**: it names exactly these two in {} campaigns.", [f.right for f in two]),
        (
            "**The catalogue lacks the effect** (distance of 8 and more): it says that something unknown acts "
            "in {} campaigns.",
            [f.right for f in _far_unknowns(cases)],
        ),
    ]
    return "\n".join(f"- {words.format(with_interval(flags))}" for words, flags in said if flags)


def write_record(top: Path, stored: Sequence[StoredScores]) -> Path:
    """Write the record of all stored campaigns, and its pictures, into a folder of documents."""
    line, span, space, plants = _parts(stored)
    own = _own(line)
    parts = [_INTRO, _commands(line), _TARGETS.format(len(own)) + target_table(own), by_size(own), by_pair(own)]
    parts += [by_effect(own)]
    if draw_reliability(top / "images" / PICTURE, own):
        parts += [_WORTH.format(PICTURE)]
    parts += [by_probability(own), _by_chance(own), outside_library(own), failures(own)]
    parts += [_separate_tables(_IN_SPAN, span), _separate_tables(_IN_SPACE, space)]
    parts += [_separate_tables(_IN_PLANTS, plants)]
    if top.resolve() == ROOT / "docs":  # reports quote it
        spans = {b.low: f"{b.true.count},{b.true.trials}" for b in reliability(_changed_spans(stored))}
        rows = [
            f"{b.low:g},{b.high:g},{b.true.count},{b.true.trials},{spans.get(b.low, '0,0')}" for b in reliability(own)
        ]
        heads = "low,high,right,answers,right_in_changed_spans,answers_in_changed_spans"
        write_text(BLIND_TESTS, "\n".join([heads, *rows]) + "\n")
    return write_text(top / RECORD, "\n".join(p for p in parts if p))


def _own(stored: Sequence[StoredScores]) -> list[ScoredCase]:
    """Answers of the whole diagnosis."""
    return [f for p in stored if p.about["ablation"] == OWN for f in p.cases]


def _changed_spans(stored: Sequence[StoredScores]) -> list[ScoredCase]:
    """Answers of the whole diagnosis where a span itself had changed, which no effect of the library does."""
    return _own([p for p in stored if p.about["source"] in (SPAN, PLANTS[1])])


def _commands(stored: Sequence[StoredScores]) -> str:
    """How every file of scores was made, and what of its seeds has no answer."""
    lines, holes = [], []
    for p in stored:
        a, many = p.about, p.about["seeds"][1] - p.about["seeds"][0] + 1
        settings = f"source={a['source']} ablation={a['ablation']} first_seed={a['seeds'][0]}"
        settings += f" count={many} bootstraps={a['bootstraps']}"
        answered = f"{len(p.cases)} campaigns" if len(p.cases) == many else f"{len(p.cases)} of {many} answered"
        lines.append(f"python -m studies.challenge {settings}    # {answered}; commit {p.code}")
        if p.unanswered_seeds and a["ablation"] == OWN:
            holes.append(f"{len(p.unanswered_seeds)} of {a['source']} ({_ranges(p.unanswered_seeds)})")
    text = "```\n" + "\n".join(lines) + "\n```\n"
    if holes:
        text += f"\nNot answered within the time there was, and in no figure: {'; '.join(holes)}.\n"
        text += "What takes long is missing more often than what is answered soon.\n"
    return text


def _ranges(seeds: Sequence[int]) -> str:
    """Numbers in ascending order as ranges: 3-5, 9."""
    starts = [seeds[0], *(b for a, b in pairwise(seeds) if b != a + 1)]
    ends = [*(a for a, b in pairwise(seeds) if b != a + 1), seeds[-1]]
    ranges = [f"{a}" if a == b else f"{a}-{b}" for a, b in zip(starts, ends, strict=True)]
    return ", ".join(ranges[:_LISTED]) + (", ..." if len(ranges) > _LISTED else "")


def _separate_tables(intro: str, stored: Sequence[StoredScores]) -> str:
    """Campaigns that are in no figure above: the same tables, and every campaign with its answer; empty without any."""
    own = _own(stored)
    if not own:
        return ""
    tables = [_TARGETS.format(len(own)) + target_table(own), by_size(own), by_effect(own), outside_library(own)]
    tables += [failures(own)]
    below = [text.replace("## ", "### ", 1) for text in tables if text]
    folded = ["<details><summary>all of them</summary>\n", _each(own), "</details>\n"]
    return "\n".join([intro, _commands(stored), *below, *folded])


# ---- tables: groups of campaigns, and figures counted in each


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "/") for cell in line) + " |" for line in lines) + "\n"


def count_text(share: Share | None) -> str:
    """A count; nothing without trials."""
    return f"{share.count} of {share.trials}" if share is not None and share.trials else ""


def with_interval(flags: Sequence[bool]) -> str:
    """A count with the 95 % interval of its share; nothing without trials."""
    share = share_of(list(flags))
    low, high = share.interval
    return f"{count_text(share)} ({100 * low:.0f} - {100 * high:.0f} %)" if share.trials else ""


def _large(cases: Sequence[ScoredCase]) -> list[ScoredCase]:
    return of_kind(cases, "library", "two", least=SEEN)


def _far_unknowns(cases: Sequence[ScoredCase]) -> list[ScoredCase]:
    return [f for f in of_kind(cases, "outside") if (f.distance or 0.0) >= _FAR]


def _law_told(cases: Sequence[ScoredCase]) -> list[ScoredCase]:
    """Where place and form of a discovered law can be judged."""
    return [f for f in cases if f.place is not None or f.discovered is None]


#: figure -> the flags of the campaigns in which it is counted
FIGURES: dict[str, Callable[[Sequence[ScoredCase]], list[bool]]] = {
    "exactly named": lambda cases: [f.right for f in cases],
    "or in the confusable set": lambda cases: [set(f.hidden) <= f.answer_set for f in cases],
    "none or one named": lambda cases: [set(f.named) < set(f.hidden) for f in cases],
    "confidently wrong": lambda cases: [confidently_wrong(f) for f in cases],
    "overlooked": lambda cases: [f.verdict == "adequate" for f in cases],
    "95 % interval holds": lambda cases: [flag for f in cases for flag in f.covered],
    "90 % of the error removed": lambda cases: [f.removed >= GOOD_REMOVAL for f in cases if f.removed is not None],
    "flagged as unknown": lambda cases: [f.right for f in cases],
    "false names": lambda cases: [bool(f.false_names) for f in cases],
    "place right": lambda cases: [bool(f.place) for f in _law_told(cases)],
    "variable and form right": lambda cases: [bool(f.law) for f in _law_told(cases)],
    "80 % of the error removed": lambda cases: [f.removed >= 0.8 for f in cases if f.removed is not None],
}
_OF_LAWS = ("flagged as unknown", "false names", "place right", "variable and form right", "80 % of the error removed")


def figures(names: Sequence[str], cases: Sequence[ScoredCase]) -> list[str]:
    """Cells of a row: the named figures, counted with their intervals."""
    return [with_interval(FIGURES[name](cases)) for name in names]


def rows_of(
    groups: Mapping[str, Sequence[ScoredCase]], names: Sequence[str], counted: bool = True
) -> list[Sequence[str]]:
    """Rows of a table: a group that holds campaigns each, how many, and its figures."""
    return [
        (label, *([str(len(mine))] if counted else []), *figures(names, mine)) for label, mine in groups.items() if mine
    ]


def target_cells(row: Target) -> tuple[str, ...]:
    """One row of the table of targets as text: figure, target, found, interval, note."""
    low, high = row.found.interval
    interval = f"{low:.0%} - {high:.0%}" if row.found.trials else ""
    return row.name, row.goal, f"{row.found.count} of {row.found.trials}", interval, row.note


def target_table(cases: Sequence[ScoredCase], notes: bool = True) -> str:
    """The targets, and whether they are reached."""
    head = ("figure", "target", "found", "95 % interval", "reached", "note")
    reached = {True: "yes", False: "**no**", None: ""}
    lines = [(*target_cells(t)[:4], reached[t.is_met], t.note) for t in targets(cases) if t.found.trials]
    return table(head, lines) if notes else table(head[:-1], [line[:-1] for line in lines])


def by_effect(cases: Sequence[ScoredCase]) -> str:
    """One hidden effect: how often it is named rightly, by its size."""
    library = of_kind(cases, "library")
    lines = []
    for name in sorted({f.hidden[0] for f in library}):
        mine = [f for f in library if f.hidden == [name]]
        sizes = [count_text(share_of([f.right for f in mine if size_class(f.size) == s])) for s in SIZES]
        large = [f for f in mine if (f.size or 0.0) >= SEEN]
        seen = figures(("exactly named", "or in the confusable set"), large)
        lines.append((name, *sizes, *seen, *figures(["95 % interval holds"], mine)))
    head = ("effect", *(f"d = {s}" for s in SIZES), "d >= 6", "or in the confusable set", "95 % interval holds")
    return "## One hidden effect, named rightly\n\n" + table(head, lines) if lines else ""


def by_size(cases: Sequence[ScoredCase]) -> str:
    """What is said of one effect, and of two, by the size of the smaller."""
    names = ["exactly named", "or in the confusable set", "confidently wrong", "overlooked"]
    names += ["95 % interval holds", "90 % of the error removed"]
    groups = {
        f"{words}, d = {size}": [f for f in of_kind(cases, kind) if size_class(f.size) == size]
        for kind, words in (("library", "one effect"), ("two", "two effects"))
        for size in SIZES
    }
    rows = rows_of(groups, names, counted=False)
    return "## By size\n\n" + table(("hidden", *names), rows) if rows else ""


def by_pair(cases: Sequence[ScoredCase]) -> str:
    """Two effects, by what the best single effect of the generator's library leaves of them."""
    names = ("exactly named", "or in the confusable set", "none or one named", "confidently wrong")
    classes = {"under 3": (0.0, 3.0), f"3 - {SEEN:.1f}": (3.0, SEEN), f"{SEEN:.1f} - 9": (SEEN, 9.0)}
    pairs = [f for f in of_kind(cases, "two") if f.distance is not None]
    rows = rows_of(_by_distance(pairs, classes | {"9 and more": (9.0, np.inf)}), names, counted=False)
    return _PAIRS + table(("one effect leaves", *names), rows) if rows else ""


def _by_distance(
    cases: Sequence[ScoredCase], classes: Mapping[str, tuple[float, float]]
) -> dict[str, list[ScoredCase]]:
    return {words: [f for f in cases if low <= (f.distance or 0.0) < high] for words, (low, high) in classes.items()}


# ---- laws outside the library


def outside_library(cases: Sequence[ScoredCase]) -> str:
    """Campaigns whose hidden law is outside the library, by distance, form and law; empty where there is none."""
    strange = [f for f in of_kind(cases, "outside") if f.distance is not None]
    if not strange:
        return ""
    far = [f for f in strange if (f.distance or 0.0) >= _FAR]
    forms = {
        form: [f for f in far if f.unknown[2:] == [form]] for form in sorted({f.unknown[2] for f in far if f.unknown})
    }
    tables = [("distance", _by_distance(strange, _DISTANCES)), ("form", forms)]
    found = [table((head, "campaigns", *_OF_LAWS), rows) for head, g in tables if (rows := rows_of(g, _OF_LAWS))]
    return "\n".join([_OUTSIDE, *found, *([""] if len(found) < 2 else []), _by_law(far)])


def _by_law(cases: Sequence[ScoredCase]) -> str:
    """Every law of the generator, by form and place."""
    lines = []
    laws = {f.hidden[0]: ["", "", ""] for f in cases} | {f.hidden[0]: f.unknown for f in cases[::-1] if f.unknown}
    for name in sorted(laws, key=lambda n: (laws[n][::-1], n)):
        mine = [f for f in cases if f.hidden[0] == name]
        place, variable, form = laws[name]
        shares = [count_text(share_of(FIGURES[figure](mine))) for figure in _OF_LAWS[:4]]
        left = [f.removed for f in mine if f.removed is not None]
        lines.append((form, variable, place, name, str(len(mine)), *shares, f"{np.median(left):.0%}" if left else ""))
    head = ("form", "variable", "place", "law", "campaigns", *_OF_LAWS[:4], "error removed, median")
    return table(head, lines) if lines else ""


# ---- probabilities


@dataclass(frozen=True)
class Bin:
    """Names said at a probability from low to high; said: their mean; true: so many were hidden; alike: so many were,
    or stand for a hidden effect that the answer itself cannot tell from them."""

    low: float
    high: float
    said: float
    true: Share
    alike: Share

    @property
    def name(self) -> str:
        """From where to where."""
        return f"{self.low:g} - {self.high:g}"


def reliability(cases: Sequence[ScoredCase]) -> list[Bin]:
    """What probabilities are worth: every bin that holds a named effect."""
    said = [(p, name in f.hidden, name not in f.false_names) for f in cases for name, p in f.named.items()]
    found = []
    for low, high in pairwise(_EDGES):
        mine = [s for s in said if low <= s[0] < high or s[0] == high == _EDGES[-1]]
        if mine:
            mean = sum(p for p, _, _ in mine) / len(mine)
            found.append(Bin(low, high, mean, share_of([t for _, t, _ in mine]), share_of([a for _, _, a in mine])))
    return found


def by_probability(cases: Sequence[ScoredCase]) -> str:
    """What was said with a probability, and how often it was true."""
    lines = []
    for b in reliability(cases):
        low, high = b.true.interval
        lines.append((b.name, f"{b.said:.3f}", count_text(b.true), f"{low:.0%} - {high:.0%}", count_text(b.alike)))
    alike = "or cannot be told from what is, as the answer says"
    return table(("probability", "mean said", "truly hidden", "95 % interval", alike), lines) if lines else ""


def _by_chance(cases: Sequence[ScoredCase]) -> str:
    """How often a p is small when nothing is hidden: as often as it says."""
    said = [f.p for f in of_kind(cases, "nothing") if f.p is not None]
    head = ("p of what is left, nothing hidden", *(f"<= {p}" for p in _LEVELS))
    line = (f"{len(said)} campaigns", *(count_text(share_of([p <= level for p in said])) for level in _LEVELS))
    return table(head, [line]) if said else ""


# ---- pictures


@style.picture
def draw_reliability(path: Path, cases: Sequence[ScoredCase]) -> bool:
    """Share of named effects that were truly hidden, beside the probability that was said."""
    bins = reliability(cases)
    if not bins:
        return False
    at, found = np.arange(len(bins)), np.array([b.true.value for b in bins])
    low, high = np.array([b.true.interval for b in bins]).T
    fig, [ax] = style.figure(1.6 + 0.85 * len(bins), 4.6)
    look: dict[str, Any] = {"color": FAINT_INK, "linewidth": 2.4, "label": "probability said, mean"}
    ax.hlines([b.said for b in bins], at - 0.36, at + 0.36, **look)
    bars = np.maximum([found - low, high - found], 0.0)
    ax.errorbar(at, found, yerr=bars, fmt="o", color=AFTER_COLOUR, capsize=3, label="share truly hidden, 95 % interval")
    ax.set_xticks(at, [f"{b.name}\n{b.true.count} of {b.true.trials}" for b in bins], fontsize=8)
    ax.set(xlim=(-0.6, len(bins) - 0.4), ylim=(0, 1.04), xlabel="probability said; names that were true, of all")
    ax.set_ylabel("probability, share")
    ax.legend(loc="lower right", fontsize=8)
    style.title(fig, "What a probability is worth")
    style.save(fig, path)
    return True


# ---- failures


def failures(cases: Sequence[ScoredCase]) -> str:
    """Causes with counts, and every campaign below its cause, folded."""
    wrong = [f for f in cases if not f.right and not (f.outcome == "missed" and (f.size or 2 * _VISIBLE) < _VISIBLE)]
    groups: dict[str, list[ScoredCase]] = {}
    for f in wrong:
        groups.setdefault(cause(f), []).append(f)
    ordered = sorted(groups.items(), key=lambda g: (-len(g[1]), g[0]))
    rows = []
    for name, group in ordered:
        hidden = Counter(" + ".join(f.hidden) or f.dirt or f.plan or f.kind for f in group).most_common()
        said = ", ".join(f"{what} {n}" if n > 1 else what for what, n in hidden[:_COMMON])
        rows.append((name, str(len(group)), said + (", ..." if len(hidden) > _COMMON else "")))
    parts = [
        f"## Failures\n\n{len(wrong)} of {len(cases)}; an effect below d = {_VISIBLE} that is overlooked is none.\n"
    ]
    parts += [table(("what went wrong", "campaigns", "hidden"), rows)] if wrong else []
    for name, group in ordered:
        parts += [f"<details><summary>{name}: {len(group)}</summary>\n", _each(group), "</details>\n"]
    return "\n".join(parts)


def cause(f: ScoredCase) -> str:
    """What went wrong, in words that many campaigns share."""
    if f.outcome == "crash":
        return "a crash, or no answer within its time"
    if f.kind == "dirty":
        return "damage that was not seen"
    if f.verdict == STOPS:
        return "clean data taken for damaged"
    if f.kind in ("nothing", "below_noise"):
        return "nothing to be seen: an effect named" if f.named else "nothing to be seen: something unknown told"
    if f.kind == "outside":
        return "not in the library: overlooked" if f.verdict == "adequate" else "not in the library: a name of it given"
    many = "two hidden" if f.kind == "two" else "one hidden"
    if f.outcome == "unnamed":
        return f"{many}: flagged as unknown, not named; {f.held_back or HeldBack.REST_FAILS}"
    said = {
        "missed": "overlooked",
        "part": "only one named",
        "beside": "a false name beside the truth",
        "lookalike": "another named that the generator cannot tell from it either",
    }
    return f"{many}: {said.get(f.outcome, 'another named')}"


def _each(cases: Sequence[ScoredCase]) -> str:
    """Campaigns, one a line."""
    head = ("campaign", "source", "hidden", "answered", "outcome", "why")
    answers = ((f, f"{f.verdict} {', '.join(f.named)}") for f in cases)
    return table(head, ((str(f.seed), f.source, describe_hidden(f), said, f.outcome, f.why) for f, said in answers))


def describe_hidden(f: ScoredCase) -> str:
    """What a campaign hides, with sizes."""
    sizes = [f" (d = {d:.0f})" if d else "" for d in f.d]
    names = [f"{name}{size}" for name, size in zip(f.hidden, sizes, strict=True)]
    far = f", distance {f.distance:.0f}" if f.kind == "outside" and f.distance is not None else ""
    place = f" [{f.plan}]" if f.plan else ""
    return f"{f.kind.replace('_', ' ')}: {join_words([*names, *([f.dirt] if f.dirt else [])])}{far}{place}"
