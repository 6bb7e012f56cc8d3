"""The command line: every command is an application of Hydra on ``conf``; an error of the user is one line and a
non-zero exit.

Hydra has its own flags (--cfg, --info, --config-dir, --multirun ...) and grammar of overrides. Added here: help with
units, file names that need no quotes, and Hydra's errors in one line.
"""

import os
import re
import signal
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial, update_wrapper
from hashlib import sha256
from importlib.metadata import version
from importlib.util import find_spec
from io import BufferedWriter, FileIO, TextIOWrapper
from keyword import iskeyword
from pathlib import Path
from typing import Any

from belt_sim.commands import COMMANDS, HELP, OUTPUT, help_text, known_keys, nearest, one_line
from belt_sim.errors import BeltError, InputError
from belt_sim.io import CONF, MODEL_FOLDER, sample_campaigns, write_text

#: flags of Hydra -> the short form, and the values that may follow: None for no value, () for any text
FLAGS: dict[str, tuple[str, Sequence[str] | None]] = {
    "--help": ("-h", None),
    "--hydra-help": ("", None),
    "--multirun": ("-m", None),
    "--run": ("-r", None),
    "--resolve": ("", None),
    "--cfg": ("-c", ("job", "hydra", "all")),
    "--info": ("-i", ("all", "config", "defaults", "defaults-tree", "plugins", "searchpath")),
    "--package": ("-p", ()),
    "--config-path": ("-cp", ()),
    "--config-name": ("-cn", ()),
    "--config-dir": ("-cd", ()),
}
SHOWS = {"--cfg", "--info", "--hydra-help"}  # these show something and run nothing
#: key=value, as Hydra takes it
OVERRIDE = re.compile(r"[+~]*[A-Za-z_][\w./@]*=")
HYDRAS = re.compile(r"[+~]*hydra[./]")
#: keys whose values are files and folders
PATHS = {
    *("campaign", "diagnosis", "draft", "effects", "mapping", "model.scene", "out"),
    *("hydra.run.dir", "hydra.sweep.dir"),
}
INTERRUPTED = 130  # exit status after Ctrl-C, as shells have it
LONGEST_FOLDER_NAME = 120  # characters of a folder's name; file systems take 255 bytes, and a letter may have four


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
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a batch system's time limit is as Ctrl-C
    try:
        status = run_command(sys.argv[1:])
        sys.stdout.flush()
    except OSError as error:
        if error.filename != OUTPUT:
            raise
        os.dup2(nowhere, sys.stdout.fileno())  # as Python's documentation has it
        status = _complain(f"{OUTPUT} = {error.strerror or error}: what was finished is kept")
    if status == INTERRUPTED:  # a thread may still compile, which cannot be stopped: a second Ctrl-C ends the process
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
    sys.exit(status)


def use_one_blas_thread() -> None:
    """Linear algebra in the thread that asks for it, unless the environment says otherwise."""
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):  # read when numpy and scipy are loaded
        os.environ.setdefault(name, "1")


class Output(FileIO):
    """An output whose reader may go, as ``| head`` does: the rest is not shown, and the run goes on to its files."""

    def write(self, data: Any) -> int:
        try:
            return super().write(data)
        except BrokenPipeError:
            return memoryview(data).nbytes
        except OSError as error:  # its disk is full
            error.filename = OUTPUT
            raise


_USAGE = {
    "demo": "usage: belt-sim demo    it takes no settings; what it makes goes to outputs/demo",
    "new-effect": "usage: belt-sim new-effect NAME    such as side_wind: it writes side_wind.py",
    "completion": 'usage: eval "$(belt-sim completion)"    in ~/.bashrc',
}


