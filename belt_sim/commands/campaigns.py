"""belt-sim new, import, virtual-rig and reveal: campaigns that are planned, logged or made up."""

import copy
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.prompt import Confirm, Prompt

from belt_sim import virtual_rig
from belt_sim.api.campaigns import import_files, tell_proposal
from belt_sim.campaign.folder import campaign_folder
from belt_sim.case import GRAVITY
from belt_sim.commands.runs import RunDir
from belt_sim.diagnosis.foresight import harm_warnings
from belt_sim.errors import BeltError, InputError, finite, whole
from belt_sim.importing.build import Proposal, understand
from belt_sim.importing.columns import DRAWING, LoggedTables
from belt_sim.importing.mapping import ROLES, Question
from belt_sim.importing.sheets import PLAN_COLUMNS, plan_for, plan_rows, template, travel_for
from belt_sim.io import group_names
from belt_sim.results.words import Table
from belt_sim.settings import BOUNDS, belt_from, rig_from
from belt_sim.show.terminal import progress, tell
from belt_sim.units import MM
from belt_sim.virtual_rig.make import BASE, plan_by_number, random_campaign
from belt_sim.virtual_rig.plan import TEST_BELT, TEST_RIG, Noise, Plan


def new_command(run_dir: RunDir) -> None:
    """Write an empty, commented campaign and say what each of its runs is good for. Raises BeltError."""

    def numbers(name: str, asked: Any, unit: str, most: float) -> list[float]:
        if not isinstance(asked, Sequence) or isinstance(asked, str) or not asked:
            raise InputError(name, asked, unit, "give a list, as [7,15,35]")
        remedy = f"give a number above 0 and up to {most:g}"
        return list(dict.fromkeys(finite(name, v, unit, remedy, lambda x: 0.0 < x <= most) for v in asked))

    config: Any = run_dir.config
    folder = Path(config["out"] or run_dir.path / "campaign")
    rig, belt = rig_from(config["rig"]), belt_from(config["belt"])
    tensions, yaw = config["tensions"], config["yaw"]
    if tensions is not None:
        tensions = sorted(numbers("tensions", tensions, "N/mm2", BOUNDS["tension"].high))
    if yaw is not None:
        yaw = numbers("yaw", [yaw], "degrees", BOUNDS["yaw"].high / 2.0)[0]
    travel = travel_for(rig)
    planned = plan_for(rig, belt, numbers("speed", [config["speed"]], "m/s", 25.0)[0], tensions, yaw)
    places = config["signals"] if isinstance(config["signals"], list) else [config["signals"]]
    campaign = template(folder, rig, belt, planned, [str(p) for p in places], travel, str(config["title"]))
    title = f"Runs to measure, {travel:g} m each"
    tell([Table(title, PLAN_COLUMNS, plan_rows(planned), left=("run", "good for"))], [])
    print(f"campaign  {folder}\n          campaign.yaml: replace what says REPLACE; plan.md: this table")
    print(f"next      belt-sim check campaign={folder} travel={travel:g}")
    for warning in harm_warnings(campaign):
        print(f"warning   {warning}")


def reveal_command(run_dir: RunDir) -> None:
    """Print the truth of a campaign of the virtual rig, checked against its published hash."""
    truth = virtual_rig.reveal(campaign_folder(run_dir.campaign))
    print(f"sha256 {truth.sha256()} matches")
    print(json.dumps(asdict(truth), indent=2))


