"""Tables and paragraphs that stand both on the page and in the document."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape


@dataclass(frozen=True)
class Cell:
    """text, and what kind of cell it is on the page."""

    text: str
    kind: str = ""


@dataclass(frozen=True)
class Table:
    """header (columns,), rows of as many cells each."""

    header: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]

    def markdown(self) -> str:
        """A pipe table."""
        lines = [self.header, ("---",) * len(self.header), *(tuple(c.text for c in row) for row in self.rows)]
        return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)

    def html(self) -> str:
        """A table that scrolls by itself where it is too wide."""
        head = "".join(f"<th>{escape(name)}</th>" for name in self.header)
        body = "".join("<tr>" + "".join(_cell(c) for c in row) + "</tr>" for row in self.rows)
        return f'<div class="scroll"><table><tr>{head}</tr>{body}</table></div>'


def _cell(cell: Cell) -> str:
    kind = f' class="{cell.kind}"' if cell.kind else ""
    return f"<td{kind}>{escape(cell.text)}</td>"


def html_list(items: Sequence[str]) -> str:
    """A bulleted list."""
    return '<ul class="pairs">' + "".join(f"<li>{escape(i)}</li>" for i in items) + "</ul>"


def markdown_list(items: Sequence[str]) -> str:
    """The same in a document."""
    return "\n".join(f"- {i}" for i in items)
