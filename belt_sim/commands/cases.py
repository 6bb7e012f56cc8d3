"""The cases of a sweep, one by one: folder and configuration of each, whether it is done, how it is run."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hydra.core.hydra_config import HydraConfig
from hydra.core.singleton import Singleton
from hydra.core.utils import JobReturn, run_job, setup_globals
from omegaconf import OmegaConf, open_dict

from belt_sim.commands.run_folder import kept


@dataclass(frozen=True)
class Case:
    """One case of a sweep: its number, what the command line overrides, its folder, its configuration."""

    number: int
    overrides: Sequence[str]
    folder: Path
    config: Any

    def done(self) -> bool:
        """Whether its result is there."""
        return kept(self.folder, self.config)


@dataclass(frozen=True)
class Worker:
    """Runs cases, here or in another process: what Hydra needs for it."""

    context: Any
    config: Any
    task: Any
    singletons: Any

    def __call__(self, cases: Sequence[Case]) -> list[JobReturn]:
        Singleton.set_state(self.singletons)
        setup_globals()
        return [self.run(case) for case in cases]

    def configured(self, number: int, overrides: Sequence[str]) -> Any:
        """The whole configuration of a case."""
        config = self.context.config_loader.load_sweep_config(self.config, list(overrides))
        with open_dict(config.hydra.job):
            config.hydra.job.id, config.hydra.job.num = f"case_{number}", number
        return config

    def run(self, case: Case) -> JobReturn:
        """One case."""
        config = self.configured(case.number, case.overrides)
        return run_job(
            hydra_context=self.context,
            task_function=self.task,
            config=config,
            job_dir_key="hydra.sweep.dir",
            job_subdir_key="hydra.sweep.subdir",
        )

    def cases(self, job_overrides: Sequence[Sequence[str]], first: int) -> list[Case]:
        """The cases of these overrides, numbered from ``first``."""
        return [self._case(first + k, overrides) for k, overrides in enumerate(job_overrides)]

    def _case(self, number: int, overrides: Sequence[str]) -> Case:
        config = self.configured(number, overrides)
        before = HydraConfig.instance().cfg
        HydraConfig.instance().set_config(config)  # a folder's name may depend on the job
        try:
            folder = Path(config.hydra.sweep.dir) / str(config.hydra.sweep.subdir)
            with open_dict(config):
                del config["hydra"]
            return Case(number, overrides, folder, OmegaConf.to_container(config, resolve=True))
        finally:
            HydraConfig.instance().cfg = before
