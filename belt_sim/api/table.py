"""The table of a sweep, which draws itself."""

import os
from typing import Any

import pandas as pd

from belt_sim.api.plot import Picture, plot


class SweepTable(pd.DataFrame):
    """A table of ``bs.sweep``; what is made of it (parts, copies, pickles) is pandas' own, with pandas' ``plot``."""

    @property
    def _constructor(self) -> type[pd.DataFrame]:
        return pd.DataFrame

    def __reduce__(self) -> Any:
        return object.__new__, (pd.DataFrame,), self.copy().__getstate__()

    def plot(  # type: ignore[override]
        self, path: str | os.PathLike[str] | None = None, *, kind: str | None = None, dpi: float | None = None
    ) -> Picture:
        """The picture of ``bs.plot``, written to ``path`` if one is given; kind: a column, None for the late rate."""
        return plot(self, path, kind=kind, dpi=dpi)
