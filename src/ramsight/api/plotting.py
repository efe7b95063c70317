"""Pictures of circuits, runs and tracks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ramsight.api.arguments import path_argument
from ramsight.argument_kinds import by_kind
from ramsight.errors import DescriptionError, UnknownNameError, one_line
from ramsight.machine import load_machine, only_unit
from ramsight.machine.description import Machine, Unit
from ramsight.optional import check_extra
from ramsight.output import atomic_path, check_apart, check_figure, check_target
from ramsight.output.atomic import suffix_of
from ramsight.plant.build import AnyUnit, build
from ramsight.signals import Dataset
from ramsight.tracking.figures import LOOKS, SCREEN, Look, draw_run, draw_track, run_title, save
from ramsight.units import argument

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@by_kind
def plot(
    dataset: Dataset,
    path: str | Path | None = None,
    *,
    title: str | None = None,
    width: float | str | None = None,
    style: str = LOOKS[0],
) -> Figure:
    r"""Draw a simulated run, a track with its error where the truth is known, or many runs over what was varied.

    Args:
        dataset: of `simulate`, `track` or `simulate_many`.
        path: also write it here: .png, .svg or .pdf.
        title: above the picture; by default what it is.
        width: of a run's or a track's picture [m], or text as ``"88 mm"``, a column of most journals.
        style: of the same: ``screen``, or ``journal``: a serif font of 7 points, thin lines and no title.

    Returns:
        A `matplotlib.figure.Figure` in mm, bar, rpm and N m; no window is opened.

    Raises:
        DescriptionError: the Dataset is none of these, nothing differs between its runs, there is no such width, or a
            picture of many runs has none.
        UnknownNameError: there is no such style.
        OutputError: the file cannot be written.

    Example:
        >>> import ramsight
        >>> run = ramsight.simulate("mining-loader", unit="boom", load="441 kN")
        >>> [axes.get_ylabel() for axes in ramsight.plot(run).axes][:2]
        ['position [mm]', 'pressure\n[bar]']
    """
    attributes = getattr(dataset, "attrs", {})
    kind, unit = attributes.get("kind"), attributes.get("unit")
    look = look_of(width, style, is_drawn=kind != "simulated runs")
    title = _title(title)
    check_figure(None if path is None else Path(path))
    if kind == "track":
        known = "true_position" in dataset
        truth = dataset[["true_position"]].rename(true_position="position") if known else None
        figure = draw_track(
            dataset, dataset, truth, title or f"{unit}: track of the {attributes['sensor']} sensor", look
        )
    elif kind == "simulated runs":
        from ramsight.tracking.compared_figure import draw_sweep

        figure = draw_sweep(dataset, title or f"{dataset['outcome'].size} simulated runs")
    elif kind == "simulated run" and unit is not None:
        figure = draw_run(dataset, title or run_title(dataset), look)
    else:
        allowed = "what ramsight.simulate, ramsight.simulate_many or ramsight.track returns"
        raise DescriptionError("is neither a run nor a track", key="dataset", value=kind, allowed=allowed)
    if path is not None:
        with look.context():
            save(figure, path)
    return figure


def _title(passed: str | None) -> str:
    """A title that can be set, "" for none.

    Raises:
        DescriptionError: it has formulas that cannot be set.
    """
    if not passed:
        return ""
    from matplotlib.mathtext import MathTextParser

    shown = one_line(passed)
    try:
        MathTextParser("agg").parse(shown)
    except ValueError as error:
        reason = str(error).split("\n")[-1]
        raise DescriptionError(f"has a formula that cannot be set: {reason}", key="title", value=passed) from None
    return shown


def look_of(width: float | str | None, style: str, *, is_drawn: bool = True) -> Look:
    """Width and style as they were passed.

    Args:
        width: [m], or text; None for that of the screen.
        is_drawn: whether there is a picture of a run or a track, which alone has them.

    Raises:
        DescriptionError: there is no such width, or no picture that has width and style.
        UnknownNameError: there is no such style.
    """
    if style not in LOOKS:
        raise UnknownNameError("style", style, LOOKS)
    wide = None if width is None else argument(width, "m", "width", least="50 mm", most="1000 mm")
    look = Look(wide, style)
    if look != SCREEN and not is_drawn:
        key, value = ("style", style) if width is None else ("width", width)
        raise DescriptionError("is of the picture of a run or a track, and none is drawn", key=key, value=value)
    return look


FILES = (".svg", ".png", ".pdf")


@by_kind
def draw(machine: AnyUnit, path: str | Path | None = None, *, unit: str | None = None, title: str | None = None) -> str:
    """Draw a unit's circuit with the symbols of ISO 1219-1, laid out from its parts and nodes.

    Whatever the circuit: from the catalogue, from a description in full, or built in Python. Groups of the SVG have the
    id ``part-NAME``, lines of a node the attribute ``data-node``, for those who want to colour it.

    Args:
        machine: a machine, its name or file; or one unit's description, or a built unit.
        path: also write it here: .svg, .png or .pdf.
        unit: name of the unit; may be left out where there is only one.
        title: above the drawing; by default the machine's name and the unit's.

    Returns:
        The drawing as SVG text.

    Raises:
        DescriptionError: several units, and none is named; or a part names no nodes.
        UnknownNameError: no such machine or unit.
        OutputError: the file cannot be written.

    Example:
        >>> import ramsight
        >>> text = ramsight.draw("press")
        >>> 'id="part-pump_a"' in text and 'data-node="port_a"' in text
        True
    """
    from ramsight.drawing import drawn, svg
    from ramsight.drawing.notes import notes

    file = None if path is None else path_argument(path, "path")
    check_target(file, FILES)
    if file is not None and file.suffix != ".svg":
        check_extra("figures")
    if file is not None and isinstance(machine, str | Path):
        check_apart({"the machine": machine}, {"the drawing": file})
    described, name = _described(machine, unit)
    built = build(machine, unit)
    sheet = drawn(built, one_line(title or "") or name or built.name, {} if described is None else notes(described))
    text = svg.text(sheet)
    if file is not None:
        with atomic_path(file) as draft:
            if suffix_of(file, FILES) == ".svg":
                draft.write_text(text, encoding="utf-8", newline="\n")
            else:
                svg.save(sheet, draft)
    return text


def _described(machine: AnyUnit, unit: str | None) -> tuple[Unit | None, str | None]:
    """The unit's description, if there is one, and what stands above its drawing."""
    if isinstance(machine, str | Path | Machine):
        whole = load_machine(machine)
        name = only_unit(whole) if unit is None else unit
        return whole.unit(name), f"{whole.name}: {name}"
    return (machine, unit) if isinstance(machine, Unit) else (None, None)
