"""What stands at the end of a table and is no row: statistics, remarks, the header once more."""

from __future__ import annotations

from collections.abc import Sequence

from ramsight.logs.rows import MISSING

MOST_AFTER = 60
"""Lines of a summary at most; more are a table that is damaged."""


def is_after_table(rows: Sequence[Sequence[str]], names: Sequence[str]) -> bool:
    """Whether lines are a summary: each is blank, the header, or begins with a word; and there is one with text.

    Args:
        rows: the cells of each line.
        names: of the columns.

    Example:
        >>> is_after_table([[""], ["Min", "0", "1"]], ["t", "n", "M"]), is_after_table([["0.5", "x"]], ["t", "n"])
        (True, False)
    """
    filled = [cells for cells in rows if any(cell.strip() for cell in cells)]
    return bool(filled) and all(_is_remark(cells, names) for cells in filled)


def _is_remark(cells: Sequence[str], names: Sequence[str]) -> bool:
    first = next(cell for cell in (cell.strip().lstrip("#*=[(</;!_- ") for cell in (*cells, "-")) if cell)
    return [cell.strip() for cell in cells] == list(names) or (
        first[:1].isalpha() and len(first) > 1 and first.lower() not in MISSING | _NUMBERS
    )


_NUMBERS = frozenset(("nan", "inf", "infinity", "true", "false", "ok"))
