"""The command line: one run, or a sweep, of one command; errors of the user are one line and a non-zero exit."""

import os
import re
import sys
import time
from collections.abc import Callable, Iterable
from importlib.metadata import version
from importlib.util import find_spec
from io import BufferedWriter, FileIO, TextIOWrapper
from pathlib import Path
from typing import Any

import yaml

from belt_sim.commands.command_line import HELP, SHOW, compose_request, help_text, import_arguments, known_keys
from belt_sim.commands.run_dir import COMMANDS, run_alone
from belt_sim.errors import BeltError, InputError
from belt_sim.files import CONF, MODELS, group_names, sample_campaigns, write_text

#: [bytes] of address space that JAX needs: with less, XLA ends the process in the midst of its work
LEAST_MEMORY = 2_500_000_000
ON_ONE_CORE = ("native", "line", "mujoco")  # engines that leave a GPU alone
#: read when numpy and scipy are loaded; matrices here are small, and what runs at once are marches
BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def main() -> None:
    use_one_blas_thread()
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by who started us
            setattr(sys, name, os.fdopen(nowhere, "w", closefd=False))
        if isinstance(stream := getattr(sys, name), TextIOWrapper):
            stream.reconfigure(errors="replace")  # a pipe on Windows cannot write ±, ² and →
            if isinstance(raw := getattr(stream.buffer, "raw", stream.buffer), FileIO):
                file, lines = Output(raw.fileno(), "wb", closefd=False), stream.line_buffering or stream.write_through
                text = TextIOWrapper(BufferedWriter(file), stream.encoding, "replace", line_buffering=lines)
                setattr(sys, name, text)
    try:
        status = run(sys.argv[1:])
        sys.stdout.flush()
    except OSError as error:  # its disk is full
        os.dup2(nowhere, sys.stdout.fileno())  # as Python's documentation has it
        status = _complain(f"standard output = {error.strerror or error}: what was finished is kept")
    sys.exit(status)


class Output(FileIO):
    """An output whose reader may go, as ``| head`` does: the rest is not shown, and the run goes on to its files."""

    def write(self, data: Any) -> int:
        try:
            return super().write(data)
        except BrokenPipeError:
            return memoryview(data).nbytes


def use_one_blas_thread() -> None:
    """Linear algebra in the thread that asks for it, unless the environment says otherwise."""
    for name in BLAS_THREADS:
        os.environ.setdefault(name, "1")


def run(arguments: list[str]) -> int:
    """Run one command; returns the exit status."""
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        print("usage: belt-sim COMMAND [key=value ...] [-m key=a,b,c ...]\n")
        print(*(f"  {name:12s} {what}" for name, (what, _) in COMMANDS.items()), sep="\n")
        print("\nbelt-sim COMMAND --help shows every key of a command.")
        return 0 if arguments else 2
    if arguments[0] in ("--version", "-V", "version"):
        print(f"belt-sim {version('belt-sim')}")
        return 0
    command = arguments[0]
    if command not in COMMANDS:
        return _complain(f"command = {command}: use one of {', '.join(COMMANDS)}")
    if command == "demo":
        return demo(run) if not arguments[1:] else _complain("demo: it takes no settings; use diagnose for your own")
    if command == "completion":
        print(script(COMMANDS), end="")
        return 0
    if command != "new-effect" and any(a in HELP for a in arguments):
        print(help_text(command))
        return 0
    settings = import_arguments(arguments[1:]) if command == "import" else arguments[1:]
    try:
        if command == "new-effect":
            return _new_effect(settings)
        return _run_composed(command, settings)
    except BeltError as error:
        return _complain(str(error))
    except OSError as error:
        if error.filename is None:
            raise
        return _complain(f"{error.filename} = {error.strerror or error}: choose a folder that can be written")
    except KeyboardInterrupt:
        return _complain("stopped; what was finished is kept", status=130)


def _new_effect(arguments: list[str]) -> int:
    if len(arguments) != 1 or arguments[0].startswith("-"):
        return _complain("new-effect: give one name, as in belt-sim new-effect side_wind")
    path = new_effect(arguments[0])
    print(f"{path}: change its law, then belt-sim simulate 'effects=[{{id: {path.as_posix()}, load: 0.01}}]'")
    print(f"to test it: python -c \"import belt_sim as bs; print(*bs.check_effect('{path.as_posix()}'), sep='\\n')\"")
    return 0


def _run_composed(command: str, settings: list[str]) -> int:
    """Run a command on the configuration, or the configurations, that its settings mean."""
    shown = [k for k, a in enumerate(settings) if a.split("=")[0] in SHOW]
    if shown:
        kept = [a for k, a in enumerate(settings) if not ({k, k - 1} & set(shown))]
        for case in compose_request(command, kept).runs:
            print(yaml.safe_dump(dict(case.config), sort_keys=False, allow_unicode=True), end="")
        return 0
    request = compose_request(command, settings)
    _check_memory()
    try:
        from belt_sim.jax_setup import check_environment, prepare
    except ValueError as error:  # JAX reads JAX_... as it is imported
        raise BeltError(f"JAX_...: {error}; unset it") from error
    check_environment()
    prepare(space=any(case.config.get("engine") not in (None, *ON_ONE_CORE) for case in request.runs))
    if request.folder is not None:
        from belt_sim.commands.sweep import run_sweep

        return run_sweep(request)
    run_alone(request.runs[0])
    return 0


