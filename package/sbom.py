"""The bill of materials of a release (CycloneDX): what an installation without extras brings, from a fresh environment.

    python package/sbom.py CYCLONEDX_PY PYTHON_WITH_RAMSIGHT dist/ramsight.cdx.json

CYCLONEDX_PY is the program of the package `cyclonedx-bom`, which validates what it writes by the format's own schema.
Where it cannot be had no bill is written; that is said in one line.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
SPEC = "1.6"
_OF_PIP = ("pip", "setuptools", "wheel")  # of the environment, not of ramsight
_WAITS = 120  # s


def written(program: str, python: str | Path, target: Path) -> bool:
    """Write the bill of an environment; whether there is the program for it.

    Args:
        program: `cyclonedx-py`.
        python: of the environment, where ramsight is installed.
        target: the file.
    """
    command = [program, "environment", str(python), "--pyproject", str(ROOT / "pyproject.toml"), "--mc-type", "library",
               "--spec-version", SPEC, "--output-reproducible", "--output-file", "-"]  # fmt: skip
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=_WAITS)
    except OSError:
        return False
    if done.returncode:
        sys.exit(f"{' '.join(command)}\n{done.stderr}")
    (version,) = re.findall(r'__version__ = "(.+)"', (ROOT / "src" / "ramsight" / "_version.py").read_text())
    bill = of_ramsight(json.loads(done.stdout), version)
    if wrong := list(mistakes(bill)):
        sys.exit(f"{target.name}: {'; '.join(wrong)}")
    target.write_text(json.dumps(bill, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    return True


def of_ramsight(bill: dict[str, Any], version: str) -> dict[str, Any]:
    """The same bill of a version, without what the environment alone has."""
    root = {**bill["metadata"]["component"], "version": version, "purl": f"pkg:pypi/ramsight@{version}"}
    gone = {one["bom-ref"] for one in bill["components"] if one["name"] in _OF_PIP}
    kept = [one for one in bill["components"] if one["bom-ref"] not in gone]
    depends = [one for one in bill.get("dependencies", []) if one["ref"] not in gone]
    return {**bill, "metadata": {**bill["metadata"], "component": root}, "components": kept, "dependencies": depends}


def mistakes(bill: dict[str, Any]) -> Iterator[str]:
    """What a bill lacks of what its readers look for."""
    if (bill.get("bomFormat"), bill.get("specVersion")) != ("CycloneDX", SPEC):
        yield f"is no CycloneDX {SPEC}"
    root = bill.get("metadata", {}).get("component", {})
    if root.get("name") != "ramsight":
        yield "is not ramsight's"
    components = bill.get("components", [])
    if not components:
        yield "has no components"
    for one in (root, *components):
        lacks = [key for key in ("type", "name", "version", "purl", "bom-ref") if not one.get(key)]
        if lacks:
            yield f"{one.get('name')} has no {', '.join(lacks)}"
    known = {root.get("bom-ref"), *(one.get("bom-ref") for one in components)}
    for one in bill.get("dependencies", []):
        if strange := {one["ref"], *one.get("dependsOn", [])} - known:
            yield f"depends on what is not in it: {', '.join(sorted(map(str, strange)))}"
    depended = {one["ref"] for one in bill.get("dependencies", []) if one.get("dependsOn")}
    if root.get("bom-ref") not in depended:
        yield "says not what ramsight needs"


def main(program: str, python: str | Path, target: Path) -> None:
    """Write the bill, or say that there is none."""
    if not written(program, python, target):
        print("sbom: its program cannot be had here; no bill of materials was written")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], Path(sys.argv[3]))
