"""Tables of the document: targets, effects, sizes, plans and probabilities, each figure with its count."""

from collections.abc import Iterable, Sequence

import numpy as np

from studies.challenge.answers import OWN
from studies.challenge.facts import Facts
from studies.challenge.published import Published
from studies.challenge.reliability import reliability
from studies.challenge.targets import GOOD_REMOVAL, SIZES, confidently_wrong, of_kind, size_class, targets
from studies.challenge.told import cells
from studies.challenge.wilson import Share, share_of

LEVELS = (0.01, 0.05, 0.1, 0.25, 0.5)
SEEN = 6 * 0.8  # d from which an effect is to be named
_PAIRS = """## Two hidden effects

By what the best single effect of the generator's library leaves of both, in units of noise. Where that is less than 3 a
second effect lowers chi2 by 9 more than chance does at most; chance alone does as much, for one of thirty candidates,
in 1 - 0.9973^30 = 8 % of campaigns.

"""


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "/") for cell in line) + " |" for line in lines) + "\n"


def counted(share: Share | None) -> str:
    """A count; nothing without trials."""
    return f"{share.count} of {share.trials}" if share is not None and share.trials else ""


def ranged(flags: Sequence[bool]) -> str:
    """A count with the 95 % interval of its share; nothing without trials."""
    share = share_of(list(flags))
    low, high = share.interval
    return f"{counted(share)} ({100 * low:.0f} - {100 * high:.0f} %)" if share.trials else ""


def of_targets(rows: Sequence[Facts]) -> str:
    """The target table."""
    head = ("figure", "target", "found", "95 % interval", "reached", "note")
    reached = {True: "yes", False: "**no**", None: ""}
    lines = [(*cells(t)[:4], reached[t.met], t.note) for t in targets(rows) if t.found.trials]
    return f"## Targets\n\n{len(rows)} campaigns.\n\n{table(head, lines)}"


def by_source(published: Sequence[Published]) -> str:
    """The same for every source of campaigns; nothing where there is but one."""
    return _side_by_side("## The same by source of campaigns", [(p.about["source"], p) for p in published])


def by_code(published: Sequence[Published]) -> str:
    """The same for every code that answered; nothing where there is but one."""
    return _side_by_side("## The same by commit of the code", [(p.code, p) for p in published])


def _side_by_side(title: str, published: Sequence[tuple[str, Published]]) -> str:
    groups: dict[str, list[Facts]] = {}
    for name, p in published:
        if p.about["ablation"] == OWN:
            groups.setdefault(name, []).extend(p.rows)
    if len(groups) < 2:
        return ""
    found = [{t.name: t.found for t in targets(rows)} for rows in groups.values()]
    every = dict.fromkeys(name for f in found for name in f)
    lines = [(n, *(counted(f.get(n)) for f in found)) for n in every if any(counted(f.get(n)) for f in found)]
    return f"{title}\n\n" + table(("figure", *groups), lines)


def by_effect(rows: Sequence[Facts]) -> str:
    """One hidden effect: how often it is named rightly, by its size."""
    library = of_kind(rows, "library")
    lines = []
    for name in sorted({f.hidden[0] for f in library}):
        mine = [f for f in library if f.hidden == [name]]
        sizes = [counted(share_of([f.right for f in mine if size_class(f.size) == s])) for s in SIZES]
        large = [f for f in mine if (f.size or 0.0) >= SEEN]
        among = ranged([set(f.hidden) <= f.answer_set for f in large])
        lines.append((name, *sizes, ranged([f.right for f in large]), among, ranged(_inside(mine))))
    head = ("effect", *(f"d = {s}" for s in SIZES), "d >= 6", "or in the confusable set", "95 % interval holds")
    return "## One hidden effect, named rightly\n\n" + table(head, lines) if lines else ""


