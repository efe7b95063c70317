"""The report as a PDF, set with matplotlib: A4 pages with all figures first, then text, statements and tables."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ramsight.optional import needing
from reproduction.chapter import Chapter, Grid, Study, Verdict
from reproduction.coverage import drawn
from reproduction.markdown import COVERAGE, INTRODUCTION, MEANING, SOURCE, STATEMENTS, TITLE, typeset

_PAPER = (8.27, 11.69)  # inch, A4
_LEFT, _TOP, _BOTTOM = 0.09, 0.945, 0.06  # shares of the page
_LETTERS = 104  # of a line at the size of the text
_SIZE, _LINE = 8.5, 0.0131  # pt, share of the page's height
_CELL_SIZE, _CELL_LINE, _CELL_LETTERS = 6.8, 0.0105, 108
_WHAT = "What was done"
_WIDE = 1.0 - 2.0 * _LEFT
_COLOURS = {
    Verdict.REPRODUCED: "#17603a",
    Verdict.FITTED: "#7a5200",
    Verdict.CONTRADICTED: "#8c2410",
    Verdict.NOT_TESTABLE: "#5b6875",
}


class _Pages:
    """Pages that fill from the top."""

    def __init__(self, file: Any) -> None:
        self._file, self._number, self._y = file, 0, 0.0
        self._page: Any = None

    def room(self, height: float) -> None:
        """Begin a new page if so much of its height is not left."""
        if self._page is None or self._y - height < _BOTTOM:
            self._begin()

    def _begin(self) -> None:
        with needing("figures"):
            from matplotlib.figure import Figure

        self.close()
        self._number += 1
        self._page, self._y = Figure(figsize=_PAPER), _TOP
        self._page.text(0.5, 0.03, str(self._number), ha="center", fontsize=7, color="#5b6875")

    def text(
        self, text: str, *, size: float = _SIZE, letters: int = _LETTERS, line: float = _LINE, **look: Any
    ) -> None:
        """A paragraph.

        Args:
            text: of it.
            size: of its letters [pt].
            letters: of a line.
            line: height of one, as a share of the page.
            look: further options of the text.
        """
        lines = textwrap.wrap(typeset(text), letters)
        self.room(line * len(lines))
        for one in lines:
            self._write(_LEFT, one, size, **look)
            self._y -= line
        self._y -= 0.4 * line

    def _write(self, x: float, text: str, size: float, **look: Any) -> None:
        if self._page is not None:
            self._page.text(x, self._y, text, fontsize=size, va="top", parse_math=False, **look)

    def row(self, cells: Sequence[tuple[float, list[str]]], *, size: float, line: float, **look: Any) -> None:
        """Cells beside each other, each with its place and its lines."""
        height = line * max(len(lines) for _, lines in cells)
        self.room(height)
        top = self._y
        for x, lines in cells:
            self._y = top
            for one in lines:
                self._write(x, one, size, **look)
                self._y -= line
        self._y = top - height - 0.35 * line

    def picture(self, file: Path, size: tuple[float, float]) -> None:
        """A picture from a file, in the page's width."""
        with needing("figures"):
            import matplotlib.image as images

        height = _WIDE * _PAPER[0] * size[1] / size[0] / _PAPER[1]
        self.room(height)
        if self._page is not None:
            axes = self._page.add_axes((_LEFT, self._y - height, _WIDE, height))
            axes.imshow(images.imread(file), aspect="auto", interpolation="antialiased")
            axes.set_axis_off()
        self._y -= height + 0.005

    def space(self, height: float) -> None:
        """Leave some of the page empty."""
        self._y -= height

    def close(self) -> None:
        """Write the page that was begun."""
        if self._page is not None:
            self._file.savefig(self._page, dpi=160)
            self._page = None


