"""What happens on a rig at one time and is marked in the strips: faults, references, end stops that are met."""

from __future__ import annotations

from collections.abc import Mapping

Mark = tuple[float, str, str]
"""When [s], what, in a word or two, and on which unit; "" of what happens to all."""
_TOUCHES = 1e-6  # m from an end, within which a piston is on its stop
_LEAVES = 5e-3  # m; a piston that has not gone so far has not left it


class Marks:
    """The marks since they were taken last.

    Args:
        strokes: of the cylinders [m], by unit.
    """

    def __init__(self, strokes: Mapping[str, float]) -> None:
        self._strokes, self._new = dict(strokes), list[Mark]()
        self._met = dict.fromkeys(strokes, False)

    def add(self, time: float, what: str, unit: str = "") -> None:
        """Mark something."""
        self._new.append((round(time, 3), what, unit))

    def moved(self, time: float, unit: str, position: float) -> None:
        """Mark an end stop where a piston [m] meets one."""
        inside = min(position, self._strokes[unit] - position)
        if inside <= _TOUCHES and not self._met[unit]:
            self.add(time, "end stop", unit)
            self._met[unit] = True
        elif inside > _LEAVES:
            self._met[unit] = False

    def taken(self) -> list[Mark]:
        """What has been marked since the last call."""
        found, self._new = self._new, []
        return found
