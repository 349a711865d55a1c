"""Settings of the documentation; pages under ``generated/`` are written from the sources at each build."""

from __future__ import annotations

import sys
from pathlib import Path
from types import GenericAlias
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import generated_pages  # noqa: E402
from docutils.nodes import SkipNode  # noqa: E402
from docutils.utils.math.latex2mathml import tex2mathml  # noqa: E402

from rotordrop import __version__  # noqa: E402

project = "rotordrop"
author = "rotordrop contributors"
copyright = author  # noqa: A001
release = version = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.doctest",
    "sphinx.ext.viewcode",
    "numpydoc",
]
exclude_patterns = ["_build", "generated/twelve_numbers.md"]  # the latter is included by a page
html_theme = "furo"
html_title = "rotordrop"
html_show_copyright = False
html_static_path = ["_static"]
html_css_files = ["wide.css"]

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

toc_object_entries = False  # thousands of names in the side bar took two thirds of the time of a build
autodoc_typehints = "none"
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

doctest_global_setup = "import numpy as np\nnp.set_printoptions(precision=4, suppress=True)"

generated_pages.write(HERE / "generated")


html_math_renderer = "mathml"


def _inline_math(writer: Any, node: Any) -> None:
    writer.body.append(tex2mathml(node.astext(), as_block=False))
    raise SkipNode


def _block_math(writer: Any, node: Any) -> None:
    writer.body.append(f'<div class="math">{tex2mathml(node.astext(), as_block=True)}</div>')
    raise SkipNode


def setup(app: Any) -> None:
    """Write mathematics as MathML, which browsers show without a network, and skip what numpydoc cannot read.

    Names of array types are left out of the pages: numpydoc takes them for functions and fails.
    """
    app.add_html_math_renderer("mathml", (_inline_math, None), (_block_math, None))

    def is_array_type(app: Any, what: str, name: str, obj: Any, skip: bool, options: Any) -> bool | None:
        return True if isinstance(obj, GenericAlias) else None

    app.connect("autodoc-skip-member", is_array_type)