def run_command(arguments: list[str]) -> int:
    """Run one command; returns the exit status."""
    if not arguments or arguments[0] in (*HELP, "help"):
        print("usage: belt-sim COMMAND [key=value ...] [-m key=a,b,c ...]\n")
        print(*(f"  {name:12s} {what}" for name, (what, _) in COMMANDS.items()), sep="\n")
        print("\nbelt-sim COMMAND --help shows every key of a command.")
        return 0 if arguments else 2
    command, settings = arguments[0], arguments[1:]
    if command in ("--version", "-V", "version"):
        print(f"belt-sim {version('belt-sim')}")
        return 0
    try:
        try:
            os.getcwd()
        except OSError:
            raise BeltError("current folder: it has been deleted; go to one that is there (cd)") from None
        if command in ("-sc", "--shell-completion") or (command == "completion" and not settings):
            return complete(settings or ["install=bash"])
        if command not in COMMANDS:
            raise BeltError(f"command = {command}: use one of {', '.join(COMMANDS)}")
        if any(a in HELP for a in settings):
            file = (CONF / f"{command}.yaml").is_file()
            print(help_text(command) if file else f"belt-sim {command}: {COMMANDS[command][0]}\n\n{_USAGE[command]}")
            return 0
        if command == "completion":
            raise BeltError(f"completion = {settings[0]}: it takes no settings; {_USAGE[command]}")
        if command == "demo":
            return demo(settings)
        if command != "new-effect":
            return run_hydra(command, settings)
        if len(settings) != 1 or settings[0].startswith("-"):
            raise BeltError("new-effect: give one name, as in belt-sim new-effect side_wind")
        path = new_effect(settings[0])
        test = f"import belt_sim as bs; print(*bs.check_effect('{path.as_posix()}'), sep='\\n')"
        print(f"{path}: change its law, then")
        print(f"belt-sim simulate 'effects=[{{id: {path.as_posix()}, load: 0.01}}]'")
        print(f'to test it:\npython -c "{test}"')
        return 0
    except OSError as error:
        if error.filename == OUTPUT:
            raise
        from belt_sim.commands.runs import at_work, explain

        return _complain(explain(error, at_work.get("folder", "belt-sim")))
    except BeltError as error:
        return _complain(str(error))
    except KeyboardInterrupt:
        return _complain("stopped; what was finished is kept", status=INTERRUPTED)


def run_hydra(command: str, settings: Sequence[str]) -> int:
    """Run a command as Hydra's application on ``conf``; return the exit status. Raises BeltError for Hydra's errors."""
    flags, overrides = _sorted_out(command, settings)
    from belt_sim.commands.runs import at_work, end_sweep, run_task

    at_work.clear()
    task = update_wrapper(partial(run_task, command=command), run_task)
    named = [] if any(o.startswith("hydra.job.name=") for o in overrides) else [f"hydra.job.name={command}"]
    try:
        status = apply_hydra(f"belt-sim {command}", task, command, [*flags, *named, *overrides])
    finally:
        end_sweep()
        for path, content in at_work.pop("notes", {}).items():  # of the folder's last run, whose result stays
            with suppress(OSError):
                path.write_bytes(content)
    if "crash" in at_work:
        raise at_work.pop("crash")
    return status or int(bool(at_work.get("failures")))


def apply_hydra(program: str, task: Callable[..., Any], name: str, arguments: Sequence[str], conf: Path = CONF) -> int:
    """Let Hydra compose ``name`` of ``conf`` and call ``task``; return the exit status, raise its errors as BeltError.

    program: how a result says that it was made; arguments: flags first, then overrides.
    """
    full = os.environ.get("HYDRA_FULL_ERROR") == "1"
    os.environ["HYDRA_FULL_ERROR"] = "1"  # Hydra raises its errors, which become one line here
    import hydra
    from hydra.errors import HydraException
    from omegaconf import OmegaConf
    from omegaconf.errors import OmegaConfBaseException
    from yaml import MarkedYAMLError

    swept = folder_name(",".join(sorted(a for a in arguments if OVERRIDE.match(a) and not HYDRAS.match(a)))) or "all"
    OmegaConf.register_new_resolver("folder_name", folder_name, replace=True)
    OmegaConf.register_new_resolver("sweep_name", lambda: swept, replace=True, use_cache=True)
    before, sys.argv = sys.argv, [program, *arguments]
    try:
        hydra.main(version_base="1.3", config_path=str(conf), config_name=name)(task)()
    except BeltError:
        raise
    except (HydraException, OmegaConfBaseException, ValueError) as error:
        raise BeltError(one_line(error, name, conf)) from error
    except OSError:
        raise
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"{mark.name}:{mark.line + 1}" if mark else "YAML file"
        raise BeltError(f"{where}: {error.problem or 'cannot be read'}; mend the file there") from error
    except Exception as error:  # of a launcher or sweeper: no Slurm, a lost job ...
        if full:
            raise
        first = next((" ".join(line.split()) for line in str(error).splitlines() if line.strip()), "")
        raise BeltError(f"{type(error).__name__}: {first}; HYDRA_FULL_ERROR=1 shows where") from error
    except SystemExit as end:
        if isinstance(end.code, str):
            raise BeltError(end.code) from end
        return end.code or 0
    finally:
        sys.argv = before
        if not full:
            del os.environ["HYDRA_FULL_ERROR"]
    return 0


