"""How sphinx builds the site from the pages of this folder and the docstrings: `python -m sphinx -W docs site`."""

import re

import simprep

project = "simprep"
author = "the simprep authors"
version = release = simprep.__version__
html_title = f"simprep {release}"

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["_build"]

myst_heading_anchors = 3
suppress_warnings = ["myst.header"]  # a page may begin a list of tables with a level that fits it
default_role = "code"  # docstrings write names in single backticks
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
autodoc_typehints = "description"
autodoc_member_order = "bysource"

html_theme = "furo"  # system fonts, no request to other hosts
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False


def setup(app):
    """Pages are written so that they read well without the site too; some links differ there."""
    app.connect("source-read", _links_of_the_site)


def _links_of_the_site(app, page, source):
    # what stands beside this folder is offered as a download; links to pages get the pages' titles
    source[0] = re.sub(r"\[(?:docs/)?(\w+\.md)\]\(\1\)", r"[](\1)", source[0])
    source[0] = re.sub(r"(?<!!)\[([^]]*)\]\((\.\./[^)#]+)\)", r"[\1](<path:\2>)", source[0])
