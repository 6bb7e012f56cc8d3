"""Formulas as MathML, which browsers draw by themselves: nothing is loaded from anywhere (a Sphinx extension)."""

import re
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging

_log = logging.getLogger(__name__)
_APOSTROPHES, _PRIMES = re.compile(r"(?:<mo>'</mo>\s*)+"), "\u2032\u2033\u2034\u2057"


def mathml(tex: str, block: bool) -> str:
    """A formula as MathML, with primes where docutils sets apostrophes; raises MathError."""

    def primes(found: re.Match[str]) -> str:
        return f"<mo>{_PRIMES[found.group().count('<mo>') - 1]}</mo>"

    return _APOSTROPHES.sub(primes, tex2mathml(tex, as_block=block))


def visit_math(translator: Any, node: nodes.math) -> None:
    """A formula within a line."""
    translator.body.append(_render(node, block=False))
    raise nodes.SkipNode


def visit_math_block(translator: Any, node: nodes.math_block) -> None:
    """A formula on lines of its own."""
    translator.body.append(f'<div class="math">{_render(node, block=True)}</div>')
    raise nodes.SkipNode


def _render(node: nodes.Element, block: bool) -> str:
    """The node's LaTeX as MathML; what cannot be read is a warning, and warnings stop the build."""
    try:
        return mathml(node.astext(), block)
    except MathError as error:
        _log.warning("formula %r: %s", node.astext(), error, location=node, type="mathml")
        return ""


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.add_html_math_renderer("mathml", (visit_math, None), (visit_math_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
