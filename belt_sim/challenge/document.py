"""docs/how_often_right.md, written from files of facts: targets, effects, plans, ablations, failures."""

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from belt_sim.challenge.facts import Facts
from belt_sim.challenge.published import Published
from belt_sim.challenge.targets import SIZES, confidently_wrong, of_kind, size_class, targets
from belt_sim.challenge.told import cells, hidden_of
from belt_sim.challenge.wilson import Share, share_of
from belt_sim.files import write_text

OWN, SPACE = "diagnosis", "space"
LEVELS = (0.01, 0.05, 0.1, 0.25, 0.5)
PICTURES = {"confusion": "challenge_confusion.png", "reliability": "challenge_reliability.png"}
_INTRO = """# How often the diagnosis is right

Written by `belt-sim challenge publish=docs` from the files in `docs/challenge`; do not edit.

Every campaign is drawn by the virtual rig, whose code shares nothing with the fitter but the file format. The SHA-256
of its truth is written before anybody answers; the answer is made from the campaign's folder alone and kept; then the
truth is opened. All campaigns count; a crash is wrong. d is the size of what is hidden in units of noise, after what
nuisances can explain. Intervals are Wilson's, 95 %. An alias counts as right where the answer itself says that the two
cannot be told apart.
"""
_IN_SPACE = """## Campaigns of the 3D belt

Measured in three dimensions on a short rig (a = 2 m, five runs of 8 m, two sensors): membrane, pulleys and whatever is
hidden are geometry, friction or gravity of the scene, and no span law or effect is in it. Every twenty campaigns meet
each of fourteen faults once, and nothing six times. They are not in the figures above. The law and this belt differ by
0.3 % of a reading and 1.6 um, which these sensors hardly see (d = 1.6, `python -m studies.space_error`); the campaign's
file states it. In 8 m the belt goes round once and a half, so that a weld passes every pulley once or twice.
"""
_AGAIN = """Plain methods answer every campaign that the diagnosis has answered.
`belt-sim challenge of=FOLDER publish=docs`, with the folder of a challenge, lets the diagnosis without its parts answer
them too; some answer fewer campaigns.

"""
_WHO = {
    OWN: "the diagnosis",
    "no_whitening": "without whitening (wander taken as white noise)",
    "no_repeats": "without the repeated runs (noise as stated)",
    "no_gate": "what its search ends with, without the gate (no test of what is left)",
    "bic": "its search by BIC alone",
    "iid_bic": "least squares and BIC of independent readings",
    "sparse": "sparse regression on the residual",
    "sysid": "the same sets, noise taken from the fit",
}


def write_document(top: Path, published: Sequence[Published]) -> Path:
    """Write how_often_right.md and its pictures into a folder of documents."""
    line = [p for p in published if p.about["source"] != SPACE]
    own = [f for p in line if p.about["ablation"] == OWN for f in p.rows]
    parts = [_INTRO, _commands(line), _targets(own), _groups(line), _effects(own), _plans(own)]
    parts += [_pictures(top, own), _ablations(line, own), _failures(own)]
    parts += [_space([p for p in published if p.about["source"] == SPACE])]
    return write_text(top / "how_often_right.md", "\n".join(p for p in parts if p))


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "/") for cell in line) + " |" for line in lines) + "\n"


def _commands(published: Sequence[Published]) -> str:
    lines = []
    for p in published:
        a = p.about
        asked = f"source={a['source']} ablation={a['ablation']} first_seed={a['seeds'][0]}"
        asked += f" count={a['seeds'][1] - a['seeds'][0] + 1} bootstraps={a['bootstraps']}"
        commits = ", ".join(c[:10] for c in a["commits"])
        lines.append(f"belt-sim challenge {asked}    # {a['campaigns']} campaigns; commit {commits}")
    return "```\n" + "\n".join(lines) + "\n```\n"


def _targets(rows: Sequence[Facts]) -> str:
    head = ("figure", "target", "found", "95 % interval", "reached", "note")
    reached = {True: "yes", False: "**no**", None: ""}
    lines = [(*cells(t)[:4], reached[t.met], t.note) for t in targets(rows) if t.found.trials]
    return f"## Targets\n\n{len(rows)} campaigns.\n\n{_table(head, lines)}"


def _groups(published: Sequence[Published]) -> str:
    mine = [p for p in published if p.about["ablation"] == OWN]
    if len(mine) < 2:
        return ""
    names = [p.about["source"] for p in mine]
    found = [{t.name: t.found for t in targets(p.rows)} for p in mine]
    rows = [
        (n, *(_counted(f.get(n)) for f in found)) for n in found[0] if any(f.get(n, Share(0, 0)).trials for f in found)
    ]
    return "## The same by source of campaigns\n\n" + _table(("figure", *names), rows)


def _effects(rows: Sequence[Facts]) -> str:
    library = of_kind(rows, "library")
    ids = sorted({f.hidden[0] for f in library})
    lines = []
    for name in ids:
        mine = [f for f in library if f.hidden == [name]]
        by_size = [_counted(share_of([f.right for f in mine if size_class(f.size) == s])) for s in SIZES]
        inside = share_of([flag for f in mine for flag in f.covered])
        lines.append((name, *by_size, _counted(inside)))
    head = ("effect", *(f"d = {s}" for s in SIZES), "true values in 95 % intervals")
    return "## One hidden effect, named rightly\n\n" + _table(head, lines) if ids else ""


