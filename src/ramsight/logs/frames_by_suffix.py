"""Which kind of log of CAN frames a file is, by its suffix."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from ramsight.errors import LogError
from ramsight.logs.frames import Frame
from ramsight.logs.lines import Advance, file_name


def open_frames(path: str | Path, advance: Advance | None = None) -> Iterator[Frame]:
    """The frames of a log, in order, by the file's suffix: BLF, ASC, candump or MDF.

    A file that breaks off is read as far as it goes, with a warning.

    Args:
        path: the file.
        advance: is passed how much of the file has been read.

    Raises:
        LogError: the file cannot be read, is damaged, or holds no frames; with the place.
    """
    frames = _reader(path)(path, advance)
    first = next(frames, None)
    if first is None:
        raise LogError("holds no CAN frames", file=file_name(path))
    yield first
    yield from frames


def _reader(path: str | Path) -> Callable[[str | Path, Advance | None], Iterator[Frame]]:
    name = Path(path).name.lower()
    if name.endswith(".blf"):
        from ramsight.logs.frames_blf import blf_frames

        return blf_frames
    if name.endswith((".mf4", ".mdf")):
        from ramsight.logs.frames_mdf import mdf_frames

        return mdf_frames
    from ramsight.logs.frames_text import asc_frames, candump_frames

    return asc_frames if name.removesuffix(".gz").endswith(".asc") else candump_frames