def import_command(run_dir: RunDir) -> None:
    """Read, ask what is missing (in a terminal), show what was understood, and write the folder."""
    config = run_dir.config
    files = [config["files"]] if isinstance(config["files"], str | int | float) else config["files"]
    if not isinstance(files, list):
        raise InputError("files", files, "", "write file names after the command, or files=[a.csv,b.csv]")
    named = {key: None if config[key] is None else str(config[key]) for key in ("draft", "out")}
    for key in ("mapping", *named):
        if isinstance(config[key], bool | list):
            raise InputError(key, config[key], "", "write the name of a file (of a folder for out), or null")
    if named["draft"] is not None and (named["out"] is not None or config["overwrite"] is True):
        key = "out" if named["out"] is not None else "overwrite"
        raise InputError(key, named.get(key, "true"), "", "goes without draft, which writes no campaign")
    import_files(
        [str(f) for f in files],
        Path(named["out"] or run_dir.path / "campaign"),
        mapping=config["mapping"],
        draft=named["draft"],
        overwrite=config["overwrite"],
        pictures=config["pictures"],
        ask=ask_in_terminal if sys.stdin.isatty() and sys.stdout.isatty() else None,
    )


def ask_in_terminal(logged: LoggedTables, stated: dict[str, Any] | None = None, out: Console | None = None) -> Proposal:
    """The proposal with every question answered and confirmed by whoever sits at the terminal.

    Columns of which nothing is known are asked for too; ``ignore`` leaves them out. stated: the mapping as far as it is
    there already.
    """
    out = out or Console(highlight=False)
    mapping = copy.deepcopy(stated or {})
    proposal = understand(logged, mapping)
    tell_proposal(proposal)
    if any(q.path[-1] == "at" for q in (*proposal.missing, *proposal.unknown)):
        out.print(DRAWING, markup=False)
    while True:
        questions = [*proposal.missing, *proposal.unknown]
        if questions:
            proposal = _ask(logged, mapping, questions[0], out)
            continue
        tell_proposal(proposal)
        if Confirm.ask("Is this right?", console=out, default=True):
            return proposal
        columns = list(dict.fromkeys(c.name for table in logged for c in table.columns))
        runs = [r.name for r in proposal.complete().runs]
        out.print(escape(f"columns: {', '.join(columns)}; runs: {', '.join(runs)}"))
        name = Prompt.ask("Which column or run is wrong?", console=out, choices=[*columns, *runs], show_choices=False)
        keys = ["role", "unit", "at", "sign", "factor", "name"]
        keys = keys if name in columns else ["tension", "yaw", "speed", "direction", "yaw_at", "start"]
        key = Prompt.ask("What of it?", console=out, choices=keys)
        examples = {"role": ", ".join(ROLES), "at": "point_1 .. point_4", "sign": "-1", "factor": "0.001"}
        example = examples.get(key, "mm") if name in columns else "with its unit, as 10 N/mm2"
        path = ("columns" if name in columns else "runs", name, key)
        proposal = _ask(logged, mapping, Question(path=path, text=f"{name}: {key}?", example=example), out)


def _ask(logged: LoggedTables, mapping: dict[str, Any], question: Question, out: Console) -> Proposal:
    """Ask one question until the answer can be used; a machine or belt may be given by a name that is known."""
    kind = {"machine": "rig", "belt": "belt"}.get(question.path[0])
    hint = f", or the name of a {kind}: {', '.join(group_names(kind))}" if kind else ""
    while True:
        out.print(f"[bold]{escape(question.text)}[/bold] (e.g. {escape(question.example + hint)})")
        default: Any = question.proposed or ...
        numbers = {p.removeprefix("point_"): p for p in question.options if p.startswith("point_")}
        choices = [*question.options, *numbers] or None
        text = str(Prompt.ask("  ", console=out, choices=choices, default=default)).strip()
        text = numbers.get(text, text)
        trial = copy.deepcopy(mapping)
        if kind and text in group_names(kind):
            trial[question.path[0]] = text
        else:
            question.put(trial, text)
        try:
            proposal = understand(logged, trial)
        except BeltError as error:
            out.print(f"[red]{escape(str(error))}[/red]")
            continue
        mapping.clear()
        mapping.update(trial)
        return proposal


