"""The verdict, in one word and one sentence."""

from collections.abc import Sequence

from belt_sim.campaign import Suspicion
from belt_sim.diagnose.openset import OpenSet


def verdict(ids: Sequence[str], test: OpenSet, suspicions: Sequence[Suspicion]) -> str:
    """adequate | explained | partly | none_known | cannot_say."""
    if any(s.severity == "stop" for s in suspicions):
        return "cannot_say"
    if not ids:
        return "none_known" if test.failed else "adequate"
    return "partly" if test.failed else "explained"


def _gravest(suspicions: Sequence[Suspicion]) -> str:
    return min(suspicions, key=lambda s: s.severity != "stop").sentence


def sentence(word: str, model: str, ids: Sequence[str], suspicions: Sequence[Suspicion]) -> str:
    """The verdict as people would say it."""
    names = " and ".join(ids)
    if word == "cannot_say":
        return f"The data look damaged, so no effect is named: {_gravest(suspicions)}"
    return {
        "adequate": f"Nothing is missing from model {model} that these measurements could show.",
        "explained": f"Model {model} lacks {names}; with it, nothing is left that these measurements could show.",
        "partly": f"Model {model} lacks {names}, and something else that is not in the library.",
        "none_known": f"Model {model} is wrong here, and no effect of the library explains how.",
    }[word]
