"""A run of a machine with a mechanism as a page that can be scrubbed through, and as a GIF.

The machine is drawn where it is, and as a ghost where sensors say it is; beneath stand their errors and their own
uncertainty.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from html import escape
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from film.side_view import draw_ground, draw_rock, draw_scenery, draw_shapes, rock
from ramsight import Status
from ramsight.drawing.mechanism.bodies import Shapes, shapes
from ramsight.drawing.mechanism.scenery import COLOURS, heap_radius, scenery
from ramsight.optional import needing
from ramsight.output import atomic_path, write_text
from ramsight.plant.linked import LinkedMachine

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

PAGE_STEP = 0.1  # s between the page's pictures
GIF_STEP = 0.5  # s between the GIF's, more if there would be more than ...
_GIF_PICTURES = 160
_GIF_WIDTH, _DPI = 800, 80  # pixels, and of an inch
_GIF_SPEED = 5.0  # times faster than life
_PAGE_SPEED = 2.0
_MARGIN = 0.3  # m around all that moves
_TITLE = 110  # letters in a line of the GIF's title
_LEAST_TOP = 1.0  # mm, of the error's axis


def write_animation(
    machine: LinkedMachine,
    run: xarray.Dataset,
    tracks: Mapping[str, xarray.Dataset],
    folder: Path,
    *,
    phases: Sequence[tuple[str, float]] = (),
    title: str = "",
    advance: Callable[[float], object] | None = None,
) -> tuple[Path, Path]:
    """Write `loader.html` (needs no other file) and `loader.gif`.

    Args:
        machine: the machine.
        run: what it did, from `simulate_linked`.
        tracks: what sensors made of it, by unit: Datasets over time with position [m], position_std [m] (NaN where
            not known) and status. Units without one have no ghost of their own: they are drawn where they are.
        folder: where to; made if it is not there.
        phases: names of parts of the run and when each begins [s].
        title: above page and GIF; the machine's name above the page if omitted.
        advance: called now and then with the share of the work done since the last call; 1 in all.

    Returns:
        The two files.
    """
    folder.mkdir(parents=True, exist_ok=True)
    page, picture = folder / "loader.html", folder / "loader.gif"
    tell = advance or (lambda _: None)
    times = _times(run, PAGE_STEP)
    units = [_unit(machine, run, tracks, unit.name, times) for unit in machine.units]
    seen = _poses(machine, units, times, lambda share: tell(0.5 * share))
    content = page_text(machine, run, units, seen, times, phases, title or machine.name, _meanings(tracks))
    write_text(content, page)
    stride = max(round(GIF_STEP / PAGE_STEP), -(-len(times) // _GIF_PICTURES))
    which = range(0, len(times), stride)
    _write_gif(machine, run, units, seen, times, which, picture, title, lambda share: tell(0.5 * share))
    return page, picture


def _times(run: xarray.Dataset, step: float) -> Array:
    end = float(run["time"][-1])
    return np.asarray(np.minimum(np.arange(int(np.floor(end / step + 1e-9)) + 1) * step, end))


def _unit(
    machine: LinkedMachine, run: xarray.Dataset, tracks: Mapping[str, xarray.Dataset], name: str, times: Array
) -> dict[str, Any]:
    """Columns of one unit at times [s]; NaN where the sensor knows nothing, error and band where it is not usable."""
    position = np.interp(times, run["time"].values, run[f"{name}_position"].values)
    found: dict[str, Any] = {"name": name, "position": position, "tracked": name in tracks}
    nothing = np.full(len(times), np.nan)
    found |= {"estimate": nothing, "std": nothing, "status": np.zeros(len(times), dtype=int)}
    if name in tracks:
        track = tracks[name]
        at = np.clip(np.searchsorted(track["time"].values, times + 1e-9, side="right") - 1, 0, None)
        found |= {"estimate": track["position"].values[at], "std": track["position_std"].values[at]}
        found["status"] = track["status"].values[at].astype(int)
    usable = found["status"] < Status.NOT_REFERENCED
    found["std"] = np.where(usable, found["std"], np.nan)
    found["error"] = np.where(usable, found["estimate"] - position, np.nan)
    return found


def _poses(
    machine: LinkedMachine, units: Sequence[Mapping[str, Any]], times: Array, advance: Callable[[float], object]
) -> list[tuple[Shapes, Shapes | None]]:
    """The machine at each time as it is, and as the sensors see it."""
    truth = np.column_stack([unit["position"] for unit in units])
    said = np.column_stack([unit["estimate"] for unit in units])
    guess = np.where(np.isfinite(said), said, truth)  # a unit that no sensor has found is drawn where it is
    seen = []
    for here, there, known in zip(truth, guess, np.isfinite(said).any(axis=1), strict=True):
        ghost = shapes(machine.mechanism, there) if known else None
        if ghost is not None and not np.all(np.isfinite(ghost.tip)):
            ghost = None  # an estimate that the mechanism cannot take
        seen.append((shapes(machine.mechanism, here), ghost))
        advance(1.0 / len(times))
    return seen


def _meanings(tracks: Mapping[str, xarray.Dataset]) -> dict[str, str]:
    """Texts of the statuses, by number."""
    found: dict[str, str] = {}
    for track in tracks.values():
        for entry in str(track["status"].attrs.get("meaning", "")).split("; "):
            number, colon, text = entry.partition(": ")
            if colon:
                found[number] = text
    return found


def page_text(
    machine: LinkedMachine,
    run: xarray.Dataset,
    units: Sequence[Mapping[str, Any]],
    seen: Sequence[tuple[Shapes, Shapes | None]],
    times: Array,
    phases: Sequence[tuple[str, float]],
    title: str,
    meanings: Mapping[str, str],
) -> str:
    """The page, all data inside it; arguments as the steps before it make them."""
    around, payload = scenery(seen[0][0].frame), np.interp(times, run["time"].values, run["payload"].values)
    data = {
        "time": np.round(times, 3).tolist(),
        "phases": [list(phase) for phase in phases],
        "bounds": bounds(machine, seen),
        "colours": COLOURS,
        "scenery": {
            "chassis": np.round(around.chassis, 3).tolist(),
            "wheels": np.round(around.wheels, 3).tolist(),
            "radius": round(around.radius, 3),
        },
        "pace": _PAGE_SPEED,
        "truth": [_shown(here) for here, _ in seen],
        "estimate": [None if ghost is None else _shown(ghost) for _, ghost in seen],
        "heap": [round(heap_radius(mass), 3) for mass in payload],
        "rock": [_rock(here, float(mass)) for (here, _), mass in zip(seen, payload, strict=True)],
        "statuses": dict(meanings),
        "units": [
            {
                "name": unit["name"],
                "status": unit["status"].tolist(),
                "top": error_range(unit),
                **{key: _millimetres(unit[key]) for key in ("position", "estimate", "std", "error")},
            }
            for unit in units
        ],
    }
    text = (Path(__file__).with_name("page.html")).read_text(encoding="utf-8")
    packed = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")  # nothing ends the script
    before, after = text.split("@DATA@")  # what fills a place is not looked at for places
    return f"{before.replace('@TITLE@', escape(title))}{packed}{after}"


def error_range(unit: Mapping[str, Any]) -> float:
    """Half the height of the error's axis [mm]: it holds all of error and band."""
    error = float(np.nanmax(np.abs(unit["error"]), initial=0.0)) * 1e3
    band = 2e3 * float(np.nanmax(unit["std"], initial=0.0))
    return max(1.1 * error, 1.1 * band, _LEAST_TOP)


