"""The tolerance between a virtual sensor and a real one, from how far each may be off."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ramsight.api.following import Quantity
from ramsight.api.tracking import track
from ramsight.argument_kinds import by_kind
from ramsight.logs.channel_map import AnyMap
from ramsight.machine.assumption_description import SURE_START
from ramsight.optional import check_extra
from ramsight.plant.build import AnyUnit, build
from ramsight.plant.unit import assuming
from ramsight.sensor.virtual_sensor import BOUND
from ramsight.signals import Dataset
from ramsight.tracking.availability import LONGEST_ALERT, TIME_TO_ALERT
from ramsight.tracking.channel_tolerance import Asked, Channels, DerivedTolerance, derive, stated_std
from ramsight.units import argument, format_si

_HOUR = 3600.0


@dataclass(frozen=True)
class ToleranceReport:
    """A tolerance, and what it achieves."""

    derived: DerivedTolerance  # the figures

    @property
    def tolerance(self) -> float | None:
        """The tolerance, if it achieves all that is asked [m]."""
        return self.derived.tolerance if self.derived.possible else None

    @property
    def text(self) -> str:
        """The verdict, or what would be possible, in a few lines."""
        found, asked = self.derived, self.derived.asked
        when = "at once" if asked.within == 0.0 else f"within {asked.within:g} s"
        errors = f"of errors of {1e3 * asked.drift:g} mm {when}"
        lines = []
        if found.tolerance is None:
            lines.append("failed: no tolerance up to the stroke has so few false alerts")
        else:
            reached = (
                f"tolerance {1e3 * found.tolerance:.2f} mm: at most {_HOUR * found.rate:.1e} false alerts an hour, "
                f"finds {100 * found.coverage:.1f} % {errors}"
            )
            lines += [f"passed: {reached}"] if found.possible else ["failed: no tolerance gives both", f"  {reached}"]
        if not found.possible:
            lines += [f"  {line}" for line in _instead(found, errors)]
        return "\n".join([*lines, f"compared for {100 * found.checked:.1f} % of the time; {_ASSUMED}"])


_ASSUMED = "beyond the sensor's bound its error is assumed to be normal"


def _instead(found: DerivedTolerance, errors: str) -> list[str]:
    """What would be possible."""
    share = f"{100 * found.asked.coverage:g} %"
    lines = []
    if found.narrow is None:
        lines.append(
            f"no tolerance finds {share} {errors}; the narrowest, 0, finds {100 * found.narrow_coverage:.1f} %"
        )
    else:
        often = f"up to {_HOUR * found.narrow_rate:.1e} false alerts an hour"
        lines.append(f"tolerance {1e3 * found.narrow:.2f} mm: finds {share} {errors}, with {often}")
    if found.tolerance is not None:
        with_it = f"with {1e3 * found.tolerance:.2f} mm"
        lines.append(
            f"{with_it}, {share} are found of no error up to the stroke"
            if found.least_drift is None
            else f"{with_it}, {share} are found of errors from {1e3 * found.least_drift:.1f} mm on"
        )
    return lines


@by_kind
def derive_tolerance(
    machine: AnyUnit,
    log: str | Path | Dataset,
    *,
    dc: str | float,
    false_alarms: str | float,
    other_std: Quantity,
    drift: Quantity,
    within: Quantity = 0.0,
    unit: str | None = None,
    time_to_alert: Quantity = TIME_TO_ALERT,
    start: Quantity | None = None,
    channel_map: AnyMap | None = None,
    progress: bool = False,
) -> ToleranceReport:
    """Derive the tolerance of a comparison from the error distributions of both sensors.

    The virtual sensor states its own along the log; that of the real one is declared. The smallest tolerance with few
    enough false alerts is taken, and it is judged by the share of errors that it finds.

    Args:
        machine: the unit, or what `build` makes one of.
        log: of its drive, as `ramsight.track` takes it: days like those that the comparison will see.
        dc: share of errors of the size `drift` that are to be found, ``"90 %"``.
        false_alarms: rate of false alerts that is accepted [1/s], or ``"1e-5/h"``.
        other_std: standard deviation of all that the real sensor may be off by [m].
        drift: size of an error of either sensor that stays [m].
        within: time in which it is to be found [s], 0 to 1 h; by default at once, after the time to alert.
        unit: name of the unit, if the machine has several.
        time_to_alert: for which both have to be apart [s], 0 to 1 min.
        start: position at the first sample [m], as `ramsight.track`'s.
        channel_map: of a file.
        progress: show a bar on a terminal if it takes long.

    Returns:
        The tolerance, or what would be possible instead.

    Raises:
        DescriptionError: a quantity cannot be read or is out of range.
        UnknownNameError: no such machine or unit.
        LogError: the log cannot be read.

    Example:
        >>> import ramsight
        >>> boom = ramsight.build("mining-loader", unit="boom")
        >>> log = ramsight.drive_report(ramsight.simulate(boom, load="200 kN", start="120 mm"))
        >>> asked = dict(dc="90 %", false_alarms="1e-5/h", other_std="0.3 mm", drift="50 mm", start="120 mm")
        >>> found = ramsight.derive_tolerance(boom, log, **asked)
        >>> found.text.splitlines()[0].split(":")[0]
        'passed'
    """
    check_extra("identify")
    built = build(machine, unit)
    stroke = float(built.cylinder.stroke)
    longest = format_si(stroke, "mm")
    asked = Asked(
        argument(dc, "1", "dc", least="1 %", most="99.99 %"),
        argument(_as_rate(false_alarms), "1/s", "false_alarms", least="1e-12 1/h", most="1000 1/h"),
        argument(drift, "m", "drift", least="0.01 mm", most=longest),
        argument(within, "s", "within", least="0 s", most="3600 s"),
    )
    other = argument(other_std, "m", "other_std", least="0.001 mm", most=longest)
    alert = argument(time_to_alert, "s", "time_to_alert", least="0 s", most=f"{LONGEST_ALERT:g} s")
    if start is not None:
        built = assuming(built, SURE_START)
    found = track(built, log, start, channel_map=channel_map, progress=progress)
    known = {
        name: np.nan_to_num(found[name].values)
        for name in ("position", "position_std", "position_low", "position_high", BOUND)
    }
    channels = Channels.of(
        found["time"].values,
        found["status"].values.astype(np.int64),
        known[BOUND],
        stated_std(*known.values()),
        other_std=other,
        time_to_alert=alert,
        stroke=stroke,
    )
    return ToleranceReport(derive(channels, asked))


def _as_rate(rate: str | float) -> str | float:
    """A rate as quantities are written: ``1e-5/h`` is ``1e-5 1/h``."""
    return re.sub(r"^\s*([^\s/]+)\s*/", r"\1 1/", rate) if isinstance(rate, str) else rate
