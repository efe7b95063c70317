"""Writes the pages of the paper and their figures from a run of the study: python -m reproduction.docs_pages."""

from __future__ import annotations

import re
import textwrap
from pathlib import Path

from ramsight.output import write_text
from reproduction import Chapter, Study, reproduce
from reproduction.coverage import coverage_rows
from reproduction.figure_style import draw
from reproduction.markdown import MEANING, chapter_lines, table_lines, typeset

ROOT = Path(__file__).parents[1]
PAGES, FIGURES = ROOT / "docs" / "reference", ROOT / "docs" / "paper"
_DRAWN = ("fig01_loader", "fig02_circuit", "fig05_hydraulics", "fig06_pumps")
SHOWN = (
    *_DRAWN,
    "fig09_boom_movement",
    "fig15_boom_errors",
    "fig18_references",
    "fig19_speeds",
    "fig20_ramps",
    "fig22_wear",
    "fig28_valve_controlled",
)
"""Figures that the page shows; the report has all."""
_LEFT_OUT = ("the paper's tables 1 and 2", "pump efficiencies", "movement per", "what cannot be tested")
_WIDTH = 128

HEAD = """# The paper, reproduced

T. Sourander, M. Pietola, T. Minav and H. Hänninen, *Sensorless position estimation of simulated direct driven hydraulic
actuators*, SICFP'17, find the position of a cylinder from the speed and torque of the motor that drives its pumps: a
table, made from simulated runs, says how far the rod moves per motor revolution at each torque and oil temperature.
One command in a checkout of the project redoes that study:

```sh
make paper
```

It takes less than a minute and leaves `report.html` (one file, figures inside), `report.pdf`, `report.md` with its
figures as PNG and SVG, and `results.json` with every number, in `build/paper`. This page is written from such a run,
and a test holds it to that.

What the paper leaves open is an option: the length of the ramps, the reading of its loads, and every value of the
machine. A value that is found later can be tried at once, in a description of your own or for a run:

```sh
make paper PAPER_ARGS='my-loader.toml'
make paper PAPER_ARGS='--ramp "0.6 s" --loads shares'
make paper PAPER_ARGS='--set boom.hose.diameter="19 mm" --set boom.hose.regime=turbulent'
make paper PAPER_ARGS='--set boom.pump_a.volumetric_efficiency=0.92 --set bucket.load.loads.high="150 kN"'
```

Three sensors see every run: the paper's table; a volume balance, which is given the simulated machine's own laws and
exact parameters; and the self-calibrating sensor, which has the data sheet and learns the rest.
"""

CHAPTERS = {
    "paper-open": (
        "The paper: what it leaves open",
        "The machine as drawn, what the paper does not say and what that is worth, and what it takes for granted. "
        "Each chapter holds statements of the paper against this run.",
        ("drawn", "how the position", "leaves open", "for granted"),
    ),
    "paper-cycles": (
        "The paper: cycles and references",
        "The errors of one cycle, of cycles with cold and hot oil, and of many cycles with and without references. "
        "The last chapter says where they come from. Each chapter holds statements of the paper against this run.",
        ("one lift-lower", "cold and", "repeated", "ramps"),
    ),
    "paper-limits": (
        "The paper: other machines and loads",
        "How the sensors do at other speeds and on machines that differ from their data sheet. Then temperatures "
        "are wrong, loads change, and the relief pressure is near. Each chapter holds statements of the "
        "paper against this run.",
        ("other speeds", "machines that", "pumps that", "oil temperature", "load change", "relief"),
    ),
    "paper-system": (
        "The paper: hoses, mechanism and energy",
        "Hoses, the model of hydraulics and kinematics together, where the energy goes, and the paper's bench. "
        "Each chapter holds statements of the paper against this run.",
        ("hoses", "combined", "energy", "bench"),
    ),
}
"""Pages of chapters: title, summary, and words of the titles of the chapters that it has."""

