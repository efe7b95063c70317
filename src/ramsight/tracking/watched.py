"""A log watched while it is tracked: what cannot be this machine's is said, and in the end the likeliest mistake."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TypeVar

import numpy as np

from ramsight.constant import Constant
from ramsight.errors import warn_of_log
from ramsight.logs.channel_map import known_map
from ramsight.logs.channels import is_command
from ramsight.logs.lines import file_name
from ramsight.logs.mapped import ChannelMap, standard_map
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.status import LEAST, Status
from ramsight.signals import Samples, Signals
from ramsight.tracking.mistakes import Explanations, Mistake
from ramsight.tracking.plausible import Seen, findings, noise, reportable
from ramsight.tracking.pressed import TURNING

EXAMINED = Constant(
    6.0, "1", "pieces of a log that mistakes are looked for in: 2 h of samples every 20 ms, at 0.1 s each"
)
_DRIVEN = ("speed", "torque")
S = TypeVar("S", bound=Samples)


class Watch:
    """Looks at the pieces of a log as they pass, and warns after the first, and at the end.

    Attributes:
        mistake: what is most likely wrong with the whole log; None where it fits the machine.
        last_word: what to say of it at the very end, or of what did not fit; empty if there is nothing.
    """

    def __init__(
        self, unit: HydraulicUnit, file: str | Path, channel_map: ChannelMap | str | Path | None = None
    ) -> None:
        known = known_map(channel_map) or standard_map([])
        self._names = {role: one.channel for role, one in known.roles.items()}
        self._names["time"] = (known.time.channel if known.time is not None else "") or "time"
        self._units = {role: one.unit or "" for role, one in known.roles.items()}
        self._unit, self._file = unit, file_name(file)
        self._seen, self._limits, self._said = Seen(), reportable(unit), set[str]()
        self._explanations = Explanations(unit, self._units.get("speed") or "rpm")
        self.mistake: Mistake | None = None
        self.last_word = ""

    def over(self, pieces: Iterable[S]) -> Iterator[S]:
        """The pieces of a drive log as they are, in order; looked at before each is passed on."""
        for number, piece in enumerate(pieces):
            self._seen.take(piece, TURNING * self._unit.max_speed, self._limits.leaking)
            if number < EXAMINED and not any(map(is_command, Signals.of(piece).names)):
                self._explanations.take(piece)  # a valve that turns round what the pump does is not followed
            if number == 0:
                self._warn()
            yield piece
        self._warn()

    def _warn(self) -> None:
        self.mistake = self._explanations.mistake
        found = list(findings(self._seen, self._limits, self._units))
        if self.mistake is not None:
            found = _led_by(self.mistake, found)
        self.last_word = next((text for _, text in found), "")
        if not (found or self._said) and (text := noise(self._seen, self._limits)):  # in another unit it is another one
            found = [("noise", text)]
        for role, text in found:
            if role not in self._said:
                self._said.add(role)
                warn_of_log(text, file=self._file, column=self._names.get("torque" if role == "noise" else role))


def watched(
    pieces: Iterable[S], unit: HydraulicUnit, file: str | Path, channel_map: ChannelMap | str | Path | None = None
) -> Iterator[S]:
    """The pieces of a drive log as they are; warns after the first, and at the end, of what cannot be the machine's."""
    return Watch(unit, file, channel_map).over(pieces)


def _led_by(mistake: Mistake, found: list[tuple[str, str]]) -> list[tuple[str, str]]:
    """What does not fit, the likeliest mistake first; it explains what else was found of speed and torque.

    A unit that fits is asked for as before, unless it is another mistake that is likelier.
    """
    known = dict(found)
    role, text = mistake.role, mistake.text
    asked = known.get("torque", "").endswith("?") and mistake.is_of_torque
    if role == "speed":
        text = known.get("speed", text)
    elif role == "torque" and asked:
        text = f"{text}: {known['torque'].rpartition(': ')[2]}"
    elif role == "machine" and asked:
        role, text = "torque", f"{known['torque']} Or is the log another machine's?"
    return [(role, text), *(one for one in found if one[0] not in _DRIVEN)]


def contradicted(tracked: Signals, mistake: Mistake) -> Signals:
    """A track of a log that contradicts the machine: what it says of the position is invalid, and names the cause."""
    cause = Status.IMPLAUSIBLE_SPEED if mistake.role == "speed" else Status.IMPLAUSIBLE_TORQUE
    status = tracked["status"].values
    return tracked.replaced({"status": np.where(status >= LEAST[1], status, int(cause)).astype(status.dtype)})
