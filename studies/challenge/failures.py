"""Every answer that is not right, by what went wrong."""

from collections import Counter
from collections.abc import Sequence

from studies.challenge.facts import STOPS, Facts
from studies.challenge.tables import table
from studies.challenge.told import hidden_of

VISIBLE = 4.5  # d: a smaller effect may be overlooked
COMMON = 6  # so many of what is hidden are told beside a cause
#: words of a reason -> why an effect that is hidden was flagged and not named
_HELD = {
    "is no candidate": "it is no candidate",
    "cannot show": "the readings cannot show it",
    "under its threshold": "it is below its threshold",
    "implausible value": "its value is taken for implausible",
}


def failed(rows: Sequence[Facts]) -> list[Facts]:
    """Campaigns that count as failures."""
    return [f for f in rows if not f.right and not (f.outcome == "missed" and (f.size or 2 * VISIBLE) < VISIBLE)]


def of_failures(rows: Sequence[Facts]) -> str:
    """The section: causes with counts, and every campaign below its cause, folded."""
    wrong = failed(rows)
    groups: dict[str, list[Facts]] = {}
    for f in wrong:
        groups.setdefault(cause(f), []).append(f)
    ordered = sorted(groups.items(), key=lambda g: (-len(g[1]), g[0]))
    counts = table(("what went wrong", "campaigns", "hidden"), [(c, str(len(g)), _most(g)) for c, g in ordered])
    told = [f"## Failures\n\n{len(wrong)} of {len(rows)}; an effect below d = {VISIBLE} that is overlooked is none.\n"]
    told += [counts] if wrong else []
    for name, group in ordered:
        told += [f"<details><summary>{name}: {len(group)}</summary>\n", each(group), "</details>\n"]
    return "\n".join(told)


def each(rows: Sequence[Facts]) -> str:
    """Campaigns, one a line."""
    head = ("campaign", "source", "hidden", "answered", "outcome", "why")
    lines = [(str(f.seed), f.source, hidden_of(f), f"{f.verdict} {', '.join(f.named)}", f.outcome, f.why) for f in rows]
    return table(head, lines)


def cause(f: Facts) -> str:
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
        held = next((said for words, said in _HELD.items() if words in f.why), "what is left fails with it")
        return f"{many}: flagged as unknown, not named; {held}"
    said = {
        "missed": "overlooked",
        "part": "only one named",
        "beside": "a false name beside the truth",
        "lookalike": "another named that the generator cannot tell from it either",
    }
    return f"{many}: {said.get(f.outcome, 'another named')}"


def _most(rows: Sequence[Facts]) -> str:
    """The most common of what is hidden."""
    found = Counter(" + ".join(f.hidden) or f.dirt or f.plan or f.kind for f in rows).most_common()
    told = ", ".join(f"{name} {n}" if n > 1 else name for name, n in found[:COMMON])
    return told + (", ..." if len(found) > COMMON else "")
