"""How `make docs` makes the site: Sphinx reads this folder and the docstrings; nothing comes from elsewhere."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import logging
import posixpath
import re
import sys
import warnings
from pathlib import Path

import xarray

import ramsight
from ramsight import signals
from ramsight.machine.base import Part
from ramsight.machine.declare import Quantity

sys.path.insert(0, str(Path(__file__).parent))
from field_comments import said_of_fields

project = "ramsight"
author = "The ramsight authors"
project_copyright = "the ramsight authors, MIT licence"
version = release = ramsight.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["paper", "images"]
templates_path: list[str] = []

# Headings are link targets, as on a repository's page.
myst_heading_anchors = 4
myst_enable_extensions = ["deflist"]

# Docstrings are Google's, and say `name` for code, as Markdown does.
default_role = "code"
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
autodoc_type_aliases = {"Array": "Array"}
signals.Dataset = xarray.Dataset  # the package names it in annotations without the import
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_member_order = "groupwise"
autodoc_class_signature = "mixed"
autodoc_preserve_defaults = True
autodoc_default_options = {"members": True, "exclude-members": "model_config, model_post_init"}
autosummary_generate = False
python_use_unqualified_type_names = True
maximum_signature_line_length = 100

# Every reference must resolve. Types of other libraries have no page here, nor have the package's innermost ones.
nitpicky = True
nitpick_ignore_regex = [
    ("py:.*", r"(abc|ca|casadi|collections|enum|np|numpy|pathlib|pydantic|threading|typing|xarray)\..*"),
    ("py:.*", r"Advance|Compared|AnyMachine|AnyMap|AnyUnit|Vary|Array|ArrayLike|Dataset|Loads|Figure|Path|BaseModel"),
    ("py:.*", r"Overlay|Reading"),
    ("py:.*", r"ramsight\.(machine\.(catalogue\.Entry|linkage\.Linkage)|plant\.as_built\.U)"),
    ("py:.*", r"ramsight\.(engine|plant\.(circuit|holding|oil|linkage))\..*|CircuitModel"),
    (
        "py:.*",
        r"Listener|ParameterFile|Persistence|Samples|VirtualSensor|ramsight\.(signals\.Signals|logs\.mapped\.(Sequence|Timed))",
    ),
    ("py:.*", r"ramsight\.logs\.channels\.Further|ramsight\.duty\.reading_report\..*"),
    (
        "py:.*",
        r"Requirement|WrongValue|ramsight\.(machine\.requirement_description|study\.commissioning\.wrong_values)\..*",
    ),
    ("py:.*", r"ramsight\.study\.datasheet\.sheet_requirement\..*"),
    ("py:.*", r"ramsight\.api\.live_sensor\.Sensor|ramsight\.tracking\.channel_tolerance\..*"),
    ("py:.*", r"ramsight\.deploy\.(profiles\.Profile|diagnostic_coverage\.(RatedFault|Coverage))"),
    ("py:.*", r"Weigher|Broadcast|ramsight\.tool\.weigher\..*"),
    ("py:.*", r"Plan|ramsight\.study\.datasheet\.(study_plan|quantities|machine_tasks)\..*"),
]

EXAMPLES = Path(__file__).parent.parent / "examples"


class AsListed:
    """The order of the gallery: that of examples/README.md."""

    def __init__(self, folder: str) -> None:
        self._listed = re.findall(
            r"^- \[.*?\]\((\w+\.py)\)", (EXAMPLES / "README.md").read_text("utf-8"), flags=re.MULTILINE
        )

    def __call__(self, name: str) -> int:
        """Place of an example."""
        return self._listed.index(Path(name).name)


# The examples are run when the pages are made; one that fails stops the build.
sphinx_gallery_conf = {
    "examples_dirs": str(EXAMPLES),
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "ignore_pattern": r"typed\.py$",
    "within_subsection_order": AsListed,
    "abort_on_example_error": True,
    "capture_repr": (),
    "download_all_examples": False,
    "notebook_extensions": set(),
    "show_signature": False,
    "write_computation_times": False,
}
logging.basicConfig(level=logging.WARNING)  # before a library turns on everybody's remarks
suppress_warnings = ["config.cache"]  # the order is a class, which no cache takes
warnings.filterwarnings(
    "ignore", message="FigureCanvasAgg is non-interactive"
)  # what a reader sees is taken at the end

html_theme = "furo"
html_title = f"ramsight {release}"
html_copy_source = False
html_show_sphinx = False
html_last_updated_fmt = None
html_theme_options = {"navigation_with_keys": True}
html_static_path = ["_static"]
html_css_files = ["wide.css", "dark.css"]


PAGES_OUTSIDE = {"README.md": "index.md", "CHANGELOG.md": "changelog.md", "examples/README.md": "gallery/index.rst"}


def documented() -> dict[int, str]:
    """What the pages of the rooms document: each object's identity, and the name that it has there."""
    found = {}
    for page in sorted((Path(__file__).parent / "api").glob("*.md")):
        for kind, name in re.findall(r"^\.\. auto(\w+):: (\S+)", page.read_text(encoding="utf-8"), flags=re.MULTILINE):
            if name == "ramsight":
                continue
            room = importlib.import_module(name if kind == "module" else name.rpartition(".")[0])
            inside = getattr(room, "__all__", vars(room)) if kind == "module" else [name.rpartition(".")[2]]
            for member in inside:
                found.setdefault(id(getattr(room, member)), f"{room.__name__}.{member}")
    return found


