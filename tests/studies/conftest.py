"""``configuration`` gives the settings of a study as its command line would."""

import pytest
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf

from belt_sim.io import CONF
from studies.application import HERE


@pytest.fixture
def configuration():
    def composed(name: str, *overrides: str) -> dict:
        with initialize_config_dir(str(HERE / "conf"), version_base="1.3"):
            cfg = compose(name, overrides=[f"hydra.searchpath=[file://{CONF}]", *overrides])
        return OmegaConf.to_container(cfg, resolve=True, throw_on_missing=True)

    return composed
