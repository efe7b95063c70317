"""What a chunk of an MCAP file holds, unpacked: as much as it says, and never more than is allowed."""

from __future__ import annotations

import importlib
from typing import Any


def unpacked_chunk(data: bytes, compression: str, says: int, most: int) -> bytes:
    """The bytes of a chunk.

    Args:
        data: as they stand in the file.
        compression: ``zstd``, ``lz4`` or "" for none.
        says: how many it holds, by its head.
        most: how many may be.

    Raises:
        ValueError: it holds more or fewer, or is packed in another way; the libraries' own errors for what is damaged.

    Example:
        >>> unpacked_chunk(b"abc", "", 3, 10)
        b'abc'
    """
    if says > most:
        raise ValueError(f"a chunk of {says} bytes (allowed: up to {most})")
    if compression == "zstd":
        zstandard: Any = importlib.import_module("zstandard")
        with zstandard.ZstdDecompressor().stream_reader(data) as stream:
            found: bytes = stream.read(says + 1)
    elif compression == "lz4":
        found = importlib.import_module("lz4.frame").LZ4FrameDecompressor().decompress(data, max_length=says + 1)
    elif not compression:
        found = data
    else:
        raise ValueError(f"a chunk is packed as {compression[:20]!r} (known: zstd, lz4)")
    if len(found) != says:
        raise ValueError(f"a chunk holds other than the {says} bytes that its head says")
    return found
