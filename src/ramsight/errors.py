"""What can go wrong, said in one line: where, what was found and what would have been right.

Every error that a user can cause is a `RamsightError`; the command line prints its text and exits with 2.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from typing import Any

_LONGEST, _MOST = 120, 40  # letters of a value, and names or mistakes of a list, that a message repeats
MISTAKES = _MOST
"""Of a file that are listed; nobody mends more at a time."""


def short(text: str) -> str:
    """A text that a message can repeat: cut in the middle if it is long.

    Example:
        >>> len(short("x" * 200_000))
        120
    """
    half = (_LONGEST - 1) // 2
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - half - 1]}…{text[-half:]}"


def one_line(text: object) -> str:
    r"""A text with its control characters escaped: nothing that a terminal or an XML file takes for a command.

    Example:
        >>> one_line("a\nb \x1b[31m")
        'a\\nb \\x1b[31m'
    """
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in str(text))


def printable(text: object) -> str:
    r"""A text of some lines with every other control character escaped.

    Example:
        >>> printable("one\ntwo\x1b[2J")
        'one\ntwo\\x1b[2J'
    """
    return "\n".join(one_line(line) for line in str(text).split("\n"))


def plain(text: str | None) -> str:
    r"""A name that a message can repeat: on one line, cut in the middle if it is long.

    Example:
        >>> plain("a\nb")
        'a\\nb'
    """
    return short(one_line(text or ""))


class RamsightError(Exception):
    """Base of every error that a user can cause and mend. Its text is one line.

    Attributes:
        others: what is wrong beside it in the same file; its text gives their number.
    """

    others: tuple[RamsightError, ...] = ()

    def __reduce__(self) -> tuple[Any, ...]:
        """For other processes: an error of a worker is the same where it is waited for."""
        return _again, (type(self), self.args, vars(self))

    def __str__(self) -> str:
        """What is wrong, and how much more."""
        return one_line(super().__str__()) + (f" (and {len(self.others)} more)" if self.others else "")


def _again(kind: type[RamsightError], args: tuple[object, ...], known: Mapping[str, object]) -> RamsightError:
    """An error as it was in another process; its text is made already."""
    error = kind.__new__(kind)
    error.args = args
    vars(error).update(known)
    return error


class DescriptionError(RamsightError):
    """A machine description, or a value passed on the command line or to a function, that cannot be used.

    Args:
        message: what is wrong, in words.
        file: the file it stands in, or `None` where there is no file.
        key: dotted path of the value, for example ``units.boom.cylinder.bore``.
        value: the value as it was passed.
        allowed: the range or the choices that would be right, in the user's units.
    """

    def __init__(
        self,
        message: str,
        *,
        file: str | None = None,
        key: str | None = None,
        value: object = None,
        allowed: str | None = None,
    ) -> None:
        self.message, self.file, self.key, self.value, self.allowed = message, file, key, value, allowed
        place = ": ".join(part for part in (file, plain(key)) if part)
        passed = plain(repr(value)) if value is not None else ""
        head = " = ".join(part for part in (place, passed) if part)
        head = f"{head}: " if head else ""
        tail = f" (allowed: {allowed})" if allowed else ""
        super().__init__(f"{head}{message}{tail}")


def first_of(errors: Sequence[RamsightError], further: int = 0) -> RamsightError:
    """The first of some errors, with the others beside it.

    Args:
        errors: all that is wrong with a file, one at least; 40 of them are listed.

    Example:
        >>> error = first_of([DescriptionError("is missing", key="bore"), DescriptionError("is missing", key="rod")])
        >>> str(error), [str(one) for one in error.others]
        ('bore: is missing (and 1 more)', ['rod: is missing'])
    """
    listed, rest = list(errors[:MISTAKES]), len(errors) - MISTAKES + further
    for error in listed:
        error.others = ()
    if rest > 0:
        listed.append(RamsightError(f"and {rest} more mistakes"))
    listed[0].others = tuple(listed[1:])
    return listed[0]


class UnknownNameError(RamsightError):
    """A name that is not in a list of known names.

    Args:
        kind: what was looked for, for example ``unit``.
        name: the name as it was passed.
        known: the names that exist.
        where: the place that was searched, for example a file.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str], where: str | None = None) -> None:
        self.kind, self.name, self.known, self.where = kind, name, sorted(known), where
        close = get_close_matches(name[:_LONGEST], self.known, n=1)
        hint = f"; did you mean {short(close[0])!r}?" if close else ""
        listing = ", ".join(plain(one) for one in self.known[:_MOST]) or "none"
        more = f", and {len(self.known) - _MOST} more" if len(self.known) > _MOST else ""
        place = f"{where}: " if where else ""
        super().__init__(f"{place}unknown {kind} {short(name)!r}{hint} (known: {listing}{more})")


class LogError(RamsightError):
    """A drive log, or a truth file, that cannot be read.

    Args:
        message: what is wrong, in words.
        file: the file.
        line: line in the file, from 1, the header included.
        column: name of the column.
    """

    def __init__(self, message: str, *, file: str, line: int | None = None, column: str | None = None) -> None:
        self.file, self.line, self.column = file, line, column
        super().__init__(f"{_place(file, line, column)}: {message}")


class LogWarning(UserWarning):
    """Something in a log that is left out or looks wrong, though the log can be read; its text is one line."""


def warn_of_log(message: str, *, file: str, line: int | None = None, column: str | None = None) -> None:
    """Warn of something in a log.

    Args:
        message: what it is, what was done about it, and what the user can do.
        line: line in the file, from 1.
    """
    warnings.warn(LogWarning(one_line(f"{_place(file, line, column)}: {message}")), stacklevel=3)


def _place(file: str, line: int | None, column: str | None) -> str:
    """File, line and column as messages begin with them."""
    place = file
    if line is not None:
        place += f", line {line}"
    if column is not None:
        place += f", column {short(column)}"
    return place


class MissingColumnError(LogError):
    """A log without a column that is needed.

    Args:
        file: the file.
        missing: the columns that are needed and absent.
        found: the columns that the file has.
        what_next: what to do about it, "" if nothing is to be said.
    """

    def __init__(self, *, file: str, missing: Sequence[str], found: Sequence[str], what_next: str = "") -> None:
        self.missing, self.found = list(missing), list(found)
        word = "column" if len(self.missing) == 1 else "columns"
        what = f"missing {word} {', '.join(self.missing)}; found {', '.join(self.found)}"
        super().__init__(f"{what}; {what_next}" if what_next else what, file=file)


class SimulationError(RamsightError):
    """A simulated run that did not reach its end; the text names the place and the remedy."""


class OutputError(RamsightError):
    """A result that cannot be written where it was asked for."""


class MissingPackageError(RamsightError, ImportError):
    """A package that is not installed; the text states which extra of ramsight installs it."""
