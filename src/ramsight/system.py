"""What an operating system does in its own way, one function each; what POSIX alone has is in `posix`."""

from __future__ import annotations

import os
import stat
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from ramsight import posix

_SYNCHRONIZE, _RUNS = 0x00100000, 0x102  # Windows: access right to wait for a process, and that it has not ended


class Lock(Protocol):
    """A file that this object has alone, until it releases it or the program ends."""

    def release(self) -> None:
        """Let others have it."""


def lock(path: Path) -> Lock:
    """Have a file alone; the system ends that when the program ends, however that happens.

    On POSIX the file itself is locked (`posix.Lock`). Windows keeps others from reading what is locked there, so it is
    a file beside it, ``boom.state.lock``.

    Raises:
        BlockingIOError: another program has it, or another object of this one.
        OSError: it cannot be locked.
    """
    return posix.Lock(path) if posix.IS_HERE else _lock_beside(path)


def _lock_beside(path: Path) -> Lock:
    from filelock import FileLock, Timeout

    path = Path(os.path.realpath(path))
    path.parent.stat()  # which `filelock` would make
    beside = FileLock(f"{path}.lock", timeout=0.0, thread_local=False)
    try:
        beside.acquire()
    except Timeout:
        raise BlockingIOError("") from None
    return beside


def folder_refusal(folder: Path) -> str:
    """Why others might write into a folder; empty if they cannot.

    Windows keeps the folder of a user's profile from other users, and with it all below. What access lists say of
    other folders is not looked at: they are refused.

    Raises:
        OSError: nobody can tell.
    """
    if posix.IS_HERE:
        return posix.refusal(folder)
    if stat.S_ISLNK(os.lstat(folder).st_mode):
        return "it is a link"
    profile = Path(os.path.realpath(Path.home()))
    below = Path(os.path.realpath(folder)).is_relative_to(profile)
    return "" if below else f"it is not below your own folder {profile}"


def is_ours(file: Path) -> bool:
    """Whether a file or folder is no link and belongs to us; on Windows its folder tells that (`folder_refusal`)."""
    try:
        status = os.lstat(file)
    except OSError:
        return False
    return not stat.S_ISLNK(status.st_mode) and (not posix.IS_HERE or status.st_uid == posix.user())


def user_name() -> str:
    """What tells users apart where their temporary files are; "" where each has a folder of its own."""
    return f"-{posix.user()}" if posix.IS_HERE else ""


def is_alive(process: int) -> bool:
    """Whether a process of this machine is there; nothing is sent to it.

    Example:
        >>> is_alive(os.getpid())
        True
    """
    return posix.is_alive(process) if posix.IS_HERE else _is_alive_on_windows(process, _kernel32())


def _kernel32() -> Any:
    import ctypes

    return getattr(ctypes, "WinDLL")("kernel32")  # noqa: B009 - not there for a type checker on Linux


def _is_alive_on_windows(process: int, kernel32: Any) -> bool:
    """`os.kill` with signal 0 would be a Ctrl-C there."""
    if not 0 < process < 1 << 32:
        return False
    handle = kernel32.OpenProcess(_SYNCHRONIZE, False, process)  # 32 significant bits, as of every handle
    if not handle:
        return bool(kernel32.GetLastError() == 5)  # access denied: it is another user's
    try:
        return bool(kernel32.WaitForSingleObject(handle, 0) == _RUNS)
    finally:
        kernel32.CloseHandle(handle)


def flush_file(path: Path) -> None:
    """Flush a file's content to the disk; Windows does that only for files that are open for writing.

    Raises:
        OSError: it cannot be opened or flushed.
    """
    with open(path, "r+b") as file:
        os.fsync(file.fileno())


def runtime_symbols() -> dict[str, int]:
    """Addresses of functions that machine code of LLVM calls by itself and cannot find, by name.

    Windows extends a stack page by page: a function with more than a page of variables calls ``__chkstk``.
    """
    return {"__chkstk": _address("ntdll", "__chkstk")} if sys.platform == "win32" else {}


def _address(library: str, name: str) -> int:
    import ctypes

    function = getattr(ctypes, "WinDLL")(library)[name]  # noqa: B009 - not there for a type checker on Linux
    return ctypes.cast(function, ctypes.c_void_p).value or 0


def processors() -> int:
    """How many processors this process may use; where the system does not tell, how many there are.

    Example:
        >>> processors() >= 1
        True
    """
    affinity: Callable[[int], set[int]] | None = getattr(os, "sched_getaffinity", None)  # Linux
    return len(affinity(0)) if affinity else os.cpu_count() or 1


_CLOCK: int | None = getattr(time, "CLOCK_BOOTTIME", getattr(time, "CLOCK_MONOTONIC", None))  # Linux, macOS


def forward() -> float:
    """A clock that only runs forward, and while the computer sleeps as well [s].

    On macOS `time.monotonic` stands still meanwhile. On Windows it goes in steps of 16 ms with Python 3.11 and 3.12.
    """
    return time.perf_counter() if _CLOCK is None else time.clock_gettime(_CLOCK)


def cache_home() -> Path:
    """Where this user's programs keep what they can make again, for this one."""
    from platformdirs import user_cache_dir

    return Path(user_cache_dir("ramsight", appauthor=False))


def config_home() -> Path:
    """Where this user's programs are configured, for this one."""
    from platformdirs import user_config_dir

    return Path(user_config_dir("ramsight", appauthor=False))
