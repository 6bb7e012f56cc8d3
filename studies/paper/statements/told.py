"""The statements as they are told: the table of verdicts, and what each criterion is."""

from collections.abc import Mapping

from studies.paper.models import LOOKS
from studies.paper.statements.judgement import CONTRADICTED, REPRODUCED, SILENT, Judgement
from studies.paper.statements.table import STATEMENTS
from studies.paper.tables import Cell, Table

KINDS = {REPRODUCED: "reproduced", CONTRADICTED: "contradicted", SILENT: "silent"}


def verdicts(judgements: Mapping[str, Mapping[str, Judgement]]) -> Table:
    """A row a statement, a column a model: the verdict and the number that it rests on."""
    models = list(next(iter(judgements.values())))
    rows = [
        (
            Cell(f"{name}: {STATEMENTS[name].about}"),
            *(Cell(_words(of[model]), KINDS[of[model].verdict]) for model in models),
        )
        for name, of in judgements.items()
    ]
    return Table(("", *(LOOKS[m].words for m in models)), tuple(rows))


def criteria() -> Table:
    """What the paper says, and what a model has to do."""
    rows = [(Cell(s.name), Cell(s.says), Cell(s.criterion)) for s in STATEMENTS.values()]
    return Table(("", "the paper", "criterion"), tuple(rows))


def _words(judgement: Judgement) -> str:
    return f"{judgement.verdict}: {judgement.number}" if judgement.number else judgement.verdict
