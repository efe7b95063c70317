"""Numbers in text, of the ten digits alone: Python reads those of every script, and 1_000."""

from __future__ import annotations


def is_digits(text: str) -> bool:
    """Whether a text is digits and nothing else.

    Example:
        >>> is_digits("12"), is_digits("\u0661"), is_digits("\u00b2"), is_digits("")
        (True, False, False, False)
    """
    return text.isascii() and text.isdigit()


def whole(text: str, base: int = 10) -> int:
    """A whole number.

    Raises:
        ValueError: it is none.

    Example:
        >>> whole("7F", 16)
        127
    """
    if not text.isascii() or "_" in text:
        raise ValueError(text)
    return int(text, base)


def decimal(text: str) -> float:
    """A number with a decimal point.

    Raises:
        ValueError: it is none.

    Example:
        >>> decimal("1e3")
        1000.0
    """
    if not text.isascii() or "_" in text:
        raise ValueError(text)
    return float(text)
