"""``python -m belt_sim`` is ``belt-sim``."""

from belt_sim.commands.cli import main

if __name__ == "__main__":  # processes that are spawned import this module anew
    main()
