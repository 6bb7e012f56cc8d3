"""docs/how_often_right.md, written from files of facts: targets, tables, pictures, ablations, failures."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from belt_sim.files import write_text
from studies.challenge.answers import OWN
from studies.challenge.beyond_library import of_strangers
from studies.challenge.compared import of_answers
from studies.challenge.facts import Facts
from studies.challenge.failures import each, of_failures
from studies.challenge.published import Published
from studies.challenge.tables import (
    by_chance,
    by_code,
    by_effect,
    by_plan,
    by_probability,
    by_size,
    by_source,
    of_pairs,
    of_targets,
)

SPACE = "space"
PICTURES = {"confusion": "challenge_confusion.png", "reliability": "challenge_reliability.png"}
TOLD = 12  # gaps of seeds that are told one by one
_INTRO = """# How often the diagnosis is right

Written by `python -m studies.challenge count=0 publish=docs` from the files in `studies/challenge/stored`; do not edit.

Every campaign is drawn by the virtual rig, whose code shares nothing with the fitter but the file format. The SHA-256
of its truth is written before anybody answers; the answer is made from the campaign's folder alone and kept; then the
truth is opened. All campaigns that were answered count; a crash is wrong. d is the size of what is hidden in units of
noise, after what nuisances can explain. Intervals are Wilson's, 95 %. An alias counts as right where the answer itself
says that the two cannot be told apart.
"""
_IN_SPACE = """## Campaigns of the 3D belt

Measured in three dimensions on a short rig (a = 2 m, five runs of 8 m, two sensors): membrane, pulleys and whatever is
hidden are geometry, friction or gravity of the scene, and no span law or effect is in it. Every twenty campaigns meet
each of fourteen faults once, and nothing six times. They are not in the figures above. The law and this belt differ by
0.3 % of a reading and 1.6 um, which these sensors hardly see (d = 1.6, `python -m studies.space_error`); the campaign's
file states it. In 8 m the belt goes round once and a half, so that a weld passes every pulley once or twice.
"""


def write_document(top: Path, published: Sequence[Published]) -> Path:
    """Write how_often_right.md and its pictures into a folder of documents."""
    line = [p for p in published if p.about["source"] != SPACE]
    own = [f for p in line if p.about["ablation"] == OWN for f in p.rows]
    parts = [_INTRO, _commands(line), of_targets(own), by_source(line), by_code(line), by_size(own), of_pairs(own)]
    parts += [by_effect(own), by_plan(own), _pictures(top, own), of_strangers(own), of_answers(line), of_failures(own)]
    parts += [_space([p for p in published if p.about["source"] == SPACE])]
    return write_text(top / "how_often_right.md", "\n".join(p for p in parts if p))


def _commands(published: Sequence[Published]) -> str:
    """How every file of facts was made, and what of its seeds has no answer."""
    lines, holes = [], []
    for p in published:
        a, many = p.about, p.about["seeds"][1] - p.about["seeds"][0] + 1
        asked = f"source={a['source']} ablation={a['ablation']} first_seed={a['seeds'][0]}"
        answered = f"{len(p.rows)} campaigns" if len(p.rows) == many else f"{len(p.rows)} of {many} answered"
        asked += f" count={many} bootstraps={a['bootstraps']}"
        lines.append(f"python -m studies.challenge {asked}    # {answered}; commit {p.code}")
        if p.unanswered and a["ablation"] == OWN:
            holes.append(f"{len(p.unanswered)} of {a['source']} ({_seeds(p.unanswered)})")
    told = "```\n" + "\n".join(lines) + "\n```\n"
    if holes:
        told += f"\nNot answered within the time there was, and in no figure: {'; '.join(holes)}.\n"
        told += "What takes long is missing more often than what is answered soon.\n"
    return told


def _seeds(seeds: Sequence[int]) -> str:
    """Numbers in ascending order as ranges: 3-5, 9."""
    starts = [seeds[0], *(b for a, b in pairwise(seeds) if b != a + 1)]
    ends = [*(a for a, b in pairwise(seeds) if b != a + 1), seeds[-1]]
    told = [f"{a}" if a == b else f"{a}-{b}" for a, b in zip(starts, ends, strict=True)]
    return ", ".join(told[:TOLD]) + (", ..." if len(told) > TOLD else "")


def _pictures(top: Path, rows: Sequence[Facts]) -> str:
    from studies.challenge.drawn import draw_confusion, draw_reliability

    lines = []
    if draw_confusion(top / "images" / PICTURES["confusion"], rows):
        lines.append(f"![What was answered against what was hidden](images/{PICTURES['confusion']})\n")
    if draw_reliability(top / "images" / PICTURES["reliability"], rows):
        lines.append(f"![Probability said against share truly hidden](images/{PICTURES['reliability']})\n")
    lines += [by_probability(rows), by_chance(rows)]
    return "## What is taken for what, and what probabilities are worth\n\n" + "\n".join(x for x in lines if x)


def _space(published: Sequence[Published]) -> str:
    """Campaigns that were measured on the 3D belt: the same tables, and every campaign with its answer."""
    own = [f for p in published if p.about["ablation"] == OWN for f in p.rows]
    if not own:
        return ""
    tables = [of_targets(own), by_size(own), by_effect(own), of_answers(published), of_failures(own)]
    below = [text.replace("## ", "### ", 1) for text in tables if text]
    folded = ["<details><summary>all of them</summary>\n", each(own), "</details>\n"]
    return "\n".join([_IN_SPACE, _commands(published), *below, *folded])
