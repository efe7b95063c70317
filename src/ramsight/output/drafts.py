"""Names of drafts, from which a later run sees whose they are and removes those of runs that were killed."""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import shutil
import socket
from contextlib import suppress
from pathlib import Path

from ramsight.system import is_alive

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
