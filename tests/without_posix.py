"""A process that has nothing of POSIX, as far as ramsight can see: run as `python -c` code before anything else.

Modules and functions that Windows lacks are hidden from ramsight and filelock (the standard library of Linux needs
them). Calls that do something else there fail: a signal 0 that is sent to see whether a process is there, a flush of
a file that is open for reading, a folder that is opened, a wait for a pipe.
"""

import builtins
import ctypes
import fcntl
import multiprocessing
import os
import select
import subprocess
import sys
import time
from contextlib import suppress

import platformdirs  # noqa: F401 - which on Linux asks at once who the user is

HIDDEN = {"fcntl", "pwd", "grp", "resource", "termios", "syslog"}
LACKS = (
    "getuid", "geteuid", "getgid", "getegid", "fork", "sched_getaffinity", "major", "minor", "O_NOFOLLOW",
    "O_DIRECTORY", "chown", "mkfifo", "statvfs",
)  # fmt: skip
_import, _fsync, _open, _kill = builtins.__import__, os.fsync, os.open, os.kill


def importing(name, globals=None, locals=None, fromlist=(), level=0):
    asking = str((globals or {}).get("__name__", ""))
    if name in HIDDEN and asking.partition(".")[0] in ("ramsight", "filelock"):
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)
    return _import(name, globals, locals, fromlist, level)


def fsync(file):
    if fcntl.fcntl(file, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY:
        raise OSError(9, "Bad file descriptor")
    _fsync(file)


def opening(path, *rest, **more):
    if isinstance(path, (str, os.PathLike)) and os.path.isdir(path):
        raise PermissionError(13, "Permission denied", os.fspath(path))
    return _open(path, *rest, **more)


def kill(process, signal):
    if signal == 0 and sys._getframe(1).f_globals["__name__"].startswith("ramsight"):
        raise AssertionError("a Ctrl-C to every process of the console")
    _kill(process, signal)


def no_pipes(*lists):
    raise OSError(10038, "an operation was attempted on something that is not a socket")


def context(method=None, _get=multiprocessing.get_context):
    if method not in (None, "spawn"):
        raise ValueError(f"cannot find context for {method!r}")
    return _get("spawn")


class Kernel32:
    """Windows' calls about processes, answered from Linux' table of them."""

    def __init__(self, name):
        self.open = set()

    def OpenProcess(self, access, inherit, process):  # noqa: N802
        self.open.add(process)
        return process if os.path.isdir(f"/proc/{process}") else 0

    def WaitForSingleObject(self, handle, milliseconds):  # noqa: N802
        return 0x102

    def CloseHandle(self, handle):  # noqa: N802
        return self.open.remove(handle)

    def GetLastError(self):  # noqa: N802
        return 87


def hide():
    """Take all of that away."""
    builtins.__import__ = importing
    for name in LACKS:
        with suppress(AttributeError):
            delattr(os, name)
    for name in [name for name in vars(time) if name.startswith("CLOCK_")]:
        delattr(time, name)
    del time.clock_gettime
    os.fsync, os.open, os.kill, select.select = fsync, opening, kill, no_pipes
    multiprocessing.get_context = context
    ctypes.WinDLL = Kernel32


def run(code, home, **environment):
    """Run code in such a process, whose user's folder is `home`; what it prints."""
    root = os.path.dirname(os.path.dirname(__file__))
    start = f"import sys; sys.path[:0] = [{root!r}]\nfrom tests.without_posix import hide\nhide()\n"
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", start + code],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
        cwd=home,
        env=os.environ | {"HOME": str(home), "PYTHONUTF8": "0"} | environment,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()
