"""The table of a sweep, which prints what matters and draws itself."""

import os

import pandas as pd

from belt_sim.api.plot import Picture, plot


class SweepTable(pd.DataFrame):
    """A table of ``bs.sweep``; what is made of it (parts, copies) is pandas' own."""

    @property
    def _constructor(self) -> type[pd.DataFrame]:
        return pd.DataFrame

    def __repr__(self) -> str:
        """What varies, the late rates (without them the steady one) and whether they have settled, in 80 columns."""
        rates, models = {f"rate{k}_mm_per_m": f"rate{k}" for k in (1, 2, 3, 4)}, self.get("model", pd.Series()).unique()
        there = [*rates, "settled"] if "rate1_mm_per_m" in self else ["steady_rate_mm_per_m"]
        shown = [*self.attrs.get("axes", ()), *["model"] * (len(models) > 1), *there]
        few = self.to_pandas()[[c for c in shown if c in self]].rename(columns=rates)
        with pd.option_context("display.max_columns", None, "display.show_dimensions", False, "display.precision", 4):
            lines = [repr(few), f"{'rates in mm per m of travel; ' * ('rate1' in few)}model {', '.join(models)}"]
        return "\n".join([*lines, f"{len(self)} rows, {len(self.columns)} columns in all: list(table)"])

    def to_pandas(self) -> pd.DataFrame:
        """The whole table as pandas' own DataFrame."""
        return self.copy()

    def plot(  # type: ignore[override]
        self, path: str | os.PathLike[str] | None = None, *, kind: str | None = None, dpi: float | None = None
    ) -> Picture:
        """The picture of ``bs.plot``."""
        return plot(self, path, kind=kind, dpi=dpi)
