"""Every command that a page asks a reader to type can be put together; those marked so are run, and print what the
page says that they print."""

import importlib.util
import re
import sys
from typing import Any

import pytest
from hydra import compose, initialize_config_dir
from hydra.core.override_parser.overrides_parser import OverridesParser
from omegaconf.errors import MissingMandatoryValue
from pages import PAGES, Command, commands, missing, name

from belt_sim.api.simulate import model_of
from belt_sim.commands import COMMANDS
from belt_sim.commands.cli import quote_override, run_command
from belt_sim.commands.runs import plain_settings
from belt_sim.effects.load import load_classes
from belt_sim.io import CAMPAIGNS, CONF, ROOT
from belt_sim.model import BY_TENSION
from belt_sim.settings import case_from
from studies.application import FIXED

ALL = [c for page in PAGES for c in commands(page)]
OPEN = re.compile(r"=.*\b(?:[A-Z]{1,6}|FOLDER)\b(?!/)")  # a value left to the reader, as tension=T
STUDIES = ROOT / "studies"
#: files that a page has the reader make
MADE = {"my_effect.py", *(f"{c.words[2]}.py" for c in ALL if c.words[1] == "new-effect")}


@pytest.fixture(autouse=True)
def _arguments_are_put_back(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["belt-sim"])


def mean_something(command: str, cfg: dict) -> None:
    """Raises InputError where the values of ``simulate``, ``compare`` or ``diagnose`` cannot be."""
    if command == "simulate":
        case_from(cfg)
    if command in ("simulate", "compare", "diagnose") and cfg["model"]["name"] != BY_TENSION:
        model_of(cfg["model"])
    effects = cfg.get("effects") or []
    if isinstance(effects, list):
        ids = [e["id"] if isinstance(e, dict) else e for e in effects]
        load_classes([i for i in ids if not i.startswith("outputs/") and i not in MADE])
    campaign = cfg.get("campaign")
    if campaign and re.fullmatch(r"[a-z]+_[a-z_]+", campaign):
        assert (CAMPAIGNS / campaign).is_dir()


def belt_sim_can(words: list[str], monkeypatch) -> None:
    """Compose every job of ``belt-sim COMMAND ...``."""
    command, *given = words
    assert command in COMMANDS, f"no such command: {command}"
    if command == "import":  # its files have no key
        bare = [w for w in given if not w.startswith("-") and "=" not in w]
        given = [*(w for w in given if w not in bare), f"files={bare}"]
    if "--config-dir" in given:  # a folder that the page tells the reader to make
        return
    given = [quote_override(w) for w in given if not w.startswith("-")]
    if not (CONF / f"{command}.yaml").is_file():
        assert not given or command == "new-effect", f"{command} takes no settings"
        return
    monkeypatch.chdir(ROOT)
    cfg = complete(command, given)
    if cfg and not OPEN.search(" ".join(given)):
        mean_something(command, cfg)


def complete(command: str, given: list[str], conf=CONF) -> dict[str, Any]:
    """The configuration that Hydra composes, of a sweep's first case; none where a setting is left to the reader."""
    first = []
    for override in OverridesParser.create().parse_overrides(given):
        if override.is_discrete_sweep() and not hasattr(override.value(), "filter"):
            first.append(f"{override.get_key_element()}={next(iter(override.sweep_string_iterator()))}")
        elif not override.is_sweep_override():
            first.append(override.input_line)
    with initialize_config_dir(version_base="1.3", config_dir=str(conf)):
        try:
            return plain_settings(compose(command, first))
        except MissingMandatoryValue:
            return {}


def study_can(module: str, given: list[str]) -> None:
    """Find the module of ``python -m MODULE ...`` and, where Hydra reads its settings, compose them."""
    found = importlib.util.find_spec(module) or importlib.util.find_spec(f"{module}.__main__")
    assert found, f"no such module: {module}"
    place = (
        found.origin if not found.submodule_search_locations else f"{found.submodule_search_locations[0]}/__main__.py"
    )
    config = re.search(r'application\("(\w+)"', (ROOT / place).read_text(encoding="utf-8"))
    if config:
        complete(config.group(1), [*FIXED, *(w for w in given if not w.startswith("-"))], conf=STUDIES / "conf")


@pytest.mark.parametrize("command", {c.words: c for c in ALL}.values(), ids=str)
def test_a_command_can_be_put_together(command: Command, monkeypatch):
    program, *words = command.words
    if program == "belt-sim":
        belt_sim_can(words, monkeypatch)
    elif program == "make":
        assert re.search(rf"^{words[0]}:", (ROOT / "Makefile").read_text(), re.MULTILINE), words[0]
    elif program == "pytest":
        assert [w for w in words if (ROOT / w.split("::")[0]).exists()], words
    else:
        study_can(words[1], words[2:])


def run_page(page, marks, place, capsys, monkeypatch) -> None:
    """Run the marked commands of a page one after another in one folder, which looks like the checkout."""
    for there in ("models", "docs", "conf"):
        (place / there).symlink_to(ROOT / there)
    monkeypatch.chdir(place)
    for command in commands(page):
        if command.marked in marks:
            capsys.readouterr()
            status = run_command(list(command.words[1:]))
            out, err = capsys.readouterr()
            assert status == 0, f"{command}\n{out}{err}"
            assert not missing(command.output, out), f"{command}\n{out}"


def with_mark(mark: str):
    """Pages that have a command marked so."""
    return [pytest.param(p, id=name(p)) for p in PAGES if any(c.marked == mark for c in commands(p))]


@pytest.mark.parametrize("page", with_mark("run"))
def test_quick_commands_run_and_print_what_the_page_says(page, tmp_path, capsys, monkeypatch):
    run_page(page, ("run",), tmp_path, capsys, monkeypatch)


@pytest.mark.long
@pytest.mark.parametrize("page", with_mark("run: long"))
def test_long_commands_run_and_print_what_the_page_says(page, tmp_path, capsys, monkeypatch):
    run_page(page, ("run", "run: long"), tmp_path, capsys, monkeypatch)


def test_the_pages_are_seen_through():
    assert len(ALL) > 100
    assert {c.words[0] for c in ALL} == {"belt-sim", "python", "make"}
    assert any(c.marked == "run" for c in ALL)
