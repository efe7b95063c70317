"""The sheet as files: one HTML page that needs no other file, every number, and what was assumed."""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from ramsight._version import __version__
from ramsight.output import whole_folder
from ramsight.output.html_page import page, row, table
from ramsight.signals import Dataset
from ramsight.study.datasheet.budget import Budget
from ramsight.study.datasheet.measuring import GROUPS
from ramsight.study.datasheet.sheet import SHARES, Accuracy, Sheet, Term
from ramsight.study.datasheet.sheet_figures import figures
from ramsight.study.datasheet.sheet_requirement import SheetRequirement
from ramsight.study.datasheet.statistics import Known
from ramsight.study.datasheet.studied_duties import DRAWN
from ramsight.units import format_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_NO_END = "?"
_OPEN_ENDED = (
    f"An interval with “{_NO_END}”, as in “3 mm (2.5 to {_NO_END})”, has no end there: so few machines do not say with "
    "95 % confidence how far the figure may be off. More machines do."
)
_DOTS = 110  # per inch
_SCALES = {"m": (1e3, "mm"), "s": (1.0, "s"), "m/h": (1e3, "mm/h"), "m/K": (1e3, "mm/K"), "1": (100.0, "%")}
_SURE = 3.0  # over the machines: with 95 % confidence no larger share is worse than the worst of them (rule of three)


def sheet_page(sheet: Sheet, title: str, drawn: Mapping[str, tuple[Figure, str]], required: Iterable[str] = ()) -> str:
    """The page of a data sheet.

    Args:
        drawn: figures with their captions, by name.

    Returns:
        HTML.
    """
    head = [f"<h1>{escape(title)}: data sheet of the virtual position sensor</h1>", _source(sheet), *_summary(sheet)]
    parts: list[str] = []
    parts += ["<h2>Accuracy</h2>", *_accuracy(sheet), *_figure(drawn, "errors"), *_figure(drawn, "machines")]
    parts += [
        "<h2>In the terms of IEC 61298-2</h2>",
        _terms(sheet),
        *_figure(drawn, "places"),
        *_figure(drawn, "ageing"),
    ]
    parts += ["<h2>At power-up</h2>", *_power_up(sheet), *_figure(drawn, "first")]
    parts += ["<h2>What the sensor says of itself</h2>", _status(sheet)]
    parts += ["<h2>Beside sensors that measure</h2>", _side_by_side(sheet)]
    if sheet.budget is not None:
        parts += ["<h2>Error budget</h2>", *_budget(sheet.budget), *_figure(drawn, "budget")]
    parts += required
    if sheet.recorded:
        parts += ["<h2>Recorded machines</h2>", *_recorded(sheet)]
    parts += ["<h2>The worst machines</h2>", *_worst(sheet)]
    parts += ["<h2>What was assumed</h2>", *_assumed(sheet)]
    open_ended = any(one in part for part in parts for one in (f"{_NO_END})", f"({_NO_END}"))
    return page(f"{title}: data sheet", [*head, *([f"<p>{_OPEN_ENDED}</p>"] if open_ended else []), *parts])


def _source(sheet: Sheet) -> str:
    work = sheet.plan.work
    duty = f"{work.kind}, {work.duration / 60:.3g} min" if work.kind in DRAWN else work.kind
    return (
        f'<p class="source">{escape(sheet.plan.sensor)} sensor; {sheet.machines} machines drawn from their tolerances '
        f"(seed {sheet.plan.seed}, {escape(sheet.plan.method)}), each with a duty of its own ({escape(duty)}), "
        f"{sheet.hours:.3g} h of work; simulated, no machine was measured. ramsight {escape(__version__)}</p>"
    )


