"""The parameters that 1010h stores: a small file with a format version and a checksum, replaced whole or not at all."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

from ramsight.deploy.encoder.objects import STORED, code
from ramsight.output.atomic import write_text

FORMAT = 1
SUFFIX = ".parameters"
_KEYS = {code(*key): key for key in STORED}

Values = dict[tuple[int, int], int]


class ParameterFile:
    """Keeps values of the object dictionary.

    Args:
        path: the file; made by the first `save`.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     kept = ParameterFile(Path(folder) / "boom.parameters")
        ...     kept.save({(0x1017, 0): 500})
        ...     kept.load()
        {(4119, 0): 500}
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)

    def save(self, values: Mapping[tuple[int, int], int]) -> None:
        """Replace the file; on return it is on the disk.

        Raises:
            OutputError: it cannot be written.
        """
        named = {code(*key): value for key, value in sorted(values.items())}
        content = {"format": FORMAT, "checksum": _checksum(named), "parameters": named}
        write_text(json.dumps(content, indent=1) + "\n", self.path)

    def load(self) -> Values | None:
        """What is stored: nothing if there is no file, None if there is one that cannot be trusted."""
        try:
            content = json.loads(self.path.read_text(encoding="utf-8"))
            named = content["parameters"]
            if content["format"] != FORMAT or content["checksum"] != _checksum(named):
                return None
            return {_KEYS[name]: int(value) for name, value in named.items()}
        except FileNotFoundError:
            return {}
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            return None


def _checksum(named: Mapping[str, int]) -> str:
    return hashlib.sha256(json.dumps(named, sort_keys=True).encode()).hexdigest()
