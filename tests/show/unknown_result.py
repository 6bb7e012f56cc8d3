"""A diagnosis that finds nothing it knows, told without the search for it."""

from dataclasses import replace

from small_campaign import drawn

from belt_sim.results.diagnosis import Diagnosis, Unknown, Verdict

SHAPE = Unknown(
    parity="even", tension_exponent=-1.0, onset=0.0, wavelength=None,
    nearest="crown", why="it fails at 7 N/mm2",
)  # fmt: skip


def unknown() -> Diagnosis:
    """The slack belt as if nothing of the library explained it."""
    return replace(drawn("sag_roll"), verdict=Verdict.NONE_KNOWN, effects=(), unknown=SHAPE, tied=(), considered=())