def list_the_package(app, docname: str, source: list[str]) -> None:
    """Say of each name of `ramsight` what it is: a line where a room's page has it, else all of its docstring."""
    if docname != "api/ramsight":
        return
    there = documented()

    def described(line: re.Match[str]) -> str:
        name = line[1]
        member = getattr(ramsight, name)
        if id(member) not in there:
            kind = "class" if inspect.isclass(member) else "function"
            return f"```{{eval-rst}}\n.. auto{kind}:: ramsight.{name}\n```\n"
        first = (inspect.getdoc(member) or "").partition("\n\n")[0].replace("\n", " ")
        return f"```{{eval-rst}}\n* :py:obj:`ramsight.{name} <{there[id(member)]}>`: {first}\n```\n"

    source[0] = re.sub(r"^- `(\w+)`$", described, source[0], flags=re.MULTILINE)


def adapt_links(app, docname: str, source: list[str]) -> None:
    """Call pages by their titles, not by their files; files of the repository that are pages here lead to those."""
    source[0] = re.sub(r"\[[\w-]+\.md\](\([\w./-]+\.md[^)]*\))", r"[]\1", source[0])
    source[0] = adapted(source[0], "../" * docname.count("/"))


def adapted(text: str, up: str = "") -> str:
    """A page's text, with links to files of the repository that are pages here leading there; `up` leads to docs/."""
    for file, page in PAGES_OUTSIDE.items():
        text = text.replace(f"](../{up}{file}", f"]({up}{page}")
    return text


def join_names(app, what, name, obj, options, lines: list[str]) -> None:
    """Let `a, b: text` of a docstring be one entry, which Napoleon takes for a type and a name."""
    for at, line in enumerate(lines):
        if names := re.match(r"    +(\w+(?:, \w+)+): ", line):
            lines[at] = line.replace(names[1], names[1].replace(", ", "/"), 1)


def leave_out_signature(app, what, name, obj, options, signature, returns) -> tuple[str, None] | None:
    """A part of a description is read from a file; its keys are listed below it."""
    return ("", None) if what == "class" and issubclass(obj, Part) else None


def list_keys(app, what, name, obj, options, lines: list[str]) -> None:
    """Add the keys of a part of a description to its docstring, as they are declared: meaning, range, default."""
    if what != "class" or not issubclass(obj, Part):
        return
    for key, field in obj.model_fields.items():
        (declared,) = [found for found in field.metadata if isinstance(found, Quantity)] or [None]
        text = declared.text if declared else field.description
        if not text:
            continue
        said = [text, declared.range if declared else ""]
        if isinstance(field.default, str | int | float):
            said.append(f"default {declared.show(field.default) if declared else field.default!r}")
        lines += ["", f":ivar {key}: {'; '.join(part for part in said if part)}"]


def list_fields(app, what, name, obj, options, lines: list[str]) -> None:
    """Add the fields of a dataclass to its docstring, as the comments beside them describe them."""
    if what == "class" and dataclasses.is_dataclass(obj) and not issubclass(obj, Part):
        for field, text in said_of_fields(obj).items():
            if not field.startswith("_"):
                lines += ["", f":ivar {field}: {text}."]


def write_list_of_pages(app, error) -> None:
    """Write `llms.txt`: what the project is, and every page with the line that an index page has of it."""
    if error or app.builder.format != "html":
        return
    docs = Path(app.srcdir)
    what = re.findall(r"^\*\*(.*?)\*\*", (docs / "index.md").read_text(encoding="utf-8"), flags=re.MULTILINE)[0]
    lines = [f"# {project}", "", f"> {what}", ""]
    for folder in ("", "tutorials", "how-to", "explanation", "reference", "api"):
        lines += listed_pages((docs / folder / "index.md").read_text(encoding="utf-8"), folder)
    text = re.sub(r"\n{3,}", "\n\n", "\n".join(lines)) + "\n"
    (Path(app.outdir) / "llms.txt").write_text(text, encoding="utf-8")


def listed_pages(index: str, folder: str) -> list[str]:
    """The entries of an index page below their headings, as links from the top of the site."""
    lines: list[str] = []
    for line in index.splitlines():
        if line.startswith("#"):
            heading = f"## {line.lstrip('# ')}"
        elif page := re.fullmatch(r"- \[(.*?)\]\((.*?)\.\w+\): (.*)", adapted(line, "../" if folder else "")):
            lines += ["", heading, ""] if heading else []
            heading = ""
            lines.append(f"- [{page[1]}]({posixpath.normpath(posixpath.join(folder, page[2]))}.html): {page[3]}")
    return lines


def setup(app) -> None:
    """Hook in what Sphinx does not do by itself."""
    app.connect("source-read", adapt_links)
    app.connect("source-read", list_the_package)
    app.connect("autodoc-process-docstring", join_names, priority=100)  # before Napoleon
    app.connect("autodoc-process-docstring", list_keys, priority=600)
    app.connect("autodoc-process-docstring", list_fields, priority=600)
    app.connect("autodoc-process-signature", leave_out_signature)
    app.connect("build-finished", write_list_of_pages)
