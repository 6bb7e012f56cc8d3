"""How a result shows itself: a few lines in a terminal, lines and tables in a notebook."""

import html
from collections.abc import Sequence

from belt_sim.results.table import Table


class Shown:
    """A result that people look at."""

    def lines(self) -> Sequence[str]:
        """The result in a few lines."""
        raise NotImplementedError

    def tables(self) -> Sequence[Table]:
        """What a notebook shows below the lines."""
        return ()

    def __repr__(self) -> str:
        return "\n".join(self.lines())

    def _repr_html_(self) -> str:
        first, *rest = (html.escape(line) for line in self.lines())
        text = f"<p><b>{first}</b>{''.join(f'<br>{line}' for line in rest)}</p>"
        return "".join([text, *(table.html() for table in self.tables())])
