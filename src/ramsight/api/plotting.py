"""Pictures of runs and tracks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ramsight.errors import DescriptionError
from ramsight.output import check_target
from ramsight.tracking.figures import draw_run, draw_track, save
from ramsight.tracking.sweep_figure import draw_sweep

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


def plot(dataset: xarray.Dataset, path: str | Path | None = None, *, title: str | None = None) -> Figure:
    r"""Draw a simulated run, a track with its error where the truth is known, or many runs over what was varied.

    Args:
        dataset: of `simulate`, `track` or `simulate_many`.
        path: also write it here: .png, .svg or .pdf.
        title: above the picture; by default what it is.

    Returns:
        A `matplotlib.figure.Figure` in mm, bar, rpm and N m; no window is opened.

    Raises:
        DescriptionError: the Dataset is none of these, or nothing differs between its runs.
        OutputError: the file cannot be written.

    Example:
        >>> import ramsight
        >>> run = ramsight.simulate("mining-loader", unit="boom", load="441 kN")
        >>> [axes.get_ylabel() for axes in ramsight.plot(run).axes][:2]
        ['position [mm]', 'pressure\n[bar]']
    """
    check_target(None if path is None else Path(path), (".png", ".svg", ".pdf"))
    attributes = getattr(dataset, "attrs", {})
    kind, unit = attributes.get("kind"), attributes.get("unit")
    if kind == "track":
        known = "true_position" in dataset
        truth = dataset[["true_position"]].rename(true_position="position") if known else None
        figure = draw_track(dataset, dataset, truth, title or f"{unit}: track of the {attributes['sensor']} sensor")
    elif kind == "simulated runs":
        figure = draw_sweep(dataset, title or f"{dataset['outcome'].size} simulated runs")
    elif kind == "simulated run" and unit is not None:
        figure = draw_run(dataset, title or f"{unit}: simulated run")
    else:
        allowed = "what ramsight.simulate, ramsight.simulate_many or ramsight.track returns"
        raise DescriptionError("is neither a run nor a track", key="dataset", value=kind, allowed=allowed)
    if path is not None:
        save(figure, path)
    return figure