def bounds(machine: LinkedMachine, seen: Sequence[tuple[Shapes, Shapes | None]]) -> list[float]:
    """The part of the plane that holds all poses [m]: least and greatest x, least and greatest z."""
    places = np.concatenate([np.concatenate([*here.bodies.values(), np.array(here.frame)]) for here, _ in seen])
    places = np.concatenate([places, scenery(seen[0][0].frame).outline])
    rated = machine.mechanism.rated_payload or 0.0
    full = [rock(here.bucket, rated) for here, _ in seen if here.bucket is not None]
    places = np.concatenate([places, *full])
    heaps = np.array([here.load for here, _ in seen if here.load is not None and here.bucket is None]).reshape(-1, 2)
    above = [0.0, heap_radius(rated)]
    places = np.concatenate([places, heaps + above])
    low, high = places.min(axis=0) - _MARGIN, places.max(axis=0) + _MARGIN
    return [float(low[0]), float(high[0]), float(min(low[1], -_MARGIN)), float(high[1])]


def _rock(seen: Shapes, payload: float) -> list[list[float]] | None:
    """Outline of the payload in the bucket; None where there is none, or no bucket."""
    if seen.bucket is None or payload <= 0.0:
        return None
    return np.round(rock(seen.bucket, payload), 3).tolist()  # type: ignore[no-any-return]