def rig_command(run_dir: RunDir) -> None:
    """Write a campaign with its sealed truth."""
    config: Any = run_dir.config
    engine, hidden, plan, base, quantum = (config[k] for k in ("engine", "hidden", "plan", "base", "quantum"))
    machine = next((o for o in run_dir.overrides if o.lstrip("+").startswith(("rig", "belt"))), "")
    folder, in_space, drawn = Path(config["out"] or run_dir.path / "campaign"), engine == "mujoco", hidden == "random"
    own = "goes with engine=line and plan=null; a plan brings its own machine and belt"
    steps = "goes with engine=line, plan=null and a list of what is hidden"
    for name, value, wrong, remedy in (
        (*machine.partition("=")[::2], machine and (in_space or plan is not None), own),
        ("hidden", "null", hidden is None, "write [] for nothing hidden, a list of effects, or random"),
        ("engine", engine, engine not in ("line", "mujoco"), "use line or mujoco"),
        ("quantum", f"{quantum} mm", quantum and (in_space or drawn or plan is not None), steps),
        ("plan", plan, plan is not None and in_space, "needs engine=line"),
        ("plan", plan, plan == "random" and not drawn, "goes with hidden=random; give the number of a plan"),
        ("base", base, base is not None and drawn and plan is not None, "is drawn as well; leave it out"),
        ("out", folder, in_space and folder.exists(), "exists already; choose another folder"),
    ):
        if wrong:
            raise InputError(name, value, "", remedy)
    hidden = [hidden] if isinstance(hidden, str) and not drawn else hidden
    if in_space:
        from belt_sim.effects.load import load_effects
        from belt_sim.virtual_rig.space import make_space_campaign, space_plan

        asked = {"hidden": hidden, "seed": config["seed"], "base": base}
        with progress(len(space_plan().runs), "measuring in 3D") as done:
            campaign, truth = make_space_campaign(load_effects, **asked, tell=done)
    else:
        campaign, truth = _by_line(hidden, config)
    if config["out"]:
        digest = virtual_rig.write_blind(folder, campaign, truth)
    else:
        with run_dir.outputs() as draft:
            digest = virtual_rig.write_blind(draft / "campaign", campaign, truth)
    print(f"campaign  {folder}")
    print(f"truth     sealed; its sha256:\n          {digest}")
    model = "" if drawn or in_space else f" model={base or BASE}"  # what is drawn at random is not told
    print(f"next      belt-sim diagnose campaign={folder}{model}\nthen      belt-sim reveal campaign={folder}")


def _by_line(hidden: Any, config: dict) -> Any:
    """A campaign and its truth: on the test rig, on a random plan of a number, or, plan and all, at random."""
    seed, base, plan = config["seed"], config["base"], config["plan"]
    quantum = MM * finite("quantum", config["quantum"], "mm", "give 0 or more, at most 10", lambda x: 0 <= x <= 10)
    if plan is None:  # on the machine and belt that were asked for, known as surely as the test rig's own
        rig, belt = rig_from(config["rig"]), belt_from(config["belt"])
        if float(rig.gravity) != GRAVITY:
            remedy = f"a campaign is measured on earth, {GRAVITY:g}"
            raise InputError("rig.gravity", f"{float(rig.gravity):g}", "m/s2", remedy)
        machine = {n: replace(q, value=float(getattr(rig, n))) for n, q in vars(TEST_RIG).items()}
        values = {n: float(getattr(belt, n)) for n in vars(TEST_BELT)}
        sheet = {n: replace(q, value=values[n], u=q.u * values[n] / q.value) for n, q in vars(TEST_BELT).items()}
        own = Plan(machine=replace(TEST_RIG, **machine), belt=replace(TEST_BELT, **sheet))
        return virtual_rig.make_campaign(hidden=hidden, seed=seed, base=base, plan=own, noise=Noise(quantum=quantum))
    number = None if plan == "random" else whole("plan", plan, 0, otherwise="random or ")
    if hidden == "random" or number is None:
        return random_campaign(seed, blind=None, plan=number)
    _, chosen, noise = plan_by_number(number)
    return virtual_rig.make_campaign(hidden=hidden, seed=seed, base=base, plan=chosen, noise=noise)
