"""The campaigns of models/campaigns, written anew: python -m studies.samples names=[slack_belt]."""

from pathlib import Path
from typing import Any

from belt_sim.effects.load import load_effects
from belt_sim.units import MM, N_PER_MM2
from belt_sim.virtual_rig import make_campaign, write_blind
from belt_sim.virtual_rig.plan import TEST_TENSIONS, TEST_YAWS, Noise, Plan, grid
from belt_sim.virtual_rig.space import make_space_campaign
from studies.application import application

SPACING = 0.5  # [m], which keeps a sample small
MILD = Noise(white=0.01 * MM, wander_sd=0.03 * MM, zero=0.05 * MM, tension_rel=0.005)


SAMPLES: dict[str, dict[str, Any]] = {
    "slack_belt": {
        "title": "A steel belt at 7 to 40 N/mm2 after a yaw step", "seed": 7, "base": "beam_th2",
        "hidden": [{"id": "sag_roll", "strength": 1.0}],
    },
    "machine_fault": {
        "title": "A steel belt on a machine that may have a fault", "seed": 12, "base": "strip",
        "tensions": (20.0, 30.0, 40.0, 60.0),  # [N/mm2]: a cone that a gauge shows drives a slacker belt off
        "hidden": [{"id": "taper", "kappa_t": 1.5e-4}, {"id": "yaw_offset_tail", "beta_0": -3e-4}],
    },
    "nothing_hidden": {"title": "A steel belt on a machine in order", "seed": 3, "base": "strip", "hidden": []},
}  # fmt: skip
#: measured on the 3D belt: minutes each
SPACE_SAMPLES: dict[str, dict[str, Any]] = {
    "space_taper": {
        "title": "A steel belt in three dimensions on a machine that may have a fault", "seed": 21, "base": "strip",
        "hidden": [{"id": "taper", "kappa_t": 1.2e-4}],
    },
    "space_gravity": {
        "title": "A steel belt in three dimensions at 10 to 60 N/mm2", "seed": 22, "base": "beam_th2",
        "hidden": [{"id": "sag_roll", "strength": 1.0}],
    },
    "space_nothing": {
        "title": "A steel belt in three dimensions on a machine in order", "seed": 23, "base": "strip", "hidden": [],
    },
}  # fmt: skip


def write_sample(name: str, folder: Path) -> str:
    """Measure one campaign and write it, replacing what is there; returns the SHA-256 of its truth."""
    if name in SPACE_SAMPLES:
        campaign, truth = make_space_campaign(load_effects, **SPACE_SAMPLES[name])
    else:
        given = dict(SAMPLES[name])
        tensions = [t * N_PER_MM2 for t in given.pop("tensions", ())] or TEST_TENSIONS
        plan = Plan(runs=grid(tensions, TEST_YAWS), spacing=SPACING)
        campaign, truth = make_campaign(**given, plan=plan, noise=MILD)
    return write_blind(folder / name, campaign, truth, overwrite=True)


def samples(config: dict[str, Any]) -> None:
    """Write the named samples."""
    folder = Path(config["out"])
    for name in config["names"]:
        print(f"{folder / name}: truth {write_sample(name, folder)}")


if __name__ == "__main__":
    application("samples", samples)
