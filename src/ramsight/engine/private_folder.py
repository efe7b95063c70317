"""A folder that is ours alone: what lies in it may be run as code, because nobody else can have put it there."""

from __future__ import annotations

import atexit
import os
import shutil
import stat
import tempfile
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from ramsight.errors import RamsightError

_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


class FolderWarning(UserWarning):
    """A folder that is not used because others may write into it; the text states why and what to do."""


class FolderError(RamsightError):
    """There is no folder that is ours alone."""


def private_folder(wanted: Path, remedy: str) -> Path:
    """A folder that nobody else can write into; it exists.

    Args:
        wanted: which one it should be. Made, with what is missing above it, if it can be.
        remedy: what the user can do if it is rejected; ends the warning.

    Returns:
        That folder; if it cannot be written or others may write into it, one of the user's own among the temporary
        files, and if that is not ours alone either, a fresh one for this process.

    Raises:
        FolderError: not even that: the temporary files' folder is open to others and not sticky.
    """
    if _make(wanted):
        reason = refusal(wanted)
        if not reason:
            return _closed(wanted)
        _warn(f"{wanted}: not used, because {reason}; {remedy}")
    own = Path(tempfile.gettempdir()) / f"ramsight-{_user()}"
    if _make(own) and not refusal(own):
        return _closed(own)
    return _fresh(remedy)


def refusal(folder: Path) -> str:
    """Why others might write into a folder, or have it replaced; empty if nobody but root can.

    Example:
        >>> refusal(Path(tempfile.gettempdir())) != ""
        True
    """
    try:
        status = os.lstat(folder)
        if stat.S_ISLNK(status.st_mode):
            return "it is a link"
        if not stat.S_ISDIR(status.st_mode):
            return "it is no folder"
        if status.st_uid != _user():
            return f"it belongs to another user (uid {status.st_uid})"
        if status.st_mode & _OTHERS_WRITE:
            return f"others may write into it (mode {stat.S_IMODE(status.st_mode):04o})"
        return next((reason for above in _above(folder) if (reason := _refused_above(above))), "")
    except OSError as error:
        return error.strerror or str(error)


def is_ours(file: Path) -> bool:
    """Whether a file or folder is no link and belongs to us."""
    try:
        status = os.lstat(file)
    except OSError:
        return False
    return not stat.S_ISLNK(status.st_mode) and status.st_uid == _user()


def _refused_above(above: Path) -> str:
    """Why a folder above the one in question, or a link on the way to it, cannot be trusted."""
    status = os.lstat(above)
    if status.st_uid not in {0, _user(), os.lstat("/").st_uid}:
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
    if group != _user() or group != os.getgid():
        return False
    try:
        import grp
        import pwd

        return set(grp.getgrgid(group).gr_mem) <= {pwd.getpwuid(_user()).pw_name}
    except (ImportError, KeyError):
        return False


def _make(folder: Path) -> bool:
    """Make a folder, for us alone, and what is missing above it; whether it can be written."""
    try:
        for missing in reversed([folder, *folder.parents]):
            if not missing.exists() and not missing.is_symlink():
                missing.mkdir(mode=0o700, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)


def _closed(folder: Path) -> Path:
    """The folder, closed to the eyes of others as well."""
    if os.lstat(folder).st_mode & 0o077:
        os.chmod(folder, 0o700)
    return folder


@cache
def _fresh(remedy: str) -> Path:
    folder = Path(tempfile.mkdtemp(prefix="ramsight-"))
    reason = refusal(folder)
    if reason:
        folder.rmdir()
        raise FolderError(f"there is no folder for compiled models that is ours alone: {reason}; {remedy}")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


@cache
def _warn(text: str) -> None:
    warnings.warn(text, FolderWarning, stacklevel=4)


def _user() -> int:
    return os.getuid()
