"""A statement of the paper, and what judging a model by it gives."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from studies.paper.statements.behaviour import Behaviour

REPRODUCED, CONTRADICTED, SILENT = "reproduced", "contradicted", "not addressed"


@dataclass(frozen=True)
class Judgement:
    """verdict: one of the three words; number: what it rests on, as it is written, with its unit."""

    verdict: str
    number: str = ""

    @staticmethod
    def of(met: bool, number: str) -> "Judgement":
        """Reproduced where the criterion is met."""
        return Judgement(REPRODUCED if met else CONTRADICTED, number)


NOT_ADDRESSED = Judgement(SILENT)

Judge = Callable[[Behaviour, Behaviour], Judgement]  # (a model, the beam of 2nd order)


@dataclass(frozen=True, kw_only=True)
class Statement:
    """name, as M2; about: in a few words; says: the paper's statement; criterion: what a model has to do, in words;
    judge: does it."""

    name: str
    about: str
    says: str
    criterion: str
    judge: Judge


def judged(statements: Mapping[str, Statement], models: Mapping[str, Behaviour]) -> dict[str, dict[str, Judgement]]:
    """Judgements by statement and model."""
    beam = models["beam_th2"]
    return {key: {name: s.judge(model, beam) for name, model in models.items()} for key, s in statements.items()}