def _check_memory() -> None:
    """Raise InputError where the address space of this process is limited to less than JAX needs."""
    if find_spec("resource") is None:  # Windows
        return
    import resource

    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY and limit < LEAST_MEMORY:
        needed = f"at least {LEAST_MEMORY / 1e9:g} GB of address space are needed"
        raise InputError("ulimit -v", f"{limit / 1e9:.3g}", "GB", f"{needed}; raise the limit (ulimit -v unlimited)")


def _complain(message: str, status: int = 1) -> int:
    print(f"belt-sim: {message}", file=sys.stderr)
    return status


def new_effect(name: str, folder: Path = Path()) -> Path:
    """Write NAME.py, the side wind of models/effects under another name, and return its path."""
    from belt_sim.effects.library import library

    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise InputError("NAME", name, "", "use lower-case letters, digits and _, as in side_wind")
    path = folder / f"{name}.py"
    if name in library() or path.exists():
        raise InputError("NAME", name, "", "there is an effect or a file of that name; choose another")
    text = (MODELS / "effects" / "wind.py").read_text(encoding="utf-8")
    text = text.replace("class Wind(", f"class {name.title().replace('_', '')}(")
    text = text.replace('id = "wind"', f'id = "{name}"')
    return write_text(path, text.replace("An effect of one's own: a steady side wind", "A steady side wind"))


GROUPS = ("rig", "belt", "model")
#: filled in by ``script``; the value of any key may be a file
_SCRIPT = """_belt_sim() {{
  local line=${{COMP_LINE:0:COMP_POINT}} words
  local current=${{line##* }} command
  read -r _ command _ <<< "$line "
  [[ $line == *\\ *\\ * ]] || command=
  case $command in
{cases}
  *) words="{commands}" ;;
  esac
  COMPREPLY=($(compgen -W "$words" -- "$current"))
  [[ $current == *=* ]] || return
  local value=${{current#*=}}
  COMPREPLY+=($(compgen -f -P "${{current%%=*}}=" -- "$value"))
  COMPREPLY=("${{COMPREPLY[@]#"${{current%"$value"}}"}}")
}}
[ -z "$ZSH_VERSION" ] || {{ autoload -U +X bashcompinit && bashcompinit; }}
complete -o nospace -F _belt_sim belt-sim
"""


def script(commands: Iterable[str]) -> str:
    """Return the script that a shell evaluates: the words of every command, as its file in conf lists them."""
    names = [*commands, "--help", "--version"]
    cases = [f'  {c}) words="{" ".join(words(c))}" ;;' for c in names if (CONF / f"{c}.yaml").is_file()]
    return _SCRIPT.format(cases="\n".join(cases), commands=" ".join(names))


def words(command: str) -> list[str]:
    """Return what may follow a command: its keys with =, names of rigs, belts, models and campaigns, flags."""
    keys = known_keys(command)
    found = [f"{key}=" for key in keys if key not in (*GROUPS, "campaign")]
    for group in (g for g in GROUPS if g in keys):
        found += [f"{group}={name}" for name in group_names(group)]
    if "campaign" in keys:
        found += [f"campaign={name}" for name in sample_campaigns()]
    if command == "simulate":
        found += [f"+experiment={name}" for name in group_names("experiment")] + ["-m"]
    return [*found, "--help"]


FOLDER = Path("outputs") / "demo"  # of the current folder
CASE = ("campaign=slack_belt", "model=beam_th2")


def demo(run: Callable[[list[str]], int]) -> int:
    """Diagnose the sample, then compare with what was found; ``run``: the command line. Returns the exit status."""
    started = time.perf_counter()
    print("A belt at 7 to 40 N/mm2, measured after a yaw step, against the beam model that controllers use.\n")
    folder, again = FOLDER / "diagnosis", FOLDER / "comparison"
    status = run(["diagnose", *CASE, f"hydra.run.dir={folder.as_posix()}"])
    if status:
        return status
    print("\nThe effect, added to the model:\n")
    effects = (folder / "effects.yaml").as_posix()
    status = run(["compare", *CASE, f"effects={effects}", f"hydra.run.dir={again.as_posix()}"])
    if status:
        return status
    print(f"\nDone in {time.perf_counter() - started:.0f} s. What to look at:")
    products = {
        folder / "report.html": "the whole diagnosis on one page",
        folder / "effects.yaml": "the missing effect; simulate and compare accept it as effects=FILE",
        folder / "where.png": "where the beam model fails",
        again / "overlay.png": "measured and modelled, before and after",
        folder / "comparison.rrd": "points, residuals and tilt against travel; open it with rerun FILE",
    }
    for path, words in products.items():
        if path.exists():
            print(f"  {path}  {words}")
    return 0
