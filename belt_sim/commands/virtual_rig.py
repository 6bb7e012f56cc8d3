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
        from belt_sim.virtual_rig.folder import run_virtual_rig

        digest = run_virtual_rig(folder, hidden=hidden, seed=config["seed"], base=config["base"])
    elif config["engine"] == "mujoco":
        from belt_sim.virtual_rig.space import run_space_rig

        digest = run_space_rig(folder, hidden=hidden, seed=config["seed"], base=config["base"])
    else:
        raise InputError("engine", config["engine"], "", "use line or mujoco")
    print(f"campaign  {folder}")
    print(f"truth     sealed, sha256 {digest}")
    print(f"next      belt-sim diagnose campaign={folder}, then belt-sim reveal campaign={folder}")
