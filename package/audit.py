"""Known vulnerabilities of pinned packages: `make audit`.

    python package/audit.py PIP_AUDIT requirements/dev.txt ...

Without the database nothing is audited; that is said in one line, and is no failure.
"""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

_WAITS = 300  # s, for all packages of a file


def audited(program: str, pins: str) -> list[dict[str, Any]]:
    """What pip-audit says of the packages of a file; none if it has no database."""
    command = [program, "-r", pins, "--no-deps", "--disable-pip", "--format", "json", "--progress-spinner", "off"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=_WAITS)
        found = json.loads(done.stdout)["dependencies"]
    except (OSError, subprocess.TimeoutExpired, ValueError, KeyError):
        return []
    return [one for one in found if "vulns" in one]


def main(program: str, files: list[str]) -> int:
    """Print what is vulnerable; 1 if anything is."""
    found = [one for pins in files for one in audited(program, pins)]
    if not found:
        print("audit: the database of vulnerabilities cannot be had here; nothing was audited")
        return 0
    bad = [(one["name"], one["version"], vulnerability) for one in found for vulnerability in one["vulns"]]
    for name, version, vulnerability in bad:
        mended = ", ".join(vulnerability.get("fix_versions", [])) or "no version yet"
        print(f"audit: {name} {version}: {vulnerability['id']}, mended in {mended}")
    print(f"audit: {len(found)} packages, {len(bad)} known vulnerabilities")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
