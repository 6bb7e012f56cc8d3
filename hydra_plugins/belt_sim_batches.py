"""What belt_sim adds to Hydra's sweeps: a launcher that runs 3D cases in batches, and a sweeper that composes once."""

import copy
from collections.abc import Sequence
from functools import partial
from typing import Any

from hydra._internal.config_loader_impl import get_overrides_dirname
from hydra._internal.core_plugins.basic_launcher import BasicLauncher
from hydra._internal.core_plugins.basic_sweeper import BasicSweeper
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.plugins import Plugins
from hydra.core.utils import JobReturn, configure_log, run_job, setup_globals
from omegaconf import DictConfig, OmegaConf, open_dict

Case = Sequence[str]  # overrides of one case


class CaseSweeper(BasicSweeper):
    """Hydra's BasicSweeper; before a sweep begins it composes one case of each choice of groups.

    Hydra composes all cases twice, 40 ms each; values of a key cannot make the composition fail, names of groups can.
    """

    def validate_batch_is_legal(self, batch: Sequence[Case]) -> None:
        """Raise Hydra's errors for the first case that cannot be composed."""
        assert self.config is not None
        groups = set(self.config.hydra.runtime.choices)
        split = [[override.partition("=") for override in case] for case in batch]
        kinds = [tuple((key, value if key.lstrip("+") in groups else "") for key, _, value in case) for case in split]
        super().validate_batch_is_legal(list(dict(zip(reversed(kinds), reversed(batch), strict=True)).values()))


class BatchLauncher(BasicLauncher):
    """Cases of engine=mjx and quasi_static at once on a GPU or shared over the cores; all others one after another.

    batch: cases at once, "auto" for as many as fit a GPU; workers: processes on a CPU, None for one a core.
    """

    def __init__(self, batch: Any = "auto", workers: Any = None) -> None:
        super().__init__()
        self.batch, self.workers = batch, workers
        self._kind: list[tuple[str, str]] = []  # of the case that was composed last
        self._last: DictConfig = OmegaConf.create()

    def launch(self, job_overrides: Sequence[Case], initial_job_idx: int) -> Sequence[JobReturn]:
        """Run the cases and return what became of each."""
        from belt_sim.commands.runs import ON_ONE_CORE, prepare_jax
        from belt_sim.errors import whole

        assert self.config is not None
        setup_globals()
        configure_log(self.config.hydra.hydra_logging, self.config.hydra.verbose)
        size = None if self.batch == "auto" else whole("hydra.launcher.batch", self.batch, otherwise="auto or ")
        if self.workers is not None:
            whole("hydra.launcher.workers", self.workers, otherwise="null or ")
        if all(self._setting(case, "engine") in (None, *ON_ONE_CORE) for case in job_overrides):
            return [self._launch_one(case, initial_job_idx + k) for k, case in enumerate(job_overrides)]
        prepare_jax(space=True)
        import jax

        if size is None and jax.default_backend() == "cpu":
            return self._share_over_cores(job_overrides, initial_job_idx)
        return self._launch_batches(job_overrides, initial_job_idx, size)

    def _setting(self, case: Case, key: str) -> Any:
        typed = dict(override.lstrip("+").split("=", 1) for override in case if "=" in override)
        return typed.get(key, OmegaConf.select(self.config, key))

    def _launch_one(self, case: Case, number: int, **given: Any) -> JobReturn:
        """One case, with what its task takes beside its configuration."""
        from belt_sim.commands.runs import failing_alike
        from belt_sim.errors import BeltError

        assert self.config is not None
        assert self.hydra_context is not None
        assert self.task_function is not None
        if why := failing_alike(self.config.hydra):
            raise BeltError(why)
        return run_job(
            hydra_context=self.hydra_context,
            task_function=partial(self.task_function, **given) if given else self.task_function,
            config=self._compose(case, number),
            job_dir_key="hydra.sweep.dir",
            job_subdir_key="hydra.sweep.subdir",
        )

    def _compose(self, case: Case, number: int) -> DictConfig:
        """The configuration of a case: composed, or the last one with other numbers, in a third of the time."""
        assert self.config is not None
        assert self.hydra_context is not None
        parsed = OverridesParser.create().parse_overrides(list(case))
        groups = set(self.config.hydra.runtime.choices)
        kind = [(o.get_key_element(), str(o.value()) if o.key_or_group in groups else "") for o in parsed]
        alike = kind == self._kind and not any(o.is_hydra_override() or o.is_delete() for o in parsed)
        if alike and not any(isinstance(o.value(), dict) for o in parsed):  # which would be merged
            config = copy.deepcopy(self._last)
            for override in (o for o in parsed if o.key_or_group not in groups):
                OmegaConf.update(config, override.key_or_group, override.value(), merge=True)
            with open_dict(config):
                config.hydra.overrides.task = list(case)
                manner = config.hydra.job.config.override_dirname
                config.hydra.job.override_dirname = get_overrides_dirname(parsed, **manner)
        else:
            config = self.hydra_context.config_loader.load_sweep_config(self.config, list(case))
            self._kind, self._last = kind, copy.deepcopy(config)
        with open_dict(config):
            config.hydra.job.id = config.hydra.job.num = number
        return config

    def _share_over_cores(self, cases: Sequence[Case], first: int) -> Sequence[JobReturn]:
        from belt_sim.jax_setup import cores

        workers = min(self.workers or cores(), len(cases))
        if workers == 1:
            return [self._launch_one(case, first + k) for k, case in enumerate(cases)]
        settings = {"_target_": "hydra_plugins.hydra_joblib_launcher.joblib_launcher.JoblibLauncher", "n_jobs": workers}
        config = self.config.copy()  # type: ignore[union-attr]
        with open_dict(config):
            config.hydra.launcher = settings
        launcher = Plugins.instance().instantiate_launcher(
            hydra_context=self.hydra_context, task_function=self.task_function, config=config
        )
        return launcher.launch(cases, first)

    def _launch_batches(self, cases: Sequence[Case], first: int, size: int | None) -> Sequence[JobReturn]:
        """Cases of like meshes in batches, each then in its folder; what is done, or what no batch takes, alone."""
        from belt_sim.api.simulate import run_in_batches
        from belt_sim.commands.runs import RunDir

        assert self.hydra_context is not None
        due = []
        for k, case in enumerate(cases):
            config = self._compose(case, first + k)
            run = RunDir.of_hydra(config, config.hydra, "simulate")
            if run.why_not_done() is not None:
                due.append((k, run.config))
        numbers, configs = [k for k, _ in due], [config for _, config in due]
        returns: dict[int, JobReturn] = {}
        for among, curves in run_in_batches(configs, size):
            if len(among) > 1 and curves[0] is not None:
                print(f"{len(among)} cases at once", flush=True)
            for j, computed in zip(among, curves, strict=True):
                returns[numbers[j]] = self._launch_one(cases[numbers[j]], first + numbers[j], computed=computed)
        for k, case in enumerate(cases):
            if k not in returns:
                returns[k] = self._launch_one(case, first + k)
        return [returns[k] for k in range(len(cases))]