def _summary(sheet: Sheet) -> list[str]:
    best = sheet.best
    lines = [
        f"{best.group.capitalize()}, the position is right within "
        f"<strong>{shown(best.quantiles[1], 'm')}</strong> for 95 % of the time, over all machines; 95 % of the "
        f"machines keep {shown(best.machine, 'm')} for 95 % of theirs. The largest error found is {_mm(best.largest)} "
        f"(machine {best.worst})."
    ]
    if best.machines:
        lines.append(
            f"With 95 % confidence at most {100.0 * min(_SURE / best.machines, 1.0):.2g} % of such machines have a "
            "larger largest error in the same time."
        )
    if sheet.failed:
        lines.append(f"{sheet.failed} machines could not be simulated to the end of their duty, and are left out.")
    return [f"<p>{line}</p>" for line in lines]


def _accuracy(sheet: Sheet) -> list[str]:
    head = (
        "",
        "machines",
        *(f"{100 * share:g} %" for share in SHARES),
        "95 % of machines",
        "largest",
        "in the 95 % band",
    )
    rows = (row(_accuracy_cells(k, one)) for k, one in enumerate(sheet.accuracy) if one.machines)
    note = (
        "Magnitude of the error in mm, over all machines and all samples; behind each figure its 95 % interval. "
        "“95 % of machines” keep this for 95 % of their time. Positions that the sensor calls invalid do not count. "
        f"The last line, “{GROUPS[-1]}”, has the samples of all machines whose status is ok, after however many "
        "references."
    )
    return [table(note, head, rows, "numbers")]


def _accuracy_cells(k: int, one: Accuracy) -> list[str]:
    return [
        GROUPS[k],
        str(one.machines),
        *(shown(known, "m", with_unit=False) for known in one.quantiles),
        shown(one.machine, "m", with_unit=False),
        f"{1e3 * one.largest:.3g}",
        f"{100.0 * one.coverage:.1f} %",
    ]


def _terms(sheet: Sheet) -> str:
    rows = (row((one.name, shown(one.known, one.unit), one.how)) for one in sheet.terms)
    return table("", ("term", "figure (95 % interval)", "what is meant"), rows)


def _power_up(sheet: Sheet) -> list[str]:
    if not math.isfinite(sheet.term("time to first position").value):
        return ["<p>This sensor needs the piston's position at power-up.</p>"]
    return [
        "<p>A sensor that has kept its state, or gets the position, has it at once. One without reports "
        "“not referenced” until the piston has met an end stop; the time until then is mostly the duty's, which "
        "goes to a stop when it does.</p>"
    ]


def _status(sheet: Sheet) -> str:
    rows = [row((name, f"{100.0 * share:.2f} %")) for name, share in sheet.validity.items()]
    rows.append(row(("ok, but off by more than 4 standard deviations", f"{100.0 * sheet.ok_but_wrong:.3f} %")))
    if sheet.bound.is_said:
        beyond = f"{sheet.bound.beyond} of {sheet.bound.samples} samples"
        rows.append(row(("ok, but off by more than the bound", beyond)))
        rows.append(row(("the bound, median while ok", f"{1e3 * sheet.bound.median:.1f} mm")))
    return table("Share of the time, position known at power-up", ("", ""), rows, "numbers")


def _side_by_side(sheet: Sheet) -> str:
    terms = [one for one in sheet.terms if any(one.name in other.figures for other in PUBLISHED)]
    head = ("term", "this virtual sensor", *(one.name for one in PUBLISHED))
    rows = [row((one.name, _short(one), *(other.figures.get(one.name, "") for other in PUBLISHED))) for one in terms]
    sources = "; ".join(one.source for one in PUBLISHED)
    return table("", head, rows) + f'<p class="source">Figures of the makers, for 500 mm: {escape(sources)}.</p>'


def _short(one: Term) -> str:
    scale, unit = _SCALES[one.unit]
    sign = "±" if one.name in ("non-linearity", "non-repeatability") else ""
    return f"{sign}{scale * one.known.value:.3g} {unit}" if math.isfinite(one.known.value) else "–"


