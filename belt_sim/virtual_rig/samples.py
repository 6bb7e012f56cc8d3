"""The sample campaigns of models/campaigns; `python -m belt_sim.virtual_rig.samples` writes them anew."""

from dataclasses import dataclass, field
from pathlib import Path

from belt_sim.si import MM
from belt_sim.virtual_rig.folder import run_virtual_rig
from belt_sim.virtual_rig.plan import Noise, Plan

FOLDER = Path("models/campaigns")
SPACING = 0.5  # [m], which keeps a sample small
MILD = Noise(white=0.01 * MM, wander_sd=0.03 * MM, zero=0.05 * MM, tension_rel=0.005)


@dataclass(frozen=True, kw_only=True)
class Sample:
    """Title, seed, base law and hidden effects of a sample."""

    title: str
    seed: int
    base: str
    hidden: list[dict] = field(default_factory=list)


SAMPLES = {
    "slack_belt": Sample(
        title="A steel belt at 7 to 40 N/mm2 after a yaw step",
        seed=7,
        base="beam_th2",
        hidden=[{"id": "sag_roll", "strength": 1.0}],
    ),
    "machine_fault": Sample(
        title="A steel belt on a machine that may have a fault",
        seed=12,
        base="strip",
        hidden=[{"id": "taper", "kappa_t": 4e-6}, {"id": "yaw_offset_tail", "beta_0": 1e-4}],
    ),
    "nothing_hidden": Sample(title="A steel belt on a machine in order", seed=3, base="strip"),
}


def write_samples(folder: str | Path = FOLDER) -> dict[str, str]:
    """Write all samples, replacing what is there; returns name -> SHA-256 of the truth."""
    plan = Plan(spacing=SPACING)
    return {
        name: run_virtual_rig(
            Path(folder) / name,
            hidden=sample.hidden,
            seed=sample.seed,
            base=sample.base,
            plan=plan,
            noise=MILD,
            title=sample.title,
            overwrite=True,
        )
        for name, sample in SAMPLES.items()
    }


if __name__ == "__main__":
    for written, sha256 in write_samples().items():
        print(f"{FOLDER / written}: truth {sha256}")