FOOT = """## A table of your own

```sh
ramsight calibrate mining-loader --unit boom --out boom.sensor
ramsight track mining-loader log.csv.gz --unit boom --start "100 mm" --sensor boom.sensor
```

480 simulated runs, 40 loads at 6 oil temperatures in both directions, take about half a second and are kept: the same
machine is calibrated once. A sensor file is a zip of `sensor.toml` (format, kind, unit, the arrays' units, a hash of
all) and one `.npy` file per array. In Python:

```python
from ramsight import machine
from ramsight.calibration.cached import calibrated
from ramsight.calibration.sensor_file import load, save
from ramsight.plant.ddh import build_ddh
from ramsight.sensor.table import table

boom = build_ddh("boom", machine.load_machine("mining-loader").unit("boom"))
save(calibrated(boom), "boom.sensor")
sensor = table(load("boom.sensor"))
sensor.start(0.1)
print(sensor.step(0.0, 0.0, 0.0, 313.15, reference=0.25).position)  # 0.25
```
"""


def texts(study: Study) -> dict[str, str]:
    """Every page of a study, by the name of its file."""
    pages = {"paper": text(study)}
    shown = [one for one in study.chapters if not any(name in one.title.lower() for name in _LEFT_OUT)]
    for name, (title, summary, _) in CHAPTERS.items():
        own = [one for one in shown if page_of(one) == name]
        lines = [f"# {title}", "", f"{summary} [The paper, reproduced](paper.md) lists every statement.", ""]
        pages[name] = _joined([*lines, *(line for one in own for line in (*_chapter(one), ""))])
    return pages


def page_of(chapter: Chapter) -> str:
    """The page that has a chapter."""
    title = chapter.title.lower()
    (name,) = [page for page, (_, _, words) in CHAPTERS.items() if any(word in title for word in words)]
    return name


def text(study: Study) -> str:
    """The first page: what the study is, and everything in the paper with its verdict."""
    lines = [HEAD, "## Everything in the paper, and how it fared", "", f"{study.summary()}. {MEANING}", ""]
    lines += table_lines(("in the paper", "what it is or says", "where it is here", "verdict"), coverage_rows(study))
    lines += ["", "The chapters are on pages of their own:", ""]
    lines += [f"- [{title}]({name}.md)" for name, (title, _, _) in CHAPTERS.items()]
    return _joined([*lines, "", FOOT])


def _joined(lines: list[str]) -> str:
    return re.sub(r"\n{3,}", "\n\n", "\n".join(_wrapped(line) for line in lines)).rstrip() + "\n"


def _chapter(chapter: Chapter) -> list[str]:
    shown = tuple(picture for picture in chapter.pictures if picture.name in SHOWN)
    lines = chapter_lines(Chapter(chapter.title, chapter.text, {}, grids=chapter.grids))
    said = [f"- *{one.paper}* **{one.verdict.value.capitalize()}**: {typeset(one.ours)}" for one in chapter.statements]
    return [
        *lines,
        *said,
        *([""] if said else []),
        *(f"![{typeset(picture.caption)}](../paper/{picture.name}.png)\n" for picture in shown),
    ]


def _wrapped(line: str) -> str:
    """A paragraph in lines; tables, pictures and what has its lines already stay.

    No line begins with a percent sign, which MyST takes for a comment.
    """
    if "\n" in line or line.startswith(("|", "#", "!")):
        return line
    further = "  " if line.startswith("- ") else ""
    joined = line.replace(" %", "\N{NO-BREAK SPACE}%")
    lines = textwrap.wrap(joined, _WIDTH, break_long_words=False, break_on_hyphens=False, subsequent_indent=further)
    return "\n".join(lines).replace("\N{NO-BREAK SPACE}%", " %")


def main() -> None:
    """Redo the study and write the pages."""
    study = reproduce()
    for picture in study.pictures:
        if picture.name in SHOWN:
            draw(picture, FIGURES)
            (FIGURES / f"{picture.name}.svg").unlink()
    for name, written in texts(study).items():
        write_text(written, PAGES / f"{name}.md")


if __name__ == "__main__":
    main()
