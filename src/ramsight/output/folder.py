"""Folders of results that appear whole, or take the place of an earlier one's files with the last of them last."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ramsight.errors import OutputError, one_line
from ramsight.output.atomic import draft_of, sweep


def check_folder(out: Path) -> None:
    """Reject a place where no folder can be written, before the work rather than after it.

    Args:
        out: the folder to be.

    Raises:
        OutputError: it is a file, or there is no directory to make it in.
    """
    shown = one_line(out)
    if out.exists() and not out.is_dir():
        raise OutputError(f"{shown}: is a file, not a directory")
    if not out.exists() and not out.absolute().parent.is_dir():
        raise OutputError(f"{shown}: there is no directory {one_line(out.parent)}")
    if not os.access(out if out.exists() else out.absolute().parent, os.W_OK):
        raise OutputError(f"{shown}: cannot be written: no permission")


@contextmanager
def whole_folder(out: Path, last: str) -> Iterator[Path]:
    """A folder beside ``out`` whose files take their places in it once the block has ended well.

    A new folder appears whole; in one that exists the files are replaced one by one, and other files stay.

    Args:
        out: where the results belong.
        last: name of the file that is moved last: where it is, the folder is whole.

    Yields:
        Path of the folder to write into; whatever the block makes, `last` among it.

    Raises:
        OutputError: `check_folder` refuses the place, or it cannot be written.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as place:
        ...     with whole_folder(Path(place) / "report", last="done.txt") as draft:
        ...         _ = (draft / "done.txt").write_text("42")
        ...     [file.name for file in (Path(place) / "report").iterdir()]
        ['done.txt']
    """
    check_folder(out)
    try:
        target = out.absolute()
        sweep(target)
        draft = draft_of(target)
        draft.mkdir(mode=0o700)
    except OSError as error:
        raise OutputError(f"{one_line(out)}: cannot be written: {one_line(error.strerror or error)}") from error
    try:
        yield draft
        draft.chmod(0o755)
        if not out.exists():
            draft.rename(out)
            return
        (out / last).unlink(missing_ok=True)
        names = [file.relative_to(draft) for file in draft.rglob("*") if file.is_file()]
        for name in sorted(names, key=lambda name: name == Path(last)):
            (out / name).parent.mkdir(exist_ok=True, parents=True)
            os.replace(draft / name, out / name)
    except OSError as error:
        raise OutputError(f"{one_line(out)}: cannot be written: {one_line(error.strerror or error)}") from error
    finally:
        shutil.rmtree(draft, ignore_errors=True)
