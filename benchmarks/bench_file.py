"""What benchmarks have measured, in one file: each keeps what the others have said."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


def keep(found: dict[str, Any], path: Path) -> None:
    """Put results into a file, beside those that are there under other names."""
    kept = json.loads(path.read_text()) if path.exists() else {}
    path.write_text(json.dumps(kept | found, indent=1) + "\n")


def rounded(found: Any) -> Any:
    """Results with four digits, however deep they are."""
    return json.loads(json.dumps(found), parse_float=lambda text: float(f"{float(text):.4g}"))
