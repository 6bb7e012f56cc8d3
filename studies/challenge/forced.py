"""Whether searches that a diagnosis leaves out would change it: ``python -m studies.challenge.forced FOLDER[,MODEL]``.

Each campaign (several may follow) is diagnosed as it is, and with every search for laws made in full; a line each.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

import belt_sim as bs
from belt_sim.api.simulate import campaign_model
from belt_sim.diagnosis.decide import Decision
from belt_sim.errors import BeltError
from belt_sim.jax_setup import prepare
from studies.application import show_help


@contextmanager
def every_search() -> Iterator[list[bool]]:
    """Searches are made whatever they can change; yields, of every diagnosis, whether the rule would have made one."""
    names = ("suspects_something_unknown", "could_change", "most_of_a_law")
    rules, asked = {n: getattr(Decision, n) for n in names}, list[bool]()

    def search(decision: Decision, *given) -> bool:
        asked.append(rules[names[0]](decision, *given))
        return not decision.instead

    made = (search, lambda *_, **__: True, lambda *_, **__: float("inf"))
    for name, rule in zip(names, made, strict=True):
        setattr(Decision, name, rule)
    try:
        yield asked
    finally:
        for name, rule in rules.items():
            setattr(Decision, name, rule)


def describe(found: bs.Diagnosis) -> str:
    """Verdict, named effects, and the probability of something unknown."""
    unknown = sum(e.probability for e in found.considered if e.unknown)
    return f"{found.verdict.value} {'+'.join(e.id for e in found.effects) or '-'}, unknown {unknown:.2%}"


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
            plain = describe(diagnose())
            with every_search() as asked:
                full = describe(diagnose())
            search = "never asked" if not asked else "searched" if any(asked) else "left out"
            changed = "the same" if plain.split(",")[0] == full.split(",")[0] else "CHANGED"
            print(f"{name}: {search}: {plain} -> {full}: {changed}", flush=True)
    except BeltError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    show_help(__doc__)
    main()
