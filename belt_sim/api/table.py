"""The table of a sweep, which draws itself."""

import os
from typing import Any

import pandas as pd

from belt_sim.api.plot import Picture, plot


class SweepTable(pd.DataFrame):
    """A table of ``bs.sweep``; what is made of it (parts, copies, pickles) is pandas' own."""

    @property
    def _constructor(self) -> type[pd.DataFrame]:
        return pd.DataFrame

    def __repr__(self) -> str:
        """What varies, the late rates (without them the steady one) and whether they have settled, in 80 columns."""
        rates = {f"rate{k}_mm_per_m": f"rate{k}" for k in (1, 2, 3, 4)}
        models = [*dict.fromkeys(self["model"])] if "model" in self else []
        own = ["model"] * (len(models) > 1)
        wanted = [*rates, "settled"] if "rate1_mm_per_m" in self else ["steady_rate_mm_per_m"]
        few = pd.DataFrame(
            {rates.get(c, c): self[c] for c in (*self.attrs.get("axes", ()), *own, *wanted) if c in self}
        )
        with pd.option_context("display.max_columns", None, "display.show_dimensions", False):
            said = repr(few.round(dict.fromkeys((*rates.values(), "steady_rate_mm_per_m"), 4)))
        unit = "rates in mm per m of travel; " if "rate1" in few else ""
        unit += f"model {', '.join(models)}"
        return f"{said}\n{unit}\n{len(self)} rows, {len(self.columns)} columns in all: list(table)"

    def to_pandas(self) -> pd.DataFrame:
        """The whole table as pandas' own DataFrame."""
        return self.copy()

    def __reduce__(self) -> Any:
        return object.__new__, (pd.DataFrame,), self.copy().__getstate__()

    def plot(  # type: ignore[override]
        self, path: str | os.PathLike[str] | None = None, *, kind: str | None = None, dpi: float | None = None
    ) -> Picture:
        """The picture of ``bs.plot``, written to ``path`` if one is given; kind: a column, None for the late rate, or
        for the steady rate of a map in which some late rates have not settled."""
        return plot(self, path, kind=kind, dpi=dpi)
