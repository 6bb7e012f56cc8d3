"""Whether searches that a diagnosis leaves out would change it: ``python -m studies.challenge.forced FOLDER[,MODEL]``.

Each campaign (several may follow) is diagnosed with every search for laws made in full; a line each says what would be
decided as the rule has it, and by which share of their difference in fit a search lifts something unknown.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

import belt_sim as bs
from belt_sim.api.simulate import campaign_model
from belt_sim.diagnosis.decide import Decision, EvidenceTable, Policy
from belt_sim.errors import BeltError
from belt_sim.jax_setup import prepare
from studies.application import show_help

#: whether the rule would have searched, what is decided without that, and set of effects beside which a law is
#: fitted -> the bound of the probability of something unknown
Asked = tuple[bool, Decision, dict[frozenset[str], float]]


@contextmanager
def every_search() -> Iterator[list[Asked]]:
    """Searches are made whatever they can change; yields what is asked in every diagnosis."""
    names = ("suspects_something_unknown", "could_change")
    rules, asked = {n: getattr(Decision, n) for n in names}, list[Asked]()

    def search(decision: Decision, table: EvidenceTable, policy: Policy) -> bool:
        there = {b.ids for b in table.unknown}.intersection(decision.law_sets(table))
        bounds = {ids: decision.most_probable_unknown(table, ids, policy) for ids in there}
        asked.append((rules[names[0]](decision, table, policy), decision, bounds))
        return not decision.instead

    made = (search, lambda *_, **__: True)
    for name, rule in zip(names, made, strict=True):
        setattr(Decision, name, rule)
    try:
        yield asked
    finally:
        for name, rule in rules.items():
            setattr(Decision, name, rule)


def describe(found: bs.Diagnosis | Decision) -> str:
    """Verdict, named effects, and the probability of something unknown."""
    if isinstance(found, Decision):
        rows, names = found.explanations, list(found.named)
    else:
        rows, names = found.considered, [e.id for e in found.effects]
    unknown = sum(e.probability for e in rows if e.unknown)
    return f"{found.verdict.value} {'+'.join(sorted(names)) or '-'}, unknown {unknown:.2%}"


def rises(decision: Decision, bounds: dict[frozenset[str], float], found: bs.Diagnosis) -> str:
    """How far behind the likeliest row each row of something unknown beside fewer effects is, and how far a search
    lifted it, as shares of the difference of their fits; the bound of the probability of something unknown."""
    best, said = decision.explanations[0], []
    after = {e.effects: e for e in found.considered if e.unknown}
    for e in decision.explanations:
        if e.unknown and frozenset(e.effects) in bounds and set(e.effects) < set(best.effects) and e.effects in after:
            apart = best.likelihood - e.likelihood
            behind, rise = best.log_posterior - e.log_posterior, after[e.effects].log_posterior - e.log_posterior
            name = "+".join(e.effects) or "-"
            said.append(f"{name}: {behind / apart:.2%} behind, {rise / apart:+.2%} of {apart:.0f}")
            said[-1] += f", unknown at most {bounds[frozenset(e.effects)]:.2%}"
    return "; ".join(said) or "no row beside fewer effects"


def main() -> None:
    """Diagnose, compare, print."""
    if not sys.argv[1:]:
        print(__doc__, file=sys.stderr)
        sys.exit(2)
    prepare()
    try:
        given = [argument.partition(",") for argument in sys.argv[1:]]
        asked_for = [(name, bs.load_campaign(name), model) for name, _, model in given]
        for _, campaign, model in asked_for:  # before any long work
            campaign_model(model or None, campaign)
        for name, campaign, model in asked_for:
            diagnose = partial(bs.diagnose, campaign, model or None, advise=False, progress=lambda *_: None)
            with every_search() as asked:
                found = diagnose()
            never: list[tuple[bool, Decision | None, dict[frozenset[str], float]]] = [(True, None, {})]
            for searched, decision, bounds in asked or never:
                plain, full = describe(diagnose() if searched or decision is None else decision), describe(found)
                search = "never asked" if not asked else "searched" if searched else "left out"
                changed = "the same" if plain.split(",")[0] == full.split(",")[0] else "CHANGED"
                rose = "" if decision is None else f" ({rises(decision, bounds, found)})"
                print(f"{name}: {search}: {plain} -> {full}: {changed}{rose}", flush=True)
    except BeltError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    show_help(__doc__)
    main()
