"""Display of results: lines and tables in terminals and notebooks, pandas frames and xarray datasets."""

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from belt_sim.errors import BeltError


@dataclass(frozen=True)
class Table:
    """Columns and rows of text; left: columns of words; marked: rows to be seen first."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    left: Sequence[str] = ()
    marked: Sequence[int] = ()

    def html(self) -> str:
        """Return the table as HTML for a notebook."""
        align = ["left" if c in self.left else "right" for c in self.columns]
        head = "".join(_cell("th", c, a) for c, a in zip(self.columns, align, strict=True))
        body = ""
        for k, row in enumerate(self.rows):
            style = ' style="color:#d55e00"' if k in self.marked else ""
            body += f"<tr{style}>{''.join(_cell('td', c, a) for c, a in zip(row, align, strict=True))}</tr>"
        caption = f"<caption>{html.escape(self.title)}</caption>" if self.title else ""
        return f"<table>{caption}<tr>{head}</tr>{body}</table>"


def _cell(tag: str, text: str, align: str) -> str:
    return f'<{tag} style="text-align:{align}">{html.escape(text)}</{tag}>'


class Display:
    """Mixin of results: text in a terminal, HTML in a notebook."""

    def lines(self) -> Sequence[str]:
        """Return the result in a few lines."""
        raise NotImplementedError

    def tables(self) -> Sequence[Table]:
        """Return the tables that a notebook shows below the lines."""
        return ()

    def __repr__(self) -> str:
        return "\n".join(self.lines())

    def _repr_html_(self) -> str:
        first, *rest = (html.escape(line) for line in self.lines())
        text = f"<p><b>{first}</b>{''.join(f'<br>{line}' for line in rest)}</p>"
        return "".join([text, *(table.html() for table in self.tables())])


def frame(rows: Any) -> Any:
    import pandas as pd

    return pd.DataFrame(rows)


def dataset(variables: Mapping[str, Any], coords: Mapping[str, Any], units: Mapping[str, str]) -> Any:
    """Return an xarray Dataset whose variables carry their units; raise BeltError if xarray is not installed."""
    try:
        import xarray as xr
    except ImportError as missing:
        raise BeltError("to_xarray: xarray is not installed; run `pip install 'belt-sim[xarray]'`") from missing
    made = xr.Dataset(dict(variables), dict(coords))
    for name, unit in units.items():
        made[name].attrs["units"] = unit
    return made
