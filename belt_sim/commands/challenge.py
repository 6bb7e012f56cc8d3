"""belt-sim challenge: how often the diagnosis is right."""

from typing import Any

from belt_sim.commands.run_folder import plain, run_folder


def run(cfg: Any) -> None:
    """Answer sealed campaigns, keep one result each in the run folder, and show the table of targets."""
    from belt_sim.challenge.asked import asked
    from belt_sim.challenge.facts import facts_of
    from belt_sim.challenge.publish import publish
    from belt_sim.challenge.run import remaining, results, run_challenge
    from belt_sim.challenge.told import tell_targets, told
    from belt_sim.watch.progress import progress

    config, folder = plain(cfg), run_folder()
    first, how = asked(config, folder)
    todo = len(remaining(first, config["count"]))
    if todo:
        with progress(todo, "challenge") as done:

            def tell(result: dict[str, Any]) -> None:
                print(told(facts_of(result)), flush=True)
                done(1, f"campaign {result['seed']}")

            run_challenge(first, config["count"], **how, tell=tell)
    there = results(folder)
    tell_targets([facts_of(result) for result in there], folder)
    if config["publish"]:
        print(publish(there, str(config["publish"]), config))
