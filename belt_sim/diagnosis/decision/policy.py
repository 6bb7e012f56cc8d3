"""Every constant of the decision."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Policy:
    """What is declared before any reading. All but ``chance`` are judgements; none is fitted to single campaigns.

    further: odds of one fault against one more, 1
    unknown: odds of no unknown law against one, 1
    decades: orders of magnitude below the largest plausible size, in which the size of a fault may lie
    per_decade: sizes that are tried in each of them
    chance: log evidence [nats] of a free input, its length and height chosen among 68, that chance exceeds in one of
        100 campaigns. It is the one number that was calibrated: 7.5 +- 1.5 on 97 campaigns in which nothing is hidden
    linear: share of a gain, to which the linear range is good: so far behind, a law is put into the march all the same
    held_out: -2 log of the predictive density, by which whole conditions that were left out may become less likely than
        with nothing
    alarm: probability of nothing, below which something is said: a false alarm costs twenty times what a miss does
    credible: probability in the set of explanations that cannot be told apart
    like_one_change_of_the_span: an error of the load cell does nearly what one change of a span's stiffness does, as a
        span knows its tension by F/EI and F/T; with it a crown or an edge guide makes up for a slope
    """

    further: float = 10.0
    unknown: float = 10.0
    decades: float = 3.0
    per_decade: int = 2
    chance: float = 7.0
    linear: float = 0.02
    held_out: float = 2.0
    alarm: float = 0.05
    credible: float = 0.95
    like_one_change_of_the_span: tuple[str, ...] = ("tension_bias", "crown", "edge_guide")


POLICY = Policy()
