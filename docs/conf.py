"""How Sphinx builds the site: `sphinx-build -W --keep-going -n docs docs/_build/html`, without a network."""

import sys
import warnings
from pathlib import Path

import wam_cast

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "_ext"))

project = "wam_cast"
author = "The wam_cast developers"
project_copyright = "2026, the wam_cast developers"
version = release = wam_cast.__version__

extensions = [
    "generated_pages",
    "signatures",
    "navigation",
    "myst_nb",
    "sphinx.ext.autodoc",
    "docstrings",  # by numpydoc
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",  # MathJax's own files, since readers may be without a network
    "sphinx_copybutton",
]
exclude_patterns = ["_build", "_ext", "_generated"]
highlight_language = "none"
smartquotes = False  # options begin with two hyphens
nitpicky = True
# Names of other packages, which a build would need the network to resolve, and abbreviations of types.
OTHERS = (
    "builtins|collections|concurrent|contextlib|drake|enum|foxglove|google|gymnasium|jinja2|matplotlib|numpy|pandas|pathlib|pd|"
    "pyarrow|pydantic|pydantic_core|pydrake|sklearn|subprocess|xml|zipfile"
)
ABBREVIATIONS = (
    r"AbstractValue|Any|Array|Element|Picture|ArrayLike|Axes|Axis|Figure|NDArray|Path|np\.bool_|object_|"
    r"(float|u?int|complex)\d+|.*\.[FRST]|"
    "BaseModel|ValidationError"  # of pydantic
)
PRIVATE = r"lambda|.*<locals>.*|.*\._\w+"  # in the types of what pydantic checks by a function
nitpick_ignore_regex = [
    ("py:.*", rf"({OTHERS})(\..*)?"),
    ("py:.*", ABBREVIATIONS),
    ("py:class", PRIVATE),
    ("py:obj", ".*"),  # see `default_role`
]

suppress_warnings = ["myst.header"]  # the README's results begin a level lower than a page does

# ---------------------------------------------------------------- Markdown and notebooks

myst_enable_extensions = ["amsmath", "dollarmath", "deflist", "colon_fence"]
myst_heading_anchors = 3
nb_execution_mode = "cache"  # in _build, so that a second build runs only what changed
nb_execution_raise_on_error = True
nb_execution_in_temp = True  # notebooks write files
nb_execution_excludepatterns = ["notebooks/exercises/*"]  # they wait for their readers' answers
nb_execution_timeout = 300  # of a cell, on a slow machine [s]
nb_merge_streams = True
# Sliders are of no use without a kernel, and their scripts would come over the network: their picture is shown.
nb_ipywidgets_js = {}
nb_mime_priority_overrides = [("html", "application/vnd.jupyter.widget-view+json", None)]
copybutton_prompt_text = "$ "

# ---------------------------------------------------------------- reference

# What pydantic and scikit-learn add to each of their classes is left out.
ADDED = "model_config, set_fit_request, set_predict_request, set_score_request, set_partial_fit_request"
autodoc_default_options = {"members": True, "member-order": "bysource", "exclude-members": ADDED}
autodoc_preserve_defaults = True  # as the source has them
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 90
add_module_names = False
default_role = (
    "py:obj"  # `name` leads to what its module calls so, `.name` to what any module does; others stay as they are
)
numpydoc_show_class_members = False  # autodoc shows them
warnings.filterwarnings("ignore", "Unknown section", UserWarning, "numpydoc")  # in docstrings of Drake's

# ---------------------------------------------------------------- looks

html_theme = "furo"
pygments_dark_style = "github-dark"
html_title = "wam_cast"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
