"""A table of a result as text cells, for terminals and notebooks alike."""

import html
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Table:
    """Columns and rows of text; left: columns of words; marked: rows to be seen first."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    left: Sequence[str] = ()
    marked: Sequence[int] = ()

    def html(self) -> str:
        """The table for a notebook."""
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