def _budget(budget: Budget) -> list[str]:
    indices, linear = budget.indices, budget.linear
    order = sorted(range(len(budget.names)), key=lambda k: -(linear.shares if indices is None else indices.total)[k])
    head = ["tolerance", "linear [%]", "one standard deviation makes [mm]"]
    if indices is not None:
        head += ["first order [%]", "total [%]"]
    rows = []
    for k in order:
        cells = [budget.names[k].replace("_", " "), f"{100 * linear.shares[k]:.1f}", f"{1e3 * linear.rms[k]:.3f}"]
        if indices is not None:
            cells += [_share(indices.first[k], indices.first_half[k]), _share(indices.total[k], indices.total_half[k])]
        rows.append(row(cells))
    note = (
        "Shares of the variance of the error, every second after the third reference of one duty. Linear: of the "
        "sensor alone, each tolerance by itself"
    )
    return [table(note, head, rows, "numbers"), *(f"<p>{escape(line)}</p>" for line in _of_indices(budget))]


def _of_indices(budget: Budget) -> Iterable[str]:
    indices = budget.indices
    if indices is None:
        return
    summed, half = float(indices.first.sum()), math.sqrt(float((indices.first_half**2).sum()))
    yield (
        f"First order and total are Sobol's indices on {indices.runs} machines, with 95 % intervals; an index whose "
        f"interval reaches 0 cannot be distinguished from 0. The standard deviation is {_mm(budget.std)}; errors "
        f"beyond {_mm(budget.limit)}, a twentieth of them, count as that."
    )
    yield (
        f"First-order shares sum to {100 * summed:.0f} ± {100 * half:.0f} %; what is missing to 100 % comes of "
        "quantities that work together, and of decisions that the sensor takes one way or the other. The linear "
        f"budget differs from the first-order shares by {100 * budget.agreement:.0f} points at most."
    )
    if budget.failed:
        yield f"{budget.failed} of these machines could not be simulated; they count as the mean of the others."


def _share(value: float, half: float) -> str:
    return f"{100 * value:.1f} ± {100 * half:.1f}"


def _recorded(sheet: Sheet) -> list[str]:
    head = ("log", "error", "its 95 %", "the sheet: 95 % of machines", "its largest", "the sheet's largest", "inside")
    rows = []
    for one in sheet.recorded:
        for k, after in enumerate(one["after"]):
            if after is None:
                continue
            promised = sheet.accuracy[k]
            rows.append(
                row(
                    (
                        one["log"],
                        GROUPS[k],
                        _mm(after["p95"]),
                        _mm(promised.machine.value),
                        _mm(after["largest"]),
                        _mm(promised.largest),
                        "yes" if after["inside"] else "no",
                    )
                )
            )
    note = "Logs with a measured or independently simulated position, tracked by the same sensor"
    return [table(note, head, rows)]


def _worst(sheet: Sheet) -> list[str]:
    quantities = sheet.plan.quantities
    rows = []
    for one in sheet.worst:
        far = sorted(quantities, key=lambda q: -abs(one.values[q.name] - q.spread.centre) / q.spread.std)[:4]
        words = ", ".join(f"{q.name.replace('_', ' ')} {value(one.values[q.name], q.unit)}" for q in far)
        rows.append(row((str(one.machine), _mm(one.largest), words)))
    head = ("machine", "largest error", "farthest from what is described")
    note = "By their largest error after the third reference; a machine's number and the seed make it again"
    return [table(note, head, rows)]


def _assumed(sheet: Sheet) -> list[str]:
    rows = []
    for one in sheet.plan.quantities:
        low, high = one.spread.ends
        mark = "default" if one.is_default else ""
        between = f"{value(low, one.unit)} to {value(high, one.unit)}"
        tolerance = f"{value(one.spread.centre, one.unit)} ± {_half(one.spread.half, one.unit)}"
        rows.append(row((one.name, one.text, tolerance, one.spread.distribution, between, mark, one.source)))
    head = ("quantity", "meaning", "tolerance", "distribution", "drawn between", "", "source")
    text = "<p>What is marked default nobody has said of this machine: say it, and the sheet is about your axis.</p>"
    return [text, table("", head, rows)]


def value(number: float, unit: str) -> str:
    """A value [SI] in the unit that it is shown in."""
    return format_si(number, unit, 5)


def _half(number: float, unit: str) -> str:
    return format_si(number, "delta_K" if unit == "degC" else unit, 3)


