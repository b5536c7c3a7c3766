"""Configuration of the documentation site (`make docs`): Sphinx with Markdown pages (MyST) and the furo theme.

The site needs no network, neither to build nor to read: formulas become MathML, which browsers draw themselves.
"""

import sys
from collections.abc import Callable
from pathlib import Path

from docutils import nodes
from docutils.utils.math import MathError, latex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator

sys.path.insert(0, str(Path(__file__).parent / "_ext"))  # the generator of docs/reference/generated

project = "Skein"
author = "The Skein authors"
extensions = ["myst_parser", "skein_reference"]
exclude_patterns = ["_build"]
nitpicky = True

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4

html_theme = "furo"
html_title = "Skein"
html_math_renderer = "mathml"
html_show_sphinx = False
html_copy_source = False


def _formula(as_block: bool) -> Callable[[HTML5Translator, nodes.Element], None]:
    def visit(translator: HTML5Translator, node: nodes.Element) -> None:
        try:
            translator.body.append(latex2mathml.tex2mathml(node.astext(), as_block=as_block))
        except (MathError, IndexError) as error:  # the converter's own, and a script without a base
            logging.getLogger(__name__).warning("formula %r: %s", node.astext(), error, location=node)
        raise nodes.SkipNode

    return visit


def _leave_out_of_contents(app: Sphinx, _doctree: nodes.document) -> None:
    # Every page shows the contents of the site: with the decisions in it, most of the build's time went there.
    if app.env.docname.startswith("decisions/0"):
        app.env.metadata[app.env.docname]["orphan"] = "listed by decisions/index"


def setup(app: Sphinx) -> None:
    """Register the renderer that `html_math_renderer` names, and take decisions out of the contents."""
    app.connect("doctree-read", _leave_out_of_contents)
    app.add_html_math_renderer("mathml", (_formula(as_block=False), None), (_formula(as_block=True), None))
