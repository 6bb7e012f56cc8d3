"""belt-sim virtual-rig: a campaign with a hidden effect."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from belt_sim.campaign import Campaign
from belt_sim.case import GRAVITY
from belt_sim.commands.run_dir import RunDir
from belt_sim.config import belt_from, rig_from
from belt_sim.errors import InputError, whole
from belt_sim.virtual_rig import Truth, make_campaign, write_blind


def run(run_dir: RunDir) -> None:
    """Write a campaign with its sealed truth."""
    config: Any = run_dir.config
    if (config["engine"] == "mujoco" or config["plan"] is not None) and (asked := _machine_asked(run_dir)):
        raise InputError(
            asked[0], "", "", "goes with engine=line and plan=null; a plan brings its own machine and belt"
        )
    folder = Path(config["out"]) if config["out"] else run_dir.path / "campaign"
    hidden = config["hidden"]
    if hidden is None:
        raise InputError("hidden", "null", "", "write [] for nothing hidden, a list of effects, or random")
    if isinstance(hidden, str) and hidden != "random":
        hidden = [hidden]
    if config["engine"] == "line":
        campaign, truth = _line(hidden, config)
    elif config["engine"] == "mujoco":
        if config["plan"] is not None:
            raise InputError("plan", config["plan"], "", "needs engine=line")
        if folder.exists():
            raise InputError("out", folder, "", "exists already; choose another folder")
        from belt_sim.virtual_rig.space import make_space_campaign

        campaign, truth = make_space_campaign(hidden=hidden, seed=config["seed"], base=config["base"])
    else:
        raise InputError("engine", config["engine"], "", "use line or mujoco")
    if config["out"]:
        digest = write_blind(folder, campaign, truth)
    else:
        with run_dir.outputs() as draft:
            digest = write_blind(draft / "campaign", campaign, truth)
    print(f"campaign  {folder}")
    print(f"truth     sealed, sha256 {digest}")
    print(f"next      belt-sim diagnose campaign={folder}{_model(config)}, then belt-sim reveal campaign={folder}")


def _model(config: dict) -> str:
    """The law beside which an effect of one's own choice is to be sought; what is drawn at random is not told."""
    if config["hidden"] == "random" or config["engine"] != "line":
        return ""
    from belt_sim.virtual_rig.make import BASE

    return f" model={config['base'] or BASE}"


def _line(hidden: Any, config: dict) -> tuple[Campaign, Truth]:
    """On the test rig, on a random plan of a number, or, plan and all, at random."""
    from belt_sim.virtual_rig.random_campaigns import plan_by_number, random_campaign

    seed, base, plan = config["seed"], config["base"], config["plan"]
    if plan is None:
        return make_campaign(hidden=hidden, seed=seed, base=base, plan=_on_machine(config))
    if plan != "random":
        whole("plan", plan, 0, otherwise="random or ")
    if hidden == "random":
        if base is not None:
            raise InputError("base", base, "", "is drawn as well; leave it out")
        return random_campaign(seed, blind=None, plan=None if plan == "random" else plan)
    if plan == "random":
        raise InputError("plan", plan, "", "goes with hidden=random; give the number of a plan")
    _, chosen, noise = plan_by_number(plan)
    return make_campaign(hidden=hidden, seed=seed, base=base, plan=chosen, noise=noise)


def _machine_asked(run_dir: RunDir) -> list[str]:
    """Overrides of rig and belt on the command line."""
    return [o for o in run_dir.overrides if o.lstrip("+").startswith(("rig", "belt"))]


def _on_machine(config: dict) -> Any:
    """The runs of the test rig on the machine and belt that were asked for, known as surely as its own."""
    from belt_sim.virtual_rig.plan import TEST_BELT, TEST_RIG, Plan

    rig, belt = rig_from(config["rig"]), belt_from(config["belt"])
    if float(rig.gravity) != GRAVITY:
        raise InputError(
            "rig.gravity", f"{float(rig.gravity):g}", "m/s2", f"a campaign is measured on earth, {GRAVITY:g}"
        )
    machine = {n: replace(q, value=float(getattr(rig, n))) for n, q in vars(TEST_RIG).items()}
    sheet = {n: _alike(q, float(getattr(belt, n))) for n, q in vars(TEST_BELT).items()}
    return Plan(machine=replace(TEST_RIG, **machine), belt=replace(TEST_BELT, **sheet))


def _alike(known: Any, value: float) -> Any:
    """A quantity of another value, known to the same share of it."""
    return replace(known, value=value, u=known.u * value / known.value)
