"""belt-sim virtual-rig: a campaign with a hidden effect."""

from pathlib import Path
from typing import Any

from belt_sim.commands.run_folder import plain, run_folder
from belt_sim.errors import InputError


def run(cfg: Any) -> None:
    """Write a campaign with its sealed truth."""
    config = plain(cfg)
    folder = Path(config["out"]) if config["out"] else run_folder() / "campaign"
    hidden = config["hidden"]
    if isinstance(hidden, str) and hidden != "random":
        hidden = [hidden]
    if config["engine"] == "line":
        digest = _line(folder, hidden, config)
    elif config["engine"] == "mujoco":
        if config["plan"] is not None:
            raise InputError("plan", config["plan"], "", "needs engine=line")
        from belt_sim.virtual_rig.space import run_space_rig

        digest = run_space_rig(folder, hidden=hidden, seed=config["seed"], base=config["base"])
    else:
        raise InputError("engine", config["engine"], "", "use line or mujoco")
    print(f"campaign  {folder}")
    print(f"truth     sealed, sha256 {digest}")
    print(f"next      belt-sim diagnose campaign={folder}, then belt-sim reveal campaign={folder}")


def _line(folder: Path, hidden: Any, config: dict) -> str:
    """On the test rig, on one of the plans by lot, or, plan and all, by lot."""
    from belt_sim.virtual_rig.folder import run_lot, run_virtual_rig
    from belt_sim.virtual_rig.lot_plans import plan_by_number

    seed, base, plan = config["seed"], config["base"], config["plan"]
    if plan is None:
        return run_virtual_rig(folder, hidden=hidden, seed=seed, base=base)
    if plan != "random" and (isinstance(plan, bool) or not isinstance(plan, int)):
        raise InputError("plan", plan, "", "give the number of a plan, or random")
    if hidden == "random":
        if base is not None:
            raise InputError("base", base, "", "is drawn as well; leave it out")
        return run_lot(folder, seed=seed, plan=None if plan == "random" else plan)
    if plan == "random":
        raise InputError("plan", plan, "", "goes with hidden=random; give the number of a plan")
    _, chosen, noise = plan_by_number(plan)
    return run_virtual_rig(folder, hidden=hidden, seed=seed, base=base, plan=chosen, noise=noise)
