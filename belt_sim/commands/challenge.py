"""belt-sim challenge: how often the diagnosis is right."""

from typing import Any

from belt_sim.commands.run_folder import plain, run_folder


def run(cfg: Any) -> None:
    """Answer sealed campaigns, keep one result each in the run folder, and show the table of targets."""
    from belt_sim.challenge.again import again
    from belt_sim.challenge.asked import asked, how_many
    from belt_sim.challenge.facts import facts_of
    from belt_sim.challenge.publish import publish
    from belt_sim.challenge.run import drawn_seeds, remaining, results, run_challenge
    from belt_sim.challenge.sources import cost
    from belt_sim.challenge.told import tell_targets, told
    from belt_sim.cores import cores
    from belt_sim.watch.progress import progress

    config, folder = plain(cfg), run_folder()
    first, how = asked(config, folder)
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
            print(publish(there, str(config["publish"]), drawn_seeds(task.out)))
