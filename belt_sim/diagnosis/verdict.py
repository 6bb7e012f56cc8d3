"""From what was found and what is left to the verdict."""

from collections.abc import Sequence

from belt_sim.campaign import Suspicion
from belt_sim.diagnosis.openset import OpenSet
from belt_sim.results.verdict import Verdict


def verdict(ids: Sequence[str], test: OpenSet, suspicions: Sequence[Suspicion]) -> Verdict:
    """The verdict when ``ids`` were chosen, ``test`` looked at what they leave, and the data showed ``suspicions``."""
    if any(s.severity == "stop" for s in suspicions):
        return Verdict.CANNOT_SAY
    if not ids:
        return Verdict.NONE_KNOWN if test.failed else Verdict.ADEQUATE
    return Verdict.PARTLY if test.failed else Verdict.EXPLAINED


def damage(suspicions: Sequence[Suspicion]) -> str:
    """The gravest of what looks wrong in the data, in a sentence; empty when nothing does."""
    return min(suspicions, key=lambda s: s.severity != "stop").sentence if suspicions else ""
