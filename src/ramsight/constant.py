"""A number that decides something: it stands once, in a table of its room, with its unit and where it comes from."""

from __future__ import annotations

from collections.abc import Mapping


class Constant(float):
    """A plain number that knows its unit and its reason.

    Args:
        reason: the derivation, the declared noise, the stated probability or the source that it follows from.

    Example:
        >>> step = Constant(0.06, "rad/s", "half a step of 1 rpm, in which drives report speeds")
        >>> 2.0 * step, step.unit
        (0.12, 'rad/s')
    """

    unit: str
    reason: str

    def __new__(cls, value: float, unit: str, reason: str) -> Constant:
        """A number with its unit and reason."""
        made = super().__new__(cls, value)
        made.unit, made.reason = unit, reason
        return made

    def __getnewargs__(self) -> tuple[float, str, str]:  # type: ignore[override]  # float has one argument
        """Arguments that pickling makes it again of."""
        return float(self), self.unit, self.reason


def constants_of(module: object) -> Mapping[str, Constant]:
    """All constants of a table, by their names, in its order."""
    return {name: value for name, value in vars(module).items() if isinstance(value, Constant)}
