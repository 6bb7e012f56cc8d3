"""How often the diagnosis is right: python -m studies.challenge count=40 first_seed=1000.

Sealed campaigns are answered, one result each is kept in the folder, and the table of targets is shown; stopped and run
again, it goes on.
"""

from pathlib import Path
from typing import Any

from studies.application import application


def challenge(config: dict[str, Any]) -> None:
    """Answer sealed campaigns, keep one result each in ``folder``, and show the table of targets."""
    from belt_sim.cores import cores
    from belt_sim.watch.progress import progress
    from studies.challenge.again import again
    from studies.challenge.asked import asked, how_many
    from studies.challenge.facts import facts_of
    from studies.challenge.publish import publish
    from studies.challenge.run import drawn_seeds, remaining, results, run_challenge
    from studies.challenge.sources import cost
    from studies.challenge.told import tell_targets, told

    first, how = asked(config, Path(config["folder"]))
    count = how_many(config)
    for task, seeds in again(first, count) if first.of else [(first, range(first.seed, first.seed + (count or 0)))]:
        todo = len(remaining(task, seeds))
        if todo and not task.of:
            print(cost(task.source, todo, how["workers"] or cores()), flush=True)
        if todo:
            with progress(todo, f"challenge {task.ablation}") as done:

                def tell(result: dict[str, Any]) -> None:
                    print(told(facts_of(result)), flush=True)
                    done(1, f"campaign {result['seed']}")

                run_challenge(task, seeds, **how, tell=tell)
        there = results(task.out)
        tell_targets([facts_of(result) for result in there], task.out)
        if config["publish"]:
            print(publish(there, Path(config["publish"]), Path(config["stored"]), drawn_seeds(task.out)))


if __name__ == "__main__":
    application("challenge", challenge)
