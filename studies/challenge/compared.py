"""The diagnosis beside itself without its parts, and beside plain methods, on the same campaigns."""

from collections.abc import Sequence

from studies.challenge.answers import OWN
from studies.challenge.facts import Facts
from studies.challenge.published import Published
from studies.challenge.tables import SEEN, ranged, table
from studies.challenge.targets import confidently_wrong, of_kind

_TEXT = """## Without its parts, and plain methods on the same campaigns

Plain methods answer every campaign that the diagnosis has answered; its search by BIC and without the gate is read
from the candidates that it tried. `python -m studies.challenge of=FOLDER count=100 publish=docs`, with its folder,
lets the diagnosis without whitening or repeats answer a hundred of its campaigns. Where fewer were answered, what the
diagnosis itself said of just these stands below.
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
_HEAD = (
    "who answers",
    "campaigns",
    "false alarms",
    "right, d >= 6",
    "confidently wrong, d >= 6",
    "unknown flagged",
    "95 % interval holds",
)


def of_answers(published: Sequence[Published]) -> str:
    """The section: who answers, and what that is worth."""
    answers: dict[str, list[Facts]] = {OWN: []}
    for p in published:
        answers.setdefault(p.about["ablation"], []).extend(p.rows)
        for name, rows in p.others.items():
            answers.setdefault(name, []).extend(rows)
    own = answers.pop(OWN)
    lines = [(_WHO[OWN], *_in_short(own))]
    for name in sorted(answers, key=lambda n: list(_WHO).index(n) if n in _WHO else len(_WHO)):
        rows = answers[name]
        answered = {(f.source, f.seed) for f in rows}
        same = [f for f in own if (f.source, f.seed) in answered]
        lines.append((_WHO.get(name, name), *_in_short(rows)))
        if len(same) < len(own):
            lines.append(("- the diagnosis on these", *_in_short(same)))
    return _TEXT + "\n" + table(_HEAD, lines)


def _in_short(rows: Sequence[Facts]) -> list[str]:
    nothing, large = of_kind(rows, "nothing"), of_kind(rows, "library", "two", least=SEEN)
    strange = [f for f in of_kind(rows, "outside") if (f.distance or 0) >= 8]
    flags = [[not f.right for f in nothing], [f.right for f in large], [confidently_wrong(f) for f in large]]
    flags += [[f.right for f in strange], [flag for f in rows for flag in f.covered]]
    return [str(len(rows)), *map(ranged, flags)]
