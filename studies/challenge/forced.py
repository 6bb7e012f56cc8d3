"""Whether searches for laws that a diagnosis leaves out would change it: ``python -m studies.challenge.forced FOLDER``.

Each campaign (several folders may follow) is diagnosed as it is, and with every search made in full; a line each.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import belt_sim as bs
from belt_sim.diagnosis.decide import Decision
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
    prepare()
    quiet = {"advise": False, "progress": lambda *_: None}
    for folder in sys.argv[1:]:
        plain = describe(bs.diagnose(folder, **quiet))
        with every_search() as asked:
            full = describe(bs.diagnose(folder, **quiet))
        left_out = "left out" if asked == [False] else "searched"
        changed = "the same" if plain.split(",")[0] == full.split(",")[0] else "CHANGED"
        print(f"{folder}: {left_out}: {plain} -> {full}: {changed}", flush=True)


if __name__ == "__main__":
    show_help(__doc__)
    main()
