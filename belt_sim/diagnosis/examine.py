"""A diagnosis from end to end: adequacy, ranking, open set, confusables."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from belt_sim.analytic.composition import Composition
from belt_sim.campaign import Campaign, Suspicion, case_of, suspicions
from belt_sim.diagnosis.answer.confusable import Rival, rivals
from belt_sim.diagnosis.answer.verdict import Judgement, judged, verdict
from belt_sim.diagnosis.choice.decide import MAX_EFFECTS
from belt_sim.diagnosis.choice.refits import Trial
from belt_sim.diagnosis.choice.select import Selection, select
from belt_sim.diagnosis.errors.setting_up import set_up
from belt_sim.diagnosis.fits.workbench import Workbench, workbench
from belt_sim.diagnosis.left_over.openset import OpenSet
from belt_sim.diagnosis.left_over.unknown import Look
from belt_sim.effects.base import Effect
from belt_sim.results.verdict import Verdict

BOOTSTRAPS = 1000
FEWEST = 100  # where the data are damaged: nothing is chosen, and little depends on chance


def _long_enough(campaign: Campaign, cls: type[Effect]) -> bool:
    """Whether a record of the campaign covers the belt revolutions that an effect needs to be recognised."""
    longest = max((run.travel[-1] for run in campaign.runs if len(run.travel)), default=0.0)
    return longest >= cls.min_revolutions * case_of(campaign, campaign.runs[0]).rig.belt_length


@dataclass(frozen=True, kw_only=True)
class Findings:
    """What was found, with everything that was tried, on the workbench.

    bench: laid out at the base model; found: the selection; judgement: what of it stands; rivals: what the verdict
    cannot be told apart from.
    """

    bench: Workbench
    found: Selection
    judgement: Judgement
    rivals: list[Rival]
    suspicions: tuple[Suspicion, ...]
    verdict: Verdict

    @property
    def left(self) -> OpenSet:
        """The tests of what the named effects leave."""
        return self.judgement.left

    @property
    def ranking(self) -> list[Trial]:
        """Every candidate of the first round, best first."""
        return sorted(self.found.rounds[0], key=lambda t: -t.score) if self.found.rounds else []


def examine(
    campaign: Campaign,
    model: Composition,
    classes: Sequence[type[Effect]],
    *,
    bootstraps: int = BOOTSTRAPS,
    seed: int = 0,
    look: Look | None = None,
    tell: Callable[[str], None] = lambda text: None,
    tick: Callable[[int], None] = lambda n: None,
) -> Findings:
    """Which of ``classes`` the ``model`` lacks, judged on ``campaign``.

    look: tests for laws that no effect of the library is; tell hears what is being done, tick counts bootstrap
    replicates. Raises InputError when the campaign has no signals, RunFailed when a super-model fits worse than its
    sub-model.
    """
    tell("laying out the campaign")
    bench = workbench(campaign, model, [c for c in classes if model.refusal(c) is None and _long_enough(campaign, c)])
    base = bench.fit([bench.start((), bench.forward.null())])[0]
    suspect = set_up(bench, base.values, suspicions(campaign))
    damaged = any(s.severity == "stop" for s in suspect)  # then nothing is added: only what is there is judged
    limit = 0 if damaged else MAX_EFFECTS
    bootstraps = min(bootstraps, FEWEST) if damaged else bootstraps
    found = select(bench, base, bootstraps=bootstraps, seed=seed, limit=limit, tell=tell, tick=tick)
    tell("testing what is left")
    judgement = judged(found, bootstraps=max(200, bootstraps // 2), seed=seed, look=None if damaged else look)
    found, named = judgement.instead or found, judgement.named.ids
    pairs = [pair for pair in rivals(found) if pair.effect in named]
    return Findings(
        bench=bench,
        found=found,
        judgement=judgement,
        rivals=pairs,
        suspicions=tuple(suspect),
        verdict=verdict(judgement, suspect),
    )