def by_size(rows: Sequence[Facts]) -> str:
    """What is said of one effect, and of two, by the size of the smaller."""
    lines = []
    for kind, words in (("library", "one effect"), ("two", "two effects")):
        for size in SIZES:
            mine = [f for f in of_kind(rows, kind) if size_class(f.size) == size]
            if not mine:
                continue
            flags = [
                [f.right for f in mine],
                [set(f.hidden) <= f.answer_set for f in mine],
                [confidently_wrong(f) for f in mine],
                [f.verdict == "adequate" for f in mine],
                _inside(mine),
                [f.removed >= GOOD_REMOVAL for f in mine if f.removed is not None],
            ]
            lines.append((f"{words}, d = {size}", *map(ranged, flags)))
    head = ["hidden", "exactly named", "or in the confusable set", "confidently wrong", "overlooked"]
    head += ["95 % interval holds", "90 % of the error removed"]
    return "## By size\n\n" + table(head, lines) if lines else ""


def of_pairs(rows: Sequence[Facts]) -> str:
    """Two effects, by what the best single effect of the generator's library leaves of them."""
    classes = {"under 3": (0.0, 3.0), f"3 - {SEEN:.1f}": (3.0, SEEN), f"{SEEN:.1f} - 9": (SEEN, 9.0)}
    classes["9 and more"] = (9.0, np.inf)
    lines = []
    for words, (low, high) in classes.items():
        mine = [f for f in of_kind(rows, "two") if f.distance is not None and low <= f.distance < high]
        flags = [
            [f.right for f in mine],
            [set(f.hidden) <= f.answer_set for f in mine],
            [set(f.named) < set(f.hidden) for f in mine],
            [confidently_wrong(f) for f in mine],
        ]
        if mine:
            lines.append((words, *map(ranged, flags)))
    head = ("one effect leaves", "exactly named", "or in the confusable set", "none or one named", "confidently wrong")
    return _PAIRS + table(head, lines) if lines else ""


def by_plan(rows: Sequence[Facts]) -> str:
    """The same figures for every kind of machine."""
    lines = []
    for plan in sorted({f.plan for f in rows if f.plan}):
        mine = [f for f in rows if f.plan == plan]
        nothing, large = of_kind(mine, "nothing"), of_kind(mine, "library", "two", least=SEEN)
        strange = [f for f in of_kind(mine, "outside") if (f.distance or 0) >= 8]
        flags = [[not f.right for f in nothing], [f.right for f in large], [confidently_wrong(f) for f in large]]
        flags += [[f.right for f in strange], _inside(mine)]
        spent = [f.seconds for f in mine if f.seconds is not None]
        time = f"{np.median(spent):.0f} s, {np.quantile(spent, 0.9):.0f} s" if spent else ""
        lines.append((plan, str(len(mine)), *map(ranged, flags), time))
    head = ["plan", "campaigns", "false alarms", "right, d >= 6", "confidently wrong, d >= 6", "unknown flagged"]
    head += ["95 % interval holds", "time: median, 9 of 10"]
    return "## By plan\n\n" + table(head, lines) if lines else ""


def by_probability(rows: Sequence[Facts]) -> str:
    """What was said with a probability, and how often it was true."""
    lines = []
    for b in reliability(rows):
        low, high = b.true.interval
        lines.append((b.name, f"{b.said:.3f}", counted(b.true), f"{low:.0%} - {high:.0%}", counted(b.alike)))
    head = (
        "probability",
        "mean said",
        "truly hidden",
        "95 % interval",
        "or cannot be told from what is, as the answer says",
    )
    return table(head, lines) if lines else ""


def by_chance(rows: Sequence[Facts]) -> str:
    """How often a p is small when nothing is hidden: as often as it says."""
    said = [f.p for f in of_kind(rows, "nothing") if f.p is not None]
    head = ("p of what is left, nothing hidden", *(f"<= {p}" for p in LEVELS))
    line = (f"{len(said)} campaigns", *(counted(share_of([p <= level for p in said])) for level in LEVELS))
    return table(head, [line]) if said else ""


def _inside(rows: Iterable[Facts]) -> list[bool]:
    return [flag for f in rows for flag in f.covered]