def _sorted_out(command: str, settings: Sequence[str]) -> tuple[list[str], list[str]]:
    """Flags, with their values, and overrides, quoted as Hydra wants them; raises BeltError for what cannot be."""
    given = dict[str, str]()
    overrides: list[str] = []
    files: list[str] = []  # bare names, which import reads as files=[...]
    rest, long = list(settings), {short: flag for flag, (short, _) in FLAGS.items() if short}
    while rest:
        argument = rest.pop(0)
        typed, equals, value = argument.partition("=")
        flag = long.get(typed, typed)
        if command == "import" and (Path(argument).is_file() or not (typed[:1] == "-" or OVERRIDE.match(argument))):
            files.append("'" + argument.replace("\\", "\\\\").replace("'", "\\'") + "'")
        elif not typed:
            raise BeltError(f"{argument}: has no key; write key=value")
        elif typed[0] != "-":
            overrides.append(quote_override(argument))
        elif flag not in FLAGS:
            parted = f"; write {typed[:2]} {argument[2:]}" if typed[:2] in long and OVERRIDE.match(argument[2:]) else ""
            remedy = parted or nearest(flag, list(FLAGS), "flags")
            raise BeltError(f"{argument}: no such flag{remedy} (settings are written key=value)")
        elif FLAGS[flag][1] is None:
            if equals:
                raise BeltError(f"{argument}: {flag} takes no value; write {typed}")
            given[flag] = flag
        else:
            if not equals and rest and not (flag == "--info" and re.search("^-|=|^$", rest[0])):
                value = rest.pop(0)
            elif flag == "--info" and not equals:
                value = "all"
            choices, folder = FLAGS[flag][1], flag in ("--config-dir", "--config-path")
            further = "; name further folders in hydra.searchpath=[file://FOLDER]" if flag == "--config-dir" else ""
            for wrong, remedy in (
                (not value, f"needs a value, as {typed} NAME"),
                (choices and value not in choices, f"use one of {', '.join(choices or ())}"),
                (flag in given, f"give it once{further}"),
                (folder and not Path(value).is_dir(), "no such folder"),
            ):
                if wrong:
                    raise BeltError(f"{flag}{value and f' = {value}'}: {remedy}")
            given[flag] = f"{flag}={os.path.abspath(value) if folder else value}"
    if files:
        overrides.append(f"files=[{','.join(files)}]")
    name, places = given.get("--config-name", "").partition("=")[2], given.keys() & {"--config-dir", "--config-path"}
    if name in COMMANDS and name != command and not places:
        raise BeltError(f"--config-name = {name}: is a command; write belt-sim {name}")
    known, foreign = known_keys(command), bool(places or name) or "hydra.searchpath" in " ".join(overrides)
    stated = dict[str, str]()
    for argument in overrides:
        key, equals, value = argument.partition("=")
        name = key.lstrip("+")
        if stated.setdefault(key, value) != value and not given.keys() & SHOWS:  # what is shown may go to a file
            print(f"{key} is given twice, {stated[key]} before: {key}={value} counts")  # Hydra says nothing
        stated[key] = value
        if equals and re.fullmatch(r"\w+", name) and not (foreign or name in known or (CONF / name).is_dir()):
            raise BeltError(f"{name}: no such key{nearest(name, known)}")  # at once: Hydra takes a while to load
        if name == "hydra":
            raise InputError(key, value, "", "is a group of settings; set one of them, as hydra.run.dir=FOLDER")
        if name in ("hydra.run.dir", "hydra.sweep.dir") and value in ("", "''", '""', "null"):
            raise InputError(key, value, "", "is empty; name a folder")
    return list(given.values()), overrides if "--hydra-help" not in given else []


