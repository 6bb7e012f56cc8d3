"""All statements, all models."""

from studies.paper.statements.behaviour import behaviours
from studies.paper.statements.judgement import Judgement, judged
from studies.paper.statements.m1 import M1
from studies.paper.statements.m2 import M2
from studies.paper.statements.m3 import M3, M3_READ
from studies.paper.statements.m4 import M4
from studies.paper.statements.m5 import M5
from studies.paper.statements.m6 import M6

STATEMENTS = {s.name: s for s in (M1, M2, M3, M3_READ, M4, M5, M6)}


def judgements(*, in_space: bool) -> dict[str, dict[str, Judgement]]:
    """By statement and model; with the stored belt in 3D where it is wanted."""
    return judged(STATEMENTS, behaviours(in_space=in_space))