def _plans(rows: Sequence[Facts]) -> str:
    plans = sorted({f.plan for f in rows if f.plan})
    lines = []
    for plan in plans:
        mine = [f for f in rows if f.plan == plan]
        nothing, large = of_kind(mine, "nothing"), of_kind(mine, "library", "two", least=6 * 0.8)
        spent = sorted(f.seconds for f in mine if f.seconds is not None)
        alarms, right = share_of([not f.right for f in nothing]), share_of([f.right for f in large])
        strange = share_of([f.right for f in of_kind(mine, "outside") if (f.distance or 0) >= 8])
        time = f"{np.median(spent):.0f} s" if spent else ""
        lines.append((plan, str(len(mine)), _counted(alarms), _counted(right), _counted(strange), time))
    head = ("plan", "campaigns", "false alarms", "right, d >= 6", "unknown flagged", "median time")
    return "## By plan\n\n" + _table(head, lines) if plans else ""


def _pictures(top: Path, rows: Sequence[Facts]) -> str:
    from belt_sim.challenge.drawn import draw_confusion, draw_reliability

    lines = []
    if draw_confusion(top / "images" / PICTURES["confusion"], rows):
        lines.append(f"![What was answered against what was hidden](images/{PICTURES['confusion']})\n")
    if draw_reliability(top / "images" / PICTURES["reliability"], rows):
        lines.append(f"![Probability said against share truly hidden](images/{PICTURES['reliability']})\n")
    lines += [_by_chance(rows)]
    return "## What is taken for what, and what probabilities are worth\n\n" + "\n".join(lines)


def _by_chance(rows: Sequence[Facts]) -> str:
    """How often a p is small when nothing is hidden: as often as it says."""
    said = [f.p for f in of_kind(rows, "nothing") if f.p is not None]
    head = ("p of what is left, nothing hidden", *(f"<= {p}" for p in LEVELS))
    counted = (f"{len(said)} campaigns", *(_counted(share_of([p <= level for p in said])) for level in LEVELS))
    return _table(head, [counted]) if said else ""


def _ablations(published: Sequence[Published], own: Sequence[Facts]) -> str:
    answers: dict[str, list[Facts]] = {OWN: list(own)}
    for p in published:
        if p.about["ablation"] == OWN:
            for name, rows in p.others.items():
                answers.setdefault(name, []).extend(rows)
        else:
            answers.setdefault(p.about["ablation"], []).extend(p.rows)
    lines = [(_WHO.get(name, name), *_in_short(rows)) for name, rows in answers.items()]
    head = (
        "who answers",
        "false alarms",
        "right, d >= 6",
        "confidently wrong, d >= 6",
        "unknown flagged",
        "95 % interval holds",
    )
    return "## Without its parts, and plain methods on the same campaigns\n\n" + _AGAIN + _table(head, lines)


def _in_short(rows: Sequence[Facts]) -> list[str]:
    nothing, large = of_kind(rows, "nothing"), of_kind(rows, "library", "two", least=6 * 0.8)
    strange = [f for f in of_kind(rows, "outside") if (f.distance or 0) >= 8]
    shares = [[not f.right for f in nothing], [f.right for f in large], [confidently_wrong(f) for f in large]]
    shares += [[f.right for f in strange], [flag for f in rows for flag in f.covered]]
    return [_counted(share_of(flags)) for flags in shares]


def _failures(rows: Sequence[Facts]) -> str:
    """Every answer that is not right (an effect below d = 4.5 that is missed is none), with its reason."""
    wrong = [f for f in rows if not f.right and not (f.outcome == "missed" and (f.size or 9.0) < 4.5)]
    counted = Counter((f.outcome, ", ".join(f.hidden) or f.kind) for f in wrong)
    by_kind = [(outcome, hidden, str(n)) for (outcome, hidden), n in counted.most_common()]
    each = [(str(f.seed), f.source, hidden_of(f), f"{f.verdict} {', '.join(f.named)}", f.outcome, f.why) for f in wrong]
    head = ("campaign", "source", "hidden", "answered", "outcome", "why")
    counts = _table(("outcome", "hidden", "campaigns"), by_kind)
    told = [f"## Failures\n\n{len(wrong)} of {len(rows)}.\n", counts]
    return "\n".join([*told, "<details><summary>each of them</summary>\n", _table(head, each), "</details>\n"])


def _space(published: Sequence[Published]) -> str:
    """Campaigns that were measured on the 3D belt: the same tables, and every campaign with its answer."""
    own = [f for p in published if p.about["ablation"] == OWN for f in p.rows]
    if not own:
        return ""
    head = ("campaign", "hidden", "answered", "outcome", "why")
    each = [(str(f.seed), hidden_of(f), f"{f.verdict} {', '.join(f.named)}", f.outcome, f.why) for f in own]
    tables = [_targets(own), _ablations(published, own)]
    below = [table.replace("## ", "### ", 1) for table in tables]
    return "\n".join([_IN_SPACE, _commands(published), *below, "### Each of them\n", _table(head, each)])


def _counted(share: Share | None) -> str:
    return f"{share.count} of {share.trials}" if share is not None and share.trials else ""
