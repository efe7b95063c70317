"""What the report is made of: statements with verdicts, pictures, and chapters that hold them with their numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import Any


class Verdict(Enum):
    """How a statement of the paper fared here."""

    REPRODUCED = "reproduced"
    FITTED = "reproduced with a fitted value"
    CONTRADICTED = "contradicted"
    NOT_TESTABLE = "not testable"

    @classmethod
    def of(cls, holds: bool, *, fitted: bool = False) -> Verdict:
        """Whether it came out as the paper states.

        Args:
            holds: it did.
            fitted: a value was fitted to the paper's result for that.
        """
        if not holds:
            return cls.CONTRADICTED
        return cls.FITTED if fitted else cls.REPRODUCED


@dataclass(frozen=True)
class Statement:
    """A statement of the paper beside what came out here.

    Args:
        place: where the paper states it.
        paper: what it says.
        ours: what came out, with numbers.
        verdict: whether the two agree.
    """

    place: str
    paper: str
    ours: str
    verdict: Verdict


@dataclass(frozen=True)
class Picture:
    """A figure to be drawn.

    Args:
        name: of its files, without suffix.
        caption: below it.
        draw: fills a matplotlib figure.
        size: width and height [inch].
    """

    name: str
    caption: str
    draw: Callable[[Any], None]
    size: tuple[float, float] = (7.2, 4.0)


@dataclass(frozen=True)
class Grid:
    """A small table of the report.

    Args:
        caption: above it.
        head: its columns.
        rows: its cells, as text.
    """

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Chapter:
    """A part of the study.

    Args:
        title: of the chapter.
        text: its paragraphs.
        numbers: nested by name; names end in their unit.
        statements: what of the paper it decides.
        pictures, grids: its figures and tables.
    """

    title: str
    text: tuple[str, ...]
    numbers: dict[str, Any]
    statements: tuple[Statement, ...] = ()
    pictures: tuple[Picture, ...] = ()
    grids: tuple[Grid, ...] = ()


@dataclass
class Study:
    """All chapters.

    Attributes:
        chapters: in the report's order.
        chosen: what was chosen of what the paper leaves open, in a sentence each.
    """

    chapters: list[Chapter] = field(default_factory=list)
    chosen: tuple[str, ...] = ()

    @property
    def statements(self) -> list[Statement]:
        """All statements, in the chapters' order."""
        return [statement for chapter in self.chapters for statement in chapter.statements]

    @property
    def pictures(self) -> list[Picture]:
        """All pictures, in the chapters' order."""
        return [picture for chapter in self.chapters for picture in chapter.pictures]

    @property
    def numbers(self) -> dict[str, Any]:
        """All numbers, nested by name."""
        merged: dict[str, Any] = {}
        for chapter in self.chapters:
            _merge(merged, chapter.numbers)
        return merged

    def summary(self) -> str:
        """How many statements fared how, in a line."""
        counts = dict.fromkeys(Verdict, 0)
        for statement in self.statements:
            counts[statement.verdict] += 1
        parts = [f"{count} {verdict.value}" for verdict, count in counts.items() if count]
        return f"{len(self.statements)} statements of the paper: {', '.join(parts)}"


def _merge(into: dict[str, Any], more: dict[str, Any]) -> None:
    for key, value in more.items():
        if isinstance(value, dict) and isinstance(into.get(key), dict):
            _merge(into[key], value)
        elif key in into:
            raise ValueError(f"two chapters give a number the name {key!r}")
        else:
            into[key] = value
