# SPDX-License-Identifier: MIT
"""Sphinx reads this for scripts/docs. The pages are plain Markdown, as a forge shows them."""

project = "compbox"
author = "the compbox authors"
root_doc = "README"
extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
myst_heading_anchors = 6  # anchors as a forge makes them
nitpicky = True

html_theme = "furo"
html_title = "compbox"
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
