"""belt-sim import: a logger's files -> a campaign."""

import sys
from pathlib import Path

from belt_sim.commands.import_prompt import ask_in_terminal
from belt_sim.commands.run_dir import RunDir
from belt_sim.errors import InputError
from belt_sim.use_cases.importing import import_files


def run(run_dir: RunDir) -> None:
    """Read, ask what is missing (in a terminal), show what was understood, and write the folder."""
    config = run_dir.config
    files = [config["files"]] if isinstance(config["files"], str | int | float) else config["files"]
    if not isinstance(files, list):
        raise InputError("files", files, "", "write file names after the command, or files=[a.csv,b.csv]")
    folder = Path(config["out"]) if config["out"] else run_dir.path / "campaign"
    import_files(
        [str(f) for f in files],
        folder,
        mapping=config["mapping"],
        draft=config["draft"],
        overwrite=bool(config["overwrite"]),
        pictures=bool(config["pictures"]),
        ask=ask_in_terminal if sys.stdin.isatty() and sys.stdout.isatty() else None,
    )
