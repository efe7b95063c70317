"""Where what is compiled or worked out once is kept, and what names it."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

from ramsight.engine.private_folder import private_folder
from ramsight.system import cache_home


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
