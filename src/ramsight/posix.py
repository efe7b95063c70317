"""What POSIX alone has: owners of files, locks on files, signals to processes. Windows has none of it (`system`)."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

try:
    import fcntl
    import grp
    import pwd

    IS_HERE = True
except ImportError:
    IS_HERE = False

_ATTEMPTS = 100  # to lock a file that others remove meanwhile
_LOCKS = Path("/proc/locks")  # Linux
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


def user() -> int:
    """Number of the user that this process runs as."""
    return os.getuid()


def refusal(folder: Path) -> str:
    """Why others might write into a folder, or have it replaced; empty if nobody but root can.

    Raises:
        OSError: nobody can tell.
    """
    status = os.lstat(folder)
    if stat.S_ISLNK(status.st_mode):
        return "it is a link"
    if not stat.S_ISDIR(status.st_mode):
        return "it is no folder"
    if status.st_uid != user():
        return f"it belongs to another user (uid {status.st_uid})"
    if status.st_mode & _OTHERS_WRITE:
        return f"others may write into it (mode {stat.S_IMODE(status.st_mode):04o})"
    return next((reason for above in _above(folder) if (reason := _refused_above(above))), "")


def _refused_above(above: Path) -> str:
    """Why a folder above the one in question, or a link on the way to it, cannot be trusted."""
    status = os.lstat(above)
    if status.st_uid not in {0, user(), os.lstat("/").st_uid}:
        return f"{above} belongs to another user (uid {status.st_uid})"
    mode = status.st_mode
    if stat.S_ISLNK(mode) or mode & stat.S_ISVTX or not mode & _OTHERS_WRITE:
        return ""
    if not mode & stat.S_IWOTH and _is_private_group(status.st_gid):
        return ""
    return f"others may write into {above} (mode {stat.S_IMODE(mode):04o}), which is not sticky"


def _above(folder: Path) -> Iterator[Path]:
    """All folders above one, as its path names them and as links lead to them."""
    yield from Path(os.path.abspath(folder)).parents
    yield from Path(os.path.realpath(folder)).parents


def _is_private_group(group: int) -> bool:
    """Whether a group is the one that many systems give to each user alone."""
    if group != user() or group != os.getgid():
        return False
    try:
        return set(grp.getgrgid(group).gr_mem) <= {pwd.getpwuid(user()).pw_name}
    except KeyError:
        return False


def is_alive(process: int) -> bool:
    """Whether a process of this machine is there."""
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:
        return True
    return True


class Lock:
    """A file, open and locked (flock); other names of the file, links among them, are the same lock.

    Raises:
        BlockingIOError: another program has it, or another object of this one; the text names the process, if known.
        OSError: it cannot be opened, made or locked.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        for _ in range(_ATTEMPTS):
            self._file, self._made = _opened(path)
            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if self._is_there():  # not removed meanwhile
                    return
            except BlockingIOError:
                holder = _holder(os.fstat(self._file))
                os.close(self._file)
                raise BlockingIOError(holder) from None
            except OSError:
                os.close(self._file)
                raise
            os.close(self._file)
        raise OSError("it is removed again and again")

    def release(self) -> None:
        """Let others have it. A file that was made here and got no content is removed."""
        with suppress(OSError):
            if self._made and os.fstat(self._file).st_size == 0 and self._is_there():
                self._path.unlink()
        os.close(self._file)

    def _is_there(self) -> bool:
        """Whether the path still leads to the file that was opened."""
        try:
            return os.path.samestat(os.fstat(self._file), self._path.stat())
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
