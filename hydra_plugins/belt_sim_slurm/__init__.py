"""Where Hydra looks for launchers: hydra/launcher=slurm."""

from belt_sim.commands.slurm import Slurm


class SlurmLauncher(Slurm):
    """belt_sim.commands.slurm.Slurm, under the name that Hydra asks for."""