def shown(known: Known, unit: str, *, with_unit: bool = True) -> str:
    """A figure with its interval, in the unit that people read.

    Example:
        >>> shown(Known(0.001, 0.0009, 0.0012), "m")
        '1 mm (0.9 to 1.2)'
    """
    scale, word = _SCALES[unit]
    if not math.isfinite(known.value):
        return "–"
    tail = f" {word}" if with_unit else ""
    if math.isnan(known.low):
        return f"{scale * known.value:.3g}{tail}"
    ends = (f"{scale * end:.3g}" if math.isfinite(end) else _NO_END for end in (known.low, known.high))
    return f"{scale * known.value:.3g}{tail} ({' to '.join(ends)})"


def _mm(metres: float) -> str:
    return f"{1e3 * metres:.3g} mm" if math.isfinite(metres) else "–"


def _figure(drawn: Mapping[str, tuple[Figure, str]], name: str) -> list[str]:
    if name not in drawn:
        return []
    figure, caption = drawn[name]
    stream = io.BytesIO()
    figure.savefig(stream, dpi=_DOTS, format="png")
    data = base64.b64encode(stream.getvalue()).decode()
    image = f'<img alt="{escape(name)}" src="data:image/png;base64,{data}">'
    return [f"<figure>{image}<figcaption>{escape(caption)}</figcaption></figure>"]


# Published figures of position sensors that are built into cylinders, to lay a sheet beside.
#
# Each is for a nominal length of 500 mm; where a sheet gives "whichever is greater", that one.


@dataclass(frozen=True)
class Published:
    """What a maker says of a sensor; text, because each says it in his own way."""

    name: str
    figures: dict[str, str]
    source: str  # where it is said


PUBLISHED = (
    Published(
        "Temposonics R-Series RH, SSI",
        {
            "non-linearity": "±0.05 mm (0.01 %)", "hysteresis": "0.004 mm",
            "non-repeatability": "±0.005 mm (0.001 %)", "resolution": "0.002 mm",
            "time to first position": "at once, absolute", "drift without reference": "none, absolute",
        },
        "MTS Systems, Temposonics R Series, synchronous serial interface, product specifications",
    ),
    Published(
        "Balluff BTL5-P/I/L/M1, rod",
        {
            "non-linearity": "±0.1 mm", "hysteresis": "0.004 mm", "non-repeatability": "±0.002 mm, typical",
            "temperature drift": "0.0175 mm/K (35 ppm/K)", "resolution": "0.002 mm",
            "time to first position": "at once, absolute", "drift without reference": "none, absolute",
        },
        "Balluff, BTL5-P/I/L/M1-M-H/W(8)-S, user's guide, 6.1",
    ),
    Published(
        "Balluff BTL7-V50T, profile",
        {
            "non-linearity": "±0.03 mm", "hysteresis": "±0.01 mm", "non-repeatability": "±0.005 mm",
            "temperature drift": "0.009 mm/K (18 ppm/K)", "resolution": "0.001 mm",
            "update time": "1.4 ms (710 Hz)", "time to first position": "at once, absolute",
            "drift without reference": "none, absolute",
        },
        "Balluff, BTL7-V50T-M-P-C003, user's guide, 6.1 and 6.6",
    ),
)  # fmt: skip
"""Three sensors. Empty where a maker says nothing of a term."""


FILES = ("sheet.html", "sheet.json", "assumed.toml")


def write_sheet(sheet: Sheet, found: Dataset, out: Path, title: str, judged: SheetRequirement | None = None) -> None:
    """Write a sheet into a folder; what else is there stays.

    Raises:
        OutputError: it cannot be written.
    """
    page = sheet_page(sheet, title, figures(found, sheet.budget), () if judged is None else judged.html)
    numbers = {} if judged is None else {"requirement": judged.numbers}
    with whole_folder(out, last=FILES[0]) as draft:
        for name, text in zip(FILES, (page, sheet.to_json(numbers), sheet.to_toml()), strict=True):
            (draft / name).write_text(text, encoding="utf-8", newline="\n")
