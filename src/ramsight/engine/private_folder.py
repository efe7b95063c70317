"""A folder that is ours alone: what lies in it may be run as code, because nobody else can have put it there."""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import tempfile
import warnings
from functools import cache
from pathlib import Path

from ramsight import system
from ramsight.errors import RamsightError
from ramsight.system import cache_home


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
    own = Path(tempfile.gettempdir()) / f"ramsight{system.user_name()}"
    if _make(own) and not refusal(own):
        return _closed(own)
    return _fresh(remedy)


def refusal(folder: Path) -> str:
    """Why others might write into a folder, or have it replaced; empty if nobody but an administrator can.

    Example:
        >>> refusal(Path(tempfile.gettempdir()) / "missing") != ""
        True
    """
    try:
        return system.folder_refusal(folder)
    except OSError as error:
        return error.strerror or str(error)


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


def cache_directory() -> Path:
    """Where compiled models are kept; the folder exists, and nobody else can write into it.

    `$RAMSIGHT_CACHE`, else `ramsight` where the system has the user's caches. Where that cannot be written, or others
    may write into it, another one that is ours alone (`engine.private_folder`).
    """
    named = os.environ.get("RAMSIGHT_CACHE")
    wanted = Path(named) if named else cache_home()
    return private_folder(wanted, "remove it, or set RAMSIGHT_CACHE to a folder of your own")


def content_hash(*parts: str) -> str:
    """A short hash of texts; the same texts always have the same one."""
    found = hashlib.sha256()
    for part in parts:
        found.update(f"{len(part)} {part}".encode())
    return found.hexdigest()[:24]


def write_whole(path: Path, content: bytes) -> None:
    """Write a file beside its place and move it there.

    Raises:
        OSError: it cannot be written.
    """
    descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=path.name)
    try:
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(content)
        os.replace(temporary, path)
    except OSError:
        Path(temporary).unlink(missing_ok=True)
        raise
