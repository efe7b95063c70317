"""Whether the site is that of the project's files as they are: `make docs` builds nothing where nothing has changed.

    python docs/built.py build/site           exit code 0 if it is, 1 if it has to be built
    python docs/built.py build/site --done    says that it was built of the files as they are

The key is the content of every file that git knows or would take, so that no page, example or plot can be older than
what it is made of. Outside of git the site is always built.
"""

import hashlib
import subprocess
import sys
from pathlib import Path

STAMP = ".built"


def content(root: Path) -> str:
    """The hash of a project's files and of the interpreter; empty outside of git."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=root, capture_output=True, check=False)
    if listed.returncode:
        return ""
    found = hashlib.sha256(sys.version.encode())
    for name in sorted(set(listed.stdout.decode().split("\0")) - {""}):
        file = root / name
        inside = file.read_bytes() if file.is_file() else b"none"
        found.update(f"{name} {len(inside)} ".encode() + inside)
    return found.hexdigest()


def main(site: Path, *, done: bool) -> int:
    """The exit code."""
    now, stamp = content(Path.cwd()), site / STAMP
    if done:
        stamp.write_text(now, encoding="utf-8")
        return 0
    return int(not (now and stamp.is_file() and stamp.read_text(encoding="utf-8") == now))


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), done="--done" in sys.argv[2:]))
