"""All statements, all models."""

from belt_sim.gallery.statements.behaviour import behaviours
from belt_sim.gallery.statements.judgement import Judgement, judged
from belt_sim.gallery.statements.m1 import M1
from belt_sim.gallery.statements.m2 import M2
from belt_sim.gallery.statements.m3 import M3, M3_READ
from belt_sim.gallery.statements.m4 import M4
from belt_sim.gallery.statements.m5 import M5
from belt_sim.gallery.statements.m6 import M6

STATEMENTS = {s.name: s for s in (M1, M2, M3, M3_READ, M4, M5, M6)}


def judgements(*, in_space: bool) -> dict[str, dict[str, Judgement]]:
    """By statement and model; with the stored belt in 3D where it is wanted."""
    return judged(STATEMENTS, behaviours(in_space=in_space))