def _shown(seen: Shapes) -> dict[str, Any]:
    def rounded(places: Any) -> Any:
        return np.round(places, 3).tolist()

    return {
        "bodies": [rounded(places) for places in seen.bodies.values()],
        "links": [rounded(places) for places in seen.links],
        "struts": [rounded([strut.base, strut.barrel_end, strut.rod]) for strut in seen.struts],
        "load": None if seen.load is None else rounded(seen.load),
    }


def _millimetres(values: Array) -> list[float | None]:
    return [float(f"{1e3 * value:.3f}") if np.isfinite(value) else None for value in values]


def _write_gif(
    machine: LinkedMachine,
    run: xarray.Dataset,
    units: Sequence[Mapping[str, Any]],
    seen: Sequence[tuple[Shapes, Shapes | None]],
    times: Array,
    which: range,
    path: Path,
    title: str,
    advance: Callable[[float], object],
) -> None:
    with needing("figures"):
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    from PIL import Image

    x0, x1, z0, z1 = bounds(machine, seen)
    around = scenery(seen[0][0].frame)
    payload = np.interp(times, run["time"].values, run["payload"].values)
    tracked = [unit for unit in units if unit["tracked"]]
    heights = [3.0, *(0.7 for _ in tracked)]
    figure = Figure(figsize=(_GIF_WIDTH / _DPI, 5.6 + 1.3 * len(tracked)), dpi=_DPI, layout="constrained")
    figure.suptitle("\n".join(wrap(title, _TITLE)), fontsize=8)
    canvas = FigureCanvasAgg(figure)
    panels = np.ravel(figure.subplots(len(heights), 1, height_ratios=heights))
    cursors = []
    for panel, unit in zip(panels[1:], tracked, strict=True):
        top = error_range(unit)
        band = 2e3 * unit["std"]
        panel.fill_between(times, -band, band, color="#e9b44c", alpha=0.35, lw=0)
        panel.plot(times, 1e3 * unit["error"], color="#2a6f97", lw=1.2)
        panel.set(ylim=(-top, top), xlim=(times[0], times[-1]), ylabel="mm")
        panel.set_title(f"{unit['name']}: error, and twice the sensor's standard deviation", fontsize=8, loc="left")
        panel.tick_params(labelsize=8)
        cursors.append(panel.axvline(0.0, color="#1f2a36", lw=0.8))
    if tracked:
        panels[-1].set_xlabel("time [s]", fontsize=8)
    pictures = []
    for k in which:
        axes = panels[0]
        axes.clear()
        here, ghost = seen[k]
        draw_scenery(axes, around)
        draw_rock(axes, here, float(payload[k]))
        draw_shapes(axes, here)
        if ghost is not None:
            draw_shapes(axes, ghost, ghost=True)
        draw_ground(axes)
        axes.set(xlim=(x0, x1), ylim=(z0, z1), aspect="equal", xticks=[], yticks=[])
        axes.set_title(f"{times[k]:.1f} s    filled: true, dashed: estimated", fontsize=9, loc="left")
        for cursor in cursors:
            cursor.set_xdata([times[k], times[k]])
        canvas.draw()  # type: ignore[no-untyped-call]
        pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
        pictures.append(Image.fromarray(pixels[..., :3].copy()).quantize(64))
        advance(1.0 / len(which))
    pause = round(1e3 * which.step * PAGE_STEP / _GIF_SPEED)
    with atomic_path(path) as draft:
        pictures[0].save(draft, format="GIF", save_all=True, append_images=pictures[1:], duration=pause, loop=0)
