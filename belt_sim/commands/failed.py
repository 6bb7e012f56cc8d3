"""Cases of a sweep that fail are listed and stop nothing: each leaves failed.txt, one line, in its folder."""

import sys
import traceback
from pathlib import Path

from hydra.core.hydra_config import HydraConfig
from hydra.core.utils import JobReturn, JobStatus

from belt_sim.errors import BeltError
from belt_sim.files import write_text

FILE = "failed.txt"


def leave_failure(message: str) -> None:
    """Write down why the case that runs now has failed, if it is one of a sweep."""
    hydra = HydraConfig.get()
    if hydra.mode is not None and hydra.mode.name == "MULTIRUN":
        failure_in(Path(hydra.runtime.output_dir), message)


def failure_in(folder: Path, message: str) -> None:
    """Write down why the case of this folder has failed."""
    write_text(folder / FILE, " ".join(message.split()) + "\n")


def forgive(job: JobReturn) -> None:
    """Let a sweep go on after a case that raised; what is no BeltError has not been told of yet."""
    if job.status is not JobStatus.FAILED:
        return
    error = job._return_value  # reading return_value would raise it
    if not isinstance(error, BeltError):
        traceback.print_exception(error, file=sys.stderr)
        leave_failure(f"{type(error).__name__}: {error}")
    job.status, job.return_value = JobStatus.COMPLETED, None


def failures(sweep: Path, since: float) -> dict[Path, str]:
    """Run folder -> message of the cases of ``sweep`` that have failed since then."""
    found = sorted(p for p in sweep.glob(f"*/{FILE}") if p.stat().st_mtime >= since)
    return {p.parent: p.read_text(encoding="utf-8").strip() for p in found}


def begin_again(folder: Path) -> None:
    """Clear away the failure of an earlier attempt."""
    (folder / FILE).unlink(missing_ok=True)