def write_pdf(study: Study, folder: Path, file: Path) -> None:
    """Write the report.

    Args:
        study: what to report.
        folder: where its figures were drawn.
        file: to write.
    """
    with needing("figures"):
        from matplotlib.backends.backend_pdf import PdfPages

    with PdfPages(file, metadata={"Title": TITLE, "CreationDate": None}) as pdf:
        pages = _Pages(pdf)
        pages.text(TITLE, size=15, letters=60, line=0.022, weight="bold")
        pages.text(SOURCE, color="#5b6875")
        pages.text(f"{study.summary()}. {MEANING}")
        _pictures(pages, study, folder)
        _heading(pages, _WHAT)
        for paragraph in (*INTRODUCTION, *study.chosen):
            pages.text(paragraph)
        _heading(pages, STATEMENTS)
        for statement in study.statements:
            colour = _COLOURS[statement.verdict]
            pages.room(5 * _LINE)
            pages.text(f"{statement.place}: {statement.verdict.value}", color=colour, weight="bold")
            pages.text(statement.paper, style="italic")
            pages.text(statement.ours)
            pages.space(0.4 * _LINE)
        _heading(pages, COVERAGE)
        for item in drawn(study):
            pages.text(f"{item.place}: {item.says} ({item.where}). {item.verdict.value.capitalize()}.")
        for chapter in study.chapters:
            _chapter(pages, chapter)
        pages.close()


def _heading(pages: _Pages, title: str) -> None:
    pages.space(_LINE)
    pages.room(8 * _LINE)
    pages.text(title, size=12, letters=75, line=0.019, weight="bold")


def _pictures(pages: _Pages, study: Study, folder: Path) -> None:
    """All figures, each with its caption, below the titles of their chapters."""
    for chapter in study.chapters:
        for k, picture in enumerate(chapter.pictures):
            if k == 0:
                height = _WIDE * _PAPER[0] * picture.size[1] / picture.size[0] / _PAPER[1]
                pages.room(height + 4 * _LINE)  # a title stays with its first figure
                pages.text(chapter.title, weight="bold")
            pages.picture(folder / f"{picture.name}.png", picture.size)
            pages.text(picture.caption, size=7.5, letters=118, color="#5b6875")


def _chapter(pages: _Pages, chapter: Chapter) -> None:
    _heading(pages, chapter.title)
    for paragraph in chapter.text:
        pages.text(paragraph)
    for grid in chapter.grids:
        _grid(pages, grid)


def _grid(pages: _Pages, grid: Grid) -> None:
    pages.room(5 * _LINE)
    pages.text(grid.caption, style="italic")
    letters = _widths(grid)
    for k, cells in enumerate((grid.head, *grid.rows)):
        weight = "bold" if k == 0 else "normal"
        pages.row(list(_placed(cells, letters)), size=_CELL_SIZE, line=_CELL_LINE, weight=weight)
    pages.space(_LINE)


def _widths(grid: Grid) -> list[int]:
    """Letters of each column: what it needs if all fits, else shares of the line."""
    columns = zip(grid.head, *grid.rows, strict=True)
    needed = [max(len(word) for cell in column for word in ([*cell.split(), ""])) for column in columns]
    longest = [max(len(row[k]) for row in (grid.head, *grid.rows)) for k in range(len(grid.head))]
    rest = max(_CELL_LETTERS - sum(needed) - 3 * len(needed), 0)
    wanted = [more - least for more, least in zip(longest, needed, strict=True)]
    share = min(1.0, rest / max(sum(wanted), 1))
    return [least + int(share * more) + 3 for least, more in zip(needed, wanted, strict=True)]


def _placed(cells: Sequence[str], letters: Sequence[int]) -> Iterator[tuple[float, list[str]]]:
    """Each cell's place on the line and its lines."""
    begun = 0
    for cell, width in zip(cells, letters, strict=True):
        yield _LEFT + _WIDE * begun / _CELL_LETTERS, textwrap.wrap(typeset(cell), max(width - 2, 4)) or [""]
        begun += width
