"""Where Hydra looks for launchers: hydra/launcher=batches, which simulate takes by itself."""

from belt_sim.commands.batches import Batches


class BatchLauncher(Batches):
    """belt_sim.commands.batches.Batches, under the name that Hydra asks for."""
