"""The search for an unknown law from end to end: where something acts, which law, and how that does in the march."""

from collections.abc import Callable
from dataclasses import dataclass

from belt_sim.discovery.latent_input import LatentInput
from belt_sim.discovery.march_fit import CloseLaw, MarchFit, best_in_march
from belt_sim.discovery.search_data import SearchData
from belt_sim.discovery.selection import LawChoice, choose_law

FEWEST = 3  # runs, below which no law is guessed
DESCRIBED = 0.7  # of what a latent input explains; a law that explains less does not describe it


@dataclass(frozen=True, kw_only=True)
class SearchOutcome:
    """What a search has found.

    data: of the search; latent_inputs: of all places, by evidence (none where nothing was sought); choice: None where
    nothing is missing; best: None where no law describes it; close: laws that the readings cannot tell from it.
    """

    data: SearchData
    latent_inputs: tuple[LatentInput, ...]
    choice: LawChoice | None = None
    best: MarchFit | None = None
    close: tuple[CloseLaw, ...] = ()

    @property
    def latent(self) -> LatentInput:
        """The latent input of greatest evidence; where a law was found, of those at its place, but for a stretch of the
        belt, which is nowhere along the travel."""
        place = None if self.best is None else self.best.scored.law.terms[0].place
        if place is None or place.is_stretch:
            return self.latent_inputs[0]
        if place.is_carried:
            return self.data.latent_inputs_at(place)[0]
        return next(c for c in self.latent_inputs if c.place.name == place.name)


def search_law(data: SearchData, tell: Callable[[str], None] = lambda text: None) -> SearchOutcome:
    """Search the law of what is missing beside a fit; something is missing."""
    if len(data.bench.samples.runs) < FEWEST:
        return SearchOutcome(data=data, latent_inputs=())
    tell("looking for the law of what is left")
    latent_inputs = tuple(data.latent_inputs())
    choice = choose_law(data, latent_inputs[0])
    enough = DESCRIBED * choice.possible
    if choice.best.gain < enough:
        return SearchOutcome(data=data, latent_inputs=latent_inputs, choice=choice)
    best, close = best_in_march(data, choice, latent_inputs[0], enough)
    return SearchOutcome(data=data, latent_inputs=latent_inputs, choice=choice, best=best, close=close)
