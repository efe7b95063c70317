"""A file that one program at a time may have; the system ends the claim when the program ends, however that happens."""

from __future__ import annotations

import errno
import fcntl
import os
from contextlib import suppress
from pathlib import Path

from ramsight.errors import OutputError, one_line

_ATTEMPTS = 100  # to lock a file that others remove meanwhile
_LOCKS = Path("/proc/locks")


class HeldError(OutputError):
    """A file that another program has; the text names it."""


class Exclusive:
    """A lock on a file (flock); other names of the file, links among them, are the same lock.

    Args:
        path: the file; made by `take` if it is not there.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     one, other = Exclusive(Path(folder) / "boom.state"), Exclusive(Path(folder) / "boom.state")
        ...     one.take()
        ...     try:
        ...         other.take()
        ...     except HeldError:
        ...         print("held")
        ...     one.release()
        held
    """

    def __init__(self, path: str | Path) -> None:
        self._file, self._made = -1, False
        self.path = Path(path)

    @property
    def is_held(self) -> bool:
        """Whether this object has the file."""
        return self._file >= 0

    def take(self) -> None:
        """Have the file from now on; one that is held already stays so.

        Raises:
            HeldError: another program has it, or another object of this one.
            OutputError: it cannot be opened, made or locked.
        """
        try:
            for _ in range(_ATTEMPTS):
                if self.is_held:
                    return
                self._try()
        except OSError as error:
            raise OutputError(f"{one_line(self.path)}: cannot be locked: {error.strerror or error}") from error
        raise OutputError(f"{one_line(self.path)}: cannot be locked: it is removed again and again")

    def release(self) -> None:
        """Let others have it. A file that was made by `take` and got no content is removed."""
        if not self.is_held:
            return
        with suppress(OSError):
            if self._made and os.fstat(self._file).st_size == 0 and self._is_there():
                self.path.unlink()
        os.close(self._file)
        self._file = -1

    def __del__(self) -> None:
        self.release()

    def _try(self) -> None:
        """Lock the file that is there now; not held afterwards if it was removed meanwhile."""
        self._file, self._made = _opened(self.path)
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = _holder(os.fstat(self._file))
            self._let_go()
            raise HeldError(
                f"{one_line(self.path)}: another program{holder} has it; end that, or give another file"
            ) from None
        except OSError:
            self._let_go()
            raise
        if not self._is_there():
            self._let_go()

    def _let_go(self) -> None:
        os.close(self._file)
        self._file = -1

    def _is_there(self) -> bool:
        """Whether the path still leads to the file that was opened."""
        try:
            return os.path.samestat(os.fstat(self._file), self.path.stat())
        except FileNotFoundError:
            return False


def _opened(path: Path) -> tuple[int, bool]:
    """The file, and whether it was made."""
    try:
        return os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o644), True
    except FileExistsError:
        pass
    try:
        return os.open(path, os.O_RDWR | os.O_CREAT, 0o644), False
    except OSError as error:
        if error.errno not in (errno.EACCES, errno.EPERM, errno.EROFS):
            raise
        return os.open(path, os.O_RDONLY), False  # a file that cannot be written can be locked


def _holder(file: os.stat_result) -> str:
    """The process that has a file, in words; nothing where the system does not tell."""
    place = f"{os.major(file.st_dev):02x}:{os.minor(file.st_dev):02x}:{file.st_ino}"
    with suppress(OSError):
        for line in _LOCKS.read_text(encoding="ascii").splitlines():
            words = line.split()
            if "FLOCK" in words and place in words and words[4].isdecimal() and int(words[4]) > 0:
                return f" (process {words[4]})"
    return ""
