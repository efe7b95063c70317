"""A file that one program at a time may have; the system ends the claim when the program ends, however that happens."""

from __future__ import annotations

from pathlib import Path

from ramsight import system
from ramsight.errors import OutputError, one_line


class HeldError(OutputError):
    """A file that another program has; the text names it."""


class Exclusive:
    """A lock on a file; other names of the file, links among them, are the same lock (hard links not on Windows).

    Args:
        path: the file; on POSIX made by `take` if it is not there.

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
        self._lock: system.Lock | None = None
        self.path = Path(path)

    @property
    def is_held(self) -> bool:
        """Whether this object has the file."""
        return self._lock is not None

    def take(self) -> None:
        """Have the file from now on; one that is held already stays so.

        Raises:
            HeldError: another program has it, or another object of this one.
            OutputError: it cannot be opened, made or locked.
        """
        if self.is_held:
            return
        try:
            self._lock = system.lock(self.path)
        except BlockingIOError as holder:
            raise HeldError(
                f"{one_line(self.path)}: another program{holder} has it; end that, or give another file"
            ) from None
        except OSError as error:
            raise OutputError(f"{one_line(self.path)}: cannot be locked: {error.strerror or error}") from error

    def release(self) -> None:
        """Let others have it. A file that was made by `take` and got no content is removed."""
        if self._lock is not None:
            self._lock.release()
            self._lock = None

    def __del__(self) -> None:
        self.release()
