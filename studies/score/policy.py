"""Every constant of the score."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Policy:
    """What is declared before any reading; nothing of it is fitted to campaigns.

    further: odds of one fault against one more, 1 [diagnosis.choice.decide.ODDS: 2 ln 10]
    unknown: odds of no unknown law against one, 1 [as today: one known fault is ten times likelier]
    decades: orders of magnitude below the largest plausible size, in which a fault's size may lie
    per_decade: sizes that are tried in each of them
    scanned: nats that the length and the height of a free course cost, which are the best of 4 times 17
    held_out: -2 log of the predictive density, by which whole conditions that were left out may become less likely than
        with nothing: the one threshold of the check
    alarm: probability of nothing, below which something is said: a false alarm costs twenty times what a miss does
    credible: of the probability, in the set that is told as not to be told apart
    """

    further: float = 10.0
    unknown: float = 10.0
    decades: float = 3.0
    per_decade: int = 2
    scanned: float = 2.0
    held_out: float = 2.0
    alarm: float = 0.05
    credible: float = 0.95
