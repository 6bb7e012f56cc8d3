"""The verdict of a diagnosis: one of five words, and the only place of the sentences that go with them."""

from collections.abc import Sequence
from enum import StrEnum

from belt_sim.results.words import listed


class Verdict(StrEnum):
    """What a diagnosis says of the base model."""

    ADEQUATE = "adequate"
    EXPLAINED = "explained"
    PARTLY = "partly"
    NONE_KNOWN = "none_known"
    CANNOT_SAY = "cannot_say"

    @property
    def headline(self) -> str:
        """The verdict as a headline of two to four words."""
        return _HEADLINES[self]

    @property
    def rejects_model(self) -> bool:
        """True when even the final model fails, so that its fitted values are no physical constants."""
        return self not in (Verdict.ADEQUATE, Verdict.EXPLAINED)

    def sentence(self, model: str, effects: Sequence[str], damage: str = "") -> str:
        """The verdict as people would say it; damage: what looks wrong in the data."""
        return _SENTENCES[self].format(model=model, effects=listed(effects), damage=damage)


_HEADLINES = {
    Verdict.ADEQUATE: "Nothing is missing",
    Verdict.EXPLAINED: "Explained",
    Verdict.PARTLY: "Explained in part",
    Verdict.NONE_KNOWN: "Something unknown is missing",
    Verdict.CANNOT_SAY: "This campaign cannot say",
}
_SENTENCES = {
    Verdict.ADEQUATE: "Nothing is missing from model {model} that these measurements could show.",
    Verdict.EXPLAINED: "Model {model} lacks {effects}; with it, nothing is left that these measurements could show.",
    Verdict.PARTLY: "Model {model} lacks {effects}, and something else that is not in the library.",
    Verdict.NONE_KNOWN: "Model {model} is wrong here, and no effect of the library explains how.",
    Verdict.CANNOT_SAY: "The data look damaged, or the sheet is wrong, so no effect is named: {damage}",
}


def other_model(model: str, better: str) -> str:
    """The sentence where another base model of the house explains what this one does not."""
    return f"Model {model} is wrong here, and model {better} explains what it does not: use model={better}."
