"""A commissioning as a page to sign."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterable, Sequence
from datetime import datetime
from html import escape

from ramsight._version import __version__
from ramsight.calibration.identify import Identification
from ramsight.calibration.identify_report import WORDS
from ramsight.calibration.leakage import LeakTest
from ramsight.calibration.loss_uncertainty import dependence
from ramsight.output.html_page import page, row, table
from ramsight.study.commissioning.finding import Finding, Verdict
from ramsight.study.commissioning.kept_values import HEAD, Change
from ramsight.study.commissioning.walk import Commissioning
from ramsight.tracking.figures import draw_track
from ramsight.units import FREEZING, RPM

_CLASS = {Verdict.PASSED: "good", Verdict.LOOK_TWICE: "fair", Verdict.FAILED: "bad", Verdict.OPEN: "open"}
_WORDS = {
    Verdict.PASSED: "The sensor may be relied on as far as it says.",
    Verdict.LOOK_TWICE: "The sensor works; before it is relied on, whoever signs has looked at the reasons below.",
    Verdict.FAILED: "The sensor must not be relied on.",
}
_SIGNED = ("Name", "Role", "Machine or serial number", "Place and date", "Signature")
_SUMS = ".sums td:last-child { font-family: monospace; overflow-wrap: anywhere; }"
_DOTS = 110  # per inch; a page of some hundred kilobytes


Channel = tuple[str, str, str, str, str, str, str]
"""Of a channel as text: what it is, its name, unit, sign, scale, offset, and what it stands for."""


def commissioning_page(
    done: Commissioning,
    title: str,
    sources: Sequence[tuple[str, str, str]],
    channels: Sequence[Channel],
    made: datetime,
) -> str:
    """The report of a commissioning: verdict, reasons, every check, what it rests on, the track, room to sign.

    Args:
        sources: of each file what it is, its name and its SHA-256.

    Returns:
        HTML that needs no other file.
    """
    parts = [f"<h1>{escape(title)}: commissioning of the virtual position sensor</h1>"]
    parts += [f"<p>{_pill(done.verdict)} {escape(_WORDS[done.verdict])}</p>", *_reasons(done.reasons)]
    when = f"{made:%Y-%m-%d %H:%M} (UTC{made:%z})"
    parts.append(f'<p class="source">Report of {when}, by ramsight {escape(__version__)}, on these files:</p>')
    parts.append(table("", ("file", "name", "SHA-256"), (row(source) for source in sources), "sums"))
    parts += ["<h2>What was looked at</h2>", _checks(done.findings)]
    parts += ["<h2>The log as it was read</h2>"]
    head = ("quantity", "channel", "unit", "sign", "scale", "offset", "stands for")
    parts.append(table("sign × (scale × number + offset), in the unit", head, (row(channel) for channel in channels)))
    parts += _leak_test(done.leak_test) if done.leak_test is not None else []
    parts += _factors(done.identification) if done.identification is not None else []
    parts += _changes(done.changes) if done.changes else []
    parts += _picture(done) if done.track is not None else []
    parts += ["<h2>Signed</h2>", table("", ("", ""), (row((word, " ")) for word in _SIGNED), "signed")]
    return page(f"{title}: commissioning", parts, _SUMS)


def _pill(verdict: Verdict) -> str:
    return f'<span class="verdict {_CLASS[verdict]}">{verdict.value}</span>'


def _reasons(findings: Iterable[Finding]) -> list[str]:
    lines = [f"<li><strong>{escape(one.check)}</strong>: {escape(one.remedy or one.found)}</li>" for one in findings]
    return ["<ul>", *lines, "</ul>"] if lines else []


def _checks(findings: Iterable[Finding]) -> str:
    rows = [
        f"<tr><td>{escape(one.check)}</td><td>{_pill(one.verdict)}</td><td>{escape(one.found)}</td>"
        f"<td>{escape(one.remedy)}</td></tr>"
        for one in findings
    ]
    return table("", ("check", "verdict", "found", "what to do"), rows)


def _leak_test(test: LeakTest) -> list[str]:
    rows = (
        row(
            (
                f"{one.start:.1f} to {one.end:.1f}",
                f"{one.motor_speed / RPM:.0f}",
                f"{one.pressure / 1e5:.1f}",
                f"{one.oil_temperature - FREEZING:.1f}",
                f"{one.factor:.3f}",
            )
        )
        for one in test.stretches
    )
    head = ("time [s]", "motor speed [rpm]", "pressure [bar]", "oil [°C]", "leakage over the data sheet's")
    return ["<h2>Leak test</h2>", table(dependence(test.per_kelvin, test.per_torque), head, rows, "numbers")]


def _factors(found: Identification) -> list[str]:
    rows = (
        row((WORDS[name], *(f"{v:.4f}" for v in (one.value, one.low, one.high, one.per_kelvin, one.per_torque))))
        if one.identified
        else row((WORDS[name], "not identified", "", "", "", ""))
        for name, one in found.factors.items()
    )
    head = ("factor on the data sheet", "value", "95 % from", "to", "oil 1 K warmer", "torque 1 % larger")
    note = f"{found.moves} moves over {found.duration:.0f} s, {found.loads} loads lifted and lowered"
    return ["<h2>Identified</h2>", table(note, head, rows, "numbers")]


def _changes(changes: Sequence[Change]) -> list[str]:
    note = "over the description that was kept, with 95 % intervals"
    return ["<h2>Changed since</h2>", table(note, HEAD, (row(one.cells) for one in changes), "numbers")]


def _picture(done: Commissioning) -> list[str]:
    track, stream = done.track, io.BytesIO()
    assert track is not None
    true = track[["true_position"]].rename(true_position="position") if "true_position" in track else None
    draw_track(done.log, track, true, f"{done.unit}: what the sensor made of the log").savefig(
        stream, dpi=_DOTS, format="png"
    )
    data = base64.b64encode(stream.getvalue()).decode()
    return ["<h2>Track</h2>", f'<figure><img alt="track" src="data:image/png;base64,{data}"></figure>']
