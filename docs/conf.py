"""Configuration of the pages; `make docs` builds them."""

from __future__ import annotations

import os
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent), str(HERE / "_ext")]

from validation.gallery.pages import write_gallery  # noqa: E402

project = "fsm"
author = "The fsm developers"
copyright = "The fsm developers, MIT licence"
extensions = [
    "myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon", "sphinx.ext.mathjax", "executed",
    "plain_docstrings",
]  # fmt: skip
exclude_patterns = ["_build", "generated/extra"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence"]

html_theme = "furo"
html_title = "fsm"
templates_path = ["_templates"]
html_static_path = ["_static"]
html_css_files = ["gallery.css"]
html_extra_path = ["generated/extra"]

autosummary_generate = True
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_member_order = "bysource"
# fields of named tuples (`Stage`, `Peak`, `Dim`, `NewtonSolution`) are described in their docstrings; as targets they would
# be ambiguous
autodoc_default_options = {
    "members": True, "show-inheritance": True, "exclude-members": "model_config, travel, force, name, q"
}  # fmt: skip
autodoc_mock_imports: list[str] = []
# words of docstrings such as `path` and `time` are names of several attributes, and two classes are called `Case`
suppress_warnings = ["ref.python"]
napoleon_google_docstring = False
napoleon_numpy_docstring = True
napoleon_use_ivar = True
napoleon_use_rtype = False
add_module_names = False
python_use_unqualified_type_names = True

# the gallery is made of the last run of `make validate`
write_gallery(HERE.parent / os.environ.get("FSM_CHECKS", "out/validation/checks.json"), HERE / "generated")
(HERE / "generated" / "extra").mkdir(parents=True, exist_ok=True)


def _skip_members_of_others(app, what, name, member, skip, options):  # type: ignore[no-untyped-def]
    """Leave out what a module exports from another one, which describes it: two targets of one name are ambiguous."""
    home, here = getattr(member, "__module__", None), app.env.current_document.autodoc_module
    if what == "module" and here and str(home).startswith("fsm.") and home != here:
        return True
    return None


def setup(app):  # type: ignore[no-untyped-def]
    """Connect the rule to autodoc."""
    app.connect("autodoc-skip-member", _skip_members_of_others)
