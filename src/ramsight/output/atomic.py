"""Results appear whole or not at all: written beside their place under another name, then moved into it."""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import shutil
import socket
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from ramsight.errors import OutputError, one_line
from ramsight.optional import check_extra
from ramsight.system import flush_file, is_alive


@contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """A temporary file in the same directory that takes the place of ``path`` once the block has ended well.

    Its name ends as that of ``path`` does, so that libraries choose the same format. If the block raises, the
    temporary file is removed and whatever stood at ``path`` stays as it was. What a run that was killed has left
    behind is removed by the next one with the same result.

    Args:
        path: where the result belongs.

    Yields:
        Path of the file to write.

    Raises:
        OutputError: there is no such directory, ``path`` is something other than a file, the file cannot be
            written, or the block wrote none.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     with atomic_path(Path(folder) / "answer.txt") as file:
        ...         _ = file.write_text("42")
        ...     [file.name for file in Path(folder).iterdir()]
        ['answer.txt']
    """
    shown = one_line(path)
    target = _target(path, shown)
    draft = draft_of(target)
    sweep(target)
    try:
        yield draft
        _settle(draft, target, shown)
    except OSError as error:
        if error.filename is not None and os.fsdecode(error.filename) != str(draft):
            raise
        raise OutputError(f"{shown}: cannot be written: {one_line(error.strerror or error)}") from error
    finally:
        with suppress(OSError):
            draft.unlink(missing_ok=True)


def write_text(text: str, path: str | Path) -> None:
    """Write a text as UTF-8, whole or not at all.

    Args:
        text: of the file.
        path: where it belongs.

    Raises:
        OutputError: as `atomic_path`.
    """
    with atomic_path(path) as draft:
        # Names of files may hold what is no text.
        draft.write_text(text, encoding="utf-8", errors="replace", newline="\n")


def check_target(path: Path | None, suffixes: Sequence[str]) -> None:
    """Reject a place that cannot be written, before long work rather than after it.

    Args:
        path: the file to be; `None` is always right.
        suffixes: the suffixes that are known for it.

    Raises:
        OutputError: the suffix is another one, or there is no such directory.
    """
    if path is not None:
        suffix_of(path, suffixes)
        _target(path, one_line(path))


FIGURE_FILES = (".png", ".svg", ".pdf")


def check_figure(path: Path | None) -> None:
    """Reject a figure that cannot be drawn or written, before long work rather than after it.

    Args:
        path: the file to be; `None` is always right.

    Raises:
        OutputError: the suffix is not one of `FIGURE_FILES`, or there is no such directory.
        MissingPackageError: what draws it is not installed.
    """
    check_target(path, FIGURE_FILES)
    if path is not None:
        check_extra("figures")


def suffix_of(path: str | Path, known: Sequence[str]) -> str:
    """Which of the known suffixes a path ends in.

    Raises:
        OutputError: none of them.
    """
    name = Path(path).name
    fitting = [suffix for suffix in known if name.endswith(suffix) and name != suffix]
    if not fitting:
        raise OutputError(f"{one_line(path)}: unknown suffix of a result (known: {', '.join(known)})")
    return fitting[-1]


def _target(path: str | Path, shown: str) -> Path:
    """Where the file really goes, links followed; refuses what could not be replaced."""
    try:
        target = Path(os.path.realpath(path))
        if target.is_dir():
            raise OutputError(f"{shown}: is a directory, not a file")
        if target.exists() and not target.is_file():
            raise OutputError(f"{shown}: is not a regular file")
        if not target.parent.is_dir():
            raise OutputError(f"{shown}: there is no directory {one_line(Path(path).parent)}")
    except (OSError, ValueError) as error:
        text = error.strerror if isinstance(error, OSError) else error
        raise OutputError(f"{shown}: cannot be written: {one_line(text)}") from error
    return target


def _settle(draft: Path, target: Path, shown: str) -> None:
    """Flush the draft to the disk and move it into its place."""
    if not draft.exists():
        raise OutputError(f"{shown}: nothing was written")
    flush_file(draft)
    os.replace(draft, target)
    flush_folder(target.parent)


def flush_folder(folder: Path) -> None:
    """Flush what a folder lists to the disk, where the file system can do that."""
    with suppress(OSError):
        opened = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(opened)
        finally:
            os.close(opened)


_NAME = re.compile(r"\.([0-9a-f]{4})-([0-9]+)-[0-9a-f]{8}-(.+)", re.DOTALL)


def draft_of(target: Path) -> Path:
    """A name beside a result for its draft: this machine, this process, something random, and the result's name."""
    return target.with_name(f".{_here()}-{os.getpid()}-{secrets.token_hex(4)}-{target.name}")


def sweep(target: Path) -> None:
    """Remove the drafts of a result whose processes are gone; those of other machines stay."""
    with suppress(OSError), os.scandir(target.parent) as entries:
        for entry in entries:
            match = _NAME.fullmatch(entry.name)
            if match is None or match[3] != target.name or match[1] != _here() or is_alive(int(match[2])):
                continue
            if entry.is_dir(follow_symlinks=False):
                shutil.rmtree(entry.path, ignore_errors=True)
            else:
                with suppress(OSError):
                    os.unlink(entry.path)


def _here() -> str:
    return hashlib.sha256(socket.gethostname().encode()).hexdigest()[:4]


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
