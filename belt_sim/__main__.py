"""``belt-sim``, and ``python -m belt_sim``."""

import sys


def start() -> None:
    """Run the command line; Ctrl-C while it is loaded is told as Ctrl-C later."""
    try:
        from belt_sim.commands import cli

        cli.main()
    except KeyboardInterrupt:
        print("belt-sim: stopped before it began", file=sys.stderr)
        sys.exit(130)  # as shells have it


if __name__ == "__main__":  # processes that are spawned import this module anew
    start()
