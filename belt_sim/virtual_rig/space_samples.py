"""The 3D campaigns of models/campaigns; `python -m belt_sim.virtual_rig.space_samples [name ...]` writes them anew.

Each takes minutes, so no test makes them anew.
"""

import argparse
from pathlib import Path

from belt_sim.virtual_rig.samples import FOLDER, Sample
from belt_sim.virtual_rig.space import run_space_rig

SPACE_SAMPLES = {
    "space_taper": Sample(
        title="A steel belt in three dimensions on a machine that may have a fault",
        seed=21,
        base="strip",
        hidden=[{"id": "taper", "kappa_t": 1.2e-4}],
    ),
    "space_gravity": Sample(
        title="A steel belt in three dimensions at 10 to 60 N/mm2",
        seed=22,
        base="beam_th2",
        hidden=[{"id": "sag_roll", "strength": 1.0}],
    ),
    "space_nothing": Sample(title="A steel belt in three dimensions on a machine in order", seed=23, base="strip"),
}


def write_space_sample(name: str, folder: str | Path = FOLDER) -> str:
    """Measure one 3D campaign and write it, replacing what is there; returns the SHA-256 of its truth."""
    sample = SPACE_SAMPLES[name]
    return run_space_rig(
        Path(folder) / name,
        hidden=sample.hidden,
        seed=sample.seed,
        base=sample.base,
        title=sample.title,
        overwrite=True,
    )


def main() -> None:
    """Write the named campaigns, or all."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("names", nargs="*", default=list(SPACE_SAMPLES), metavar="name")
    for name in parser.parse_args().names:
        print(f"{FOLDER / name}: truth {write_space_sample(name)}")


if __name__ == "__main__":
    main()
