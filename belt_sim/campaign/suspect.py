"""What looks wrong in a campaign's data."""

from dataclasses import dataclass
from typing import Literal

SuspicionKind = Literal[
    "unit_slip", "clipped", "swapped", "wrong_sign", "dropout", "shifted", "zero", "same_place", "guided"
]
Severity = Literal["stop", "look"]


@dataclass(frozen=True, kw_only=True)
class Suspicion:
    """run and signal: where (None: all of them; two signals as "y1 and y4"); sentence: what was seen."""

    run: str | None
    signal: str | None
    kind: SuspicionKind
    sentence: str
    severity: Severity = "stop"
