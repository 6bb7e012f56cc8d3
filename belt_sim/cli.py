"""The command line: every command is a Hydra application; errors of the user are one line and a non-zero exit."""

import atexit
import gc
import os
import sys
from importlib.metadata import version

from belt_sim.cli_errors import files_named, one_line, ordered, refused
from belt_sim.errors import BeltError, Reported
from belt_sim.paths import CONF

SELDOM = 50_000  # new objects between two looks for garbage in cycles, of which imports and tracing leave hardly any
#: read when numpy and scipy are loaded; matrices here are small, and what runs at once are marches
BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
COMMANDS = {
    "simulate": "one model, one case: curves and late rates",
    "scene": "a 3D belt as MJCF that runs in plain MuJoCo",
    "compare": "a model against a measured campaign: where it agrees, where it fails",
    "diagnose": "which physical effect the model lacks",
    "import": "a logger's files (CSV, xlsx ...) -> a campaign",
    "new": "an empty, commented campaign with the runs that a diagnosis needs",
    "check": "the linter, and what a campaign can and cannot tell",
    "virtual-rig": "make a campaign with a hidden effect",
    "reveal": "what was hidden in such a campaign",
    "export": "the linear plant for a controller: FMU, MAT file, Bode plot",
    "map": "very many cases of an analytic model, as one table",
    "report": "write the report of a diagnosis again",
    "app": "a local web page: sliders, own measurements, diagnoses",
    "demo": "a diagnosis of a campaign that ships, into outputs/demo",
}


def main() -> None:
    """Entry point of ``belt-sim``."""
    gc.set_threshold(SELDOM)
    use_one_blas_thread()
    ended: list[int] = []
    atexit.register(_end, ended)  # the first that is registered is the last that is called
    ended.append(run(sys.argv[1:]))
    gc.freeze()
    sys.exit(ended[0])


def _end(status: list[int]) -> None:
    """End the process at once where a command has ended: to take apart what is loaded takes a third of a second, and it
    goes with the process anyway."""
    if status:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status[0])


def use_one_blas_thread() -> None:
    """Linear algebra in the thread that asks for it, unless the environment says otherwise."""
    for name in BLAS_THREADS:
        os.environ.setdefault(name, "1")


def run(arguments: list[str]) -> int:
    """Run one command; returns the exit status."""
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        print(_help())
        return 0 if arguments else 2
    if arguments[0] in ("--version", "-V", "version"):
        print(f"belt-sim {version('belt-sim')}")
        return 0
    command = arguments[0]
    if command not in COMMANDS:
        return _complain(f"command = {command}: use one of {', '.join(COMMANDS)}")
    if command == "demo":
        from belt_sim.demo import demo

        return demo(run) if not arguments[1:] else _complain("demo: it takes no settings; use diagnose for your own")
    settings = files_named(command, arguments[1:])
    reason = refused(command, settings)
    if reason:
        return _complain(reason)
    sys.argv = [f"belt-sim {command}", *ordered(command, settings)]
    try:
        return _hydra(command, space=bool({"engine=quasi_static", "engine=mjx"} & {*settings}))
    except Reported:
        return 1
    except BeltError as error:
        return _complain(str(error))
    except KeyboardInterrupt:
        return _complain("stopped; what was finished is kept", status=130)


def _hydra(command: str, space: bool) -> int:
    """Hand a command to Hydra; a job's BeltError ends it with status 1, the other jobs of a sweep go on."""
    os.environ["HYDRA_FULL_ERROR"] = "1"
    import hydra
    from hydra.errors import HydraException
    from omegaconf.errors import OmegaConfBaseException

    from belt_sim.commands.job import Jobs
    from belt_sim.jax_setup import prepare

    prepare(space)
    jobs = Jobs(command)
    try:
        hydra.main(version_base="1.3", config_path=str(CONF), config_name=command)(jobs.run)()
    except (HydraException, OmegaConfBaseException) as error:
        return _complain(one_line(error, command))
    except SystemExit as ended:  # a sweep with cases that failed
        return int(ended.code or 0)
    except BrokenPipeError:  # the reader of our output has gone, as `| head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        where = f"{error.filename or 'files'} = {error.strerror or error}"
        return _complain(f"{where}: choose a folder that can be written")
    except ValueError as error:
        if jobs.started:
            raise
        return _complain(one_line(error, command))
    return 1 if jobs.failures else 0


def _complain(message: str, status: int = 1) -> int:
    print(f"belt-sim: {message}", file=sys.stderr)
    return status


def _help() -> str:
    rows = [f"  {name:12s} {what}" for name, what in COMMANDS.items()]
    usage = "usage: belt-sim COMMAND [key=value ...] [-m key=a,b,c ...]"
    return "\n".join([usage, "", *rows, "", "belt-sim COMMAND --help shows every key of a command."])
