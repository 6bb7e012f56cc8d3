"""The folder of one run: where its files go, and whether it was done before."""

import json
from pathlib import Path
from typing import Any

from hydra.core.hydra_config import HydraConfig
from omegaconf import OmegaConf

from belt_sim.provenance import config_hash


def run_folder() -> Path:
    """The folder that Hydra made for this run."""
    return Path(HydraConfig.get().runtime.output_dir)


def job_title(config: dict[str, Any]) -> str:
    """What a run is called while it runs; in a sweep with its number, as several may run at once."""
    title = f"{config['model']['name']}, {float(config['tension']):g} N/mm2"
    hydra = HydraConfig.get()
    in_sweep = hydra.mode is not None and hydra.mode.name == "MULTIRUN"
    return f"{title}, job {hydra.job.num}" if in_sweep else title


def plain(cfg: Any) -> dict[str, Any]:
    """The resolved configuration as plain dicts and lists."""
    return OmegaConf.to_container(cfg, resolve=True, throw_on_missing=True)  # type: ignore[return-value]


def done_before(folder: Path, config: dict[str, Any]) -> bool:
    """True when a sweep already left this very result here (same configuration): it need not run again."""
    mode = HydraConfig.get().mode
    if mode is None or mode.name != "MULTIRUN":
        return False
    if not kept(folder, config):
        return False
    (folder / "summary.json").touch()  # it belongs to this sweep too
    return True


def kept(folder: Path, config: Any) -> bool:
    """Whether the folder holds the result of this very configuration."""
    try:
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return bool(summary.get("provenance", {}).get("config_sha256") == config_hash(config))
