"""A table of TOML that is read key by key, with errors that name file, key, value and what is allowed."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any

from ramsight.errors import DescriptionError, short
from ramsight.units import parse


class Keys:
    """A table of TOML whose keys are taken one by one; what is left over at the end is rejected."""

    def __init__(self, table: Mapping[str, Any], file: str, path: str = "") -> None:
        self.file, self.path = file, path
        self._left, self._known, self._given = dict(table), list[str](), dict(table)

    def take(self, key: str, kind: type | tuple[type, ...], default: Any) -> Any:
        """The value of a key, of this type."""
        self._known.append(key)
        value = self._left.pop(key, default)
        if key in self._given and (not isinstance(value, kind) or isinstance(value, bool)):
            kinds = kind if isinstance(kind, tuple) else (kind,)
            words = {int: "a whole number", float: "a number", str: "a text", list: "a list", dict: "a table"}
            raise self.wrong(key, "is of another kind", " or ".join(words[one] for one in kinds))
        return value

    def quantity(self, key: str, unit: str) -> float | None:
        """The value of a key in SI, written with its unit."""
        value = self.take(key, (str, int, float), None)
        if value is None:
            return None
        try:
            return parse(value, unit)
        except DescriptionError as error:
            raise self.wrong(key, error.message, None) from None

    def choice(self, key: str, choices: Mapping[str, Any], default: Any) -> Any:
        """What one of some words stands for."""
        value = self.take(key, str, None)
        if value is None:
            return default
        if value not in choices:
            raise self.wrong(key, "is none of the choices", ", ".join(choices))
        return choices[value]

    def flag(self, key: str) -> bool | None:
        """Whether something is so; None where nothing is said."""
        self._known.append(key)
        value = self._left.pop(key, None)
        if value is not None and not isinstance(value, bool):
            raise self.wrong(key, "is of another kind", "true or false")
        return value

    def table(self, key: str) -> Keys | None:
        """A table under this one."""
        value = self.take(key, dict, None)
        return None if value is None else Keys(value, self.file, f"{self.path}{key}.")

    def tables(self, key: str) -> list[Keys]:
        """An array of tables under this one; one table is as good."""
        value = self.take(key, (dict, list), [])
        listed = [value] if isinstance(value, dict) else value
        if not all(isinstance(one, dict) for one in listed):
            raise self.wrong(key, "is of another kind", f"tables [[{key}]]")
        return [Keys(one, self.file, f"{self.path}{key}[{k}].") for k, one in enumerate(listed)]

    def wrong(self, key: str, message: str, allowed: str | None) -> DescriptionError:
        """The error for a key."""
        return DescriptionError(
            message, file=self.file, key=f"{self.path}{key}", value=self._given.get(key), allowed=allowed
        )

    def names(self) -> list[str]:
        """The keys that are there."""
        return list(self._left)

    def end(self) -> None:
        """Refuse keys that nobody took."""
        for key in self._left:
            close = get_close_matches(short(key), self._known, n=1)
            hint = f"; did you mean {close[0]!r}?" if close else ""
            raise DescriptionError(
                f"is not a key of a channel map{hint}",
                file=self.file,
                key=f"{self.path}{key}",
                allowed=", ".join(self._known),
            )
