"""What a command needs at its end is imported beside what it computes."""

import sys
from collections.abc import Callable
from threading import Thread

Stages = Callable[[int, str], None]


def recorder_imported(stages: Stages) -> Stages:
    """``stages`` (replicates, stage), and Rerun imported in a thread when the first replicates are done: marches, which
    need no interpreter, go on meanwhile."""
    begun: list[Thread] = []

    def told(replicates: int, stage: str) -> None:
        stages(replicates, stage)
        if replicates and not begun:
            begun.append(Thread(target=_import_recorder, daemon=True))
            begun[0].start()

    return told


def _import_recorder() -> None:
    _arrow_without_pandas()
    import belt_sim.diagnosis.answer.recording  # noqa: F401


def _arrow_without_pandas() -> None:
    """pyarrow, in which Rerun packs what it is given, looks for pandas at its first array, in case that is one of its
    columns. Here none is, and pandas alone takes as long to import as all of Rerun."""
    if "pandas" in sys.modules:
        return
    sys.meta_path.insert(0, _NoPandas)
    try:
        import pyarrow

        pyarrow.array([0])
    finally:
        sys.meta_path.remove(_NoPandas)


class _NoPandas:
    """Finds no pandas (see ``sys.meta_path``)."""

    @staticmethod
    def find_spec(name: str, path: object = None, target: object = None) -> None:
        """None, the next finder is asked; raises ModuleNotFoundError for pandas."""
        if name == "pandas":
            raise ModuleNotFoundError(name)