def quote_override(argument: str) -> str:
    """Put quotes around letters beyond ASCII and signs that paths may have, as Hydra's grammar wants them."""
    key, equals, value = argument.partition("=")
    if not equals or value[:1] in ("'", '"'):
        return argument
    is_path = key.lstrip("+") in PATHS
    if is_path and value.startswith("~/"):
        value = str(Path(value).expanduser())
    strange = bool(re.search(r"[^\w./\\:%@+ -]", value, re.ASCII))
    there = os.path.exists(value) or os.path.isdir(os.path.dirname(value) or "?")
    named = is_path and strange and (there or not ({"[", "{"} & {value[:1]} or "," in value))
    if named or (not value.isascii() and value[:1] not in ("[", "{")):
        return f"{key}='{value.replace(chr(92), chr(92) * 2).replace(chr(39), chr(92) + chr(39))}'"
    return f"{key}={value}"


def folder_name(overrides: str) -> str:
    """A name of one folder for ``overrides`` (key=value, separated by commas): the same ones have the same name."""
    name = re.sub(r"[/\\:*?\"'<>|\s]+", "_", overrides)
    if name == overrides and len(name) <= LONGEST_FOLDER_NAME:
        return name
    return f"{name[:LONGEST_FOLDER_NAME]}-{sha256(overrides.encode()).hexdigest()[:8]}"


def _complain(message: str, status: int = 1) -> int:
    print(f"belt-sim: {message}", file=sys.stderr)
    return status


def complete(asked: Sequence[str]) -> int:
    """Hydra's shell completion: install=bash, or query=bash for the line that the shell hands over."""
    line, command = os.environ.get("COMP_LINE", ""), "simulate"
    words = line.split()
    if "query=" in asked[0]:
        if len(words) < 2 or (len(words) == 2 and not line.endswith(" ")):
            print(*COMMANDS)
            return 0
        command, current = words[1], words[-1]
        if current.startswith("campaign="):
            print(*(f"campaign={name}" for name in sample_campaigns()))
            return 0
        if command not in COMMANDS or not (CONF / f"{command}.yaml").is_file():
            return 0
        os.environ["COMP_LINE"] = os.environ["COMP_LINE"].replace(f" {command}", "", 1)
    return apply_hydra("belt-sim", lambda config: None, command, ["-sc", *asked])


def new_effect(name: str, folder: Path = Path()) -> Path:
    """Write NAME.py, the side wind of models/effects under another name, and return its path."""
    from belt_sim.effects.base import library

    if not re.fullmatch(r"[a-z][a-z0-9_]*", name) or iskeyword(name):
        raise InputError("NAME", name, "", "use lower-case letters, digits and _, as in side_wind; no word of Python")
    path = folder / f"{name}.py"
    if name in library() or path.exists():
        raise InputError("NAME", name, "", "there is an effect or a file of that name; choose another")
    text = (MODEL_FOLDER / "effects" / "wind.py").read_text(encoding="utf-8")
    text = text.replace("class Wind(", f"class {name.title().replace('_', '')}(")
    text = text.replace('id = "wind"', f'id = "{name}"')
    return write_text(path, text.replace("An effect of one's own: a steady side wind", "A steady side wind"))


FOLDER = Path("outputs") / "demo"  # of the current folder


def demo(arguments: Sequence[str]) -> int:
    """Diagnose the sample and say what to look at; return the exit status."""
    if arguments:
        raise BeltError("demo: it takes no settings; use diagnose for your own")
    started = time.perf_counter()
    print("Simulated measurements of a belt at 7 to 40 N/mm2, against the beam model that")
    print("controllers use. The first run compiles: some 40 s, later 15 s.\n")
    folder, case = FOLDER / "diagnosis", ("campaign=slack_belt", "model=beam_th2")
    silent = [] if find_spec("rerun") else ["watch=null"]  # nothing is said of a recording that cannot be made
    status = run_command(["diagnose", *case, *silent, f"hydra.run.dir={folder.as_posix()}"])
    if status:
        return status
    print(f"\nDone in {time.perf_counter() - started:.0f} s. What to look at in {folder.as_posix()}:")
    products = {
        "report.html": "the whole diagnosis on one page",
        "effects.yaml": "the missing effect, for simulate and compare: effects=FILE",
        "where.svg": "where the beam model fails",
        "comparison.rrd": "points, residuals, tilt against travel; open: rerun FILE",
    }
    for name, words in products.items():
        if (folder / name).exists():
            print(f"  {name:14s}  {words}")
    print(f"Then: belt-sim compare {' '.join(case)} \\\n      effects={(folder / 'effects.yaml').as_posix()}")
    return 0
