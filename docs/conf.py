"""The documentation site: `docs/build` makes static pages of the documents that lie in the repository."""

import re
import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
sys.path[:0] = [str(DOCS)]
# Python executes the .pth files of a virtual environment twice. Of two equal finders of an editable installation each
# forgets, for the other's sake, that it has run ninja, and runs it again for every name that is not a module.
sys.meta_path[:] = list({repr(finder): finder for finder in sys.meta_path[::-1]}.values())[::-1]

from site_pages import escape_docstring, write_pages  # noqa: E402

project = "jointfrf"
author = "the jointfrf developers"
copyright = author
version = release = re.search(r"version: '([^']+)'", (ROOT / "meson.build").read_text(encoding="utf-8"))[1]

# The documents link to each other as files of the repository, so all of it is the source.
root_doc = "docs/index"
include_patterns = [
    "docs/*.md",
    "docs/generated/**",
    "cases/*/README.md",
    "fortran/README.md",
    "python/packaging/README.md",
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "CODE_OF_CONDUCT.md",
    "SECURITY.md",
    "tests/benchmarks/history.md",
]
extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_copybutton",
    "sphinx_gallery.gen_gallery",
]
myst_enable_extensions = ["html_image"]
myst_heading_anchors = 4
nitpicky = False

autosummary_generate = True
autosummary_ignore_module_all = False
autodoc_typehints = "none"  # types stand in the docstrings, with shapes and units
numpydoc_show_class_members = False
copybutton_prompt_text = "$ "

sphinx_gallery_conf = {
    "examples_dirs": str(DOCS / "examples"),
    "gallery_dirs": str(DOCS / "generated" / "examples"),
    "filename_pattern": r"\.py$",
    "download_all_examples": False,
    "min_reported_time": 1e9,
    "show_memory": False,
    "write_computation_times": False,
    "remove_config_comments": True,
}

html_theme = "pydata_sphinx_theme"
html_title = f"jointfrf {version}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_sidebars = {"docs/generated/api/*": []}  # a list of two hundred names beside each of two hundred pages
html_theme_options = {
    "navigation_with_keys": False,
    "collapse_navigation": True,
    "show_prev_next": True,
    "secondary_sidebar_items": {"**": ["page-toc"], "docs/index": []},
    "footer_start": ["copyright"],
    "footer_end": [],
    "header_links_before_dropdown": 6,
}

write_pages(ROOT, DOCS / "generated", release)


def setup(app):
    """Escape docstrings before numpydoc takes them apart."""
    app.connect("autodoc-process-docstring", escape_docstring, priority=100)
