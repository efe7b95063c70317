"""What stands in messages of MCAP files, as numbers by their names: JSON, CDR (ROS 2), protobuf; by mcap's decoders."""

from __future__ import annotations

import importlib
import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

Content = dict[str, Any]
Decoder = Callable[[bytes], Content]

_FACTORIES = {"cdr": "mcap_ros2.decoder", "protobuf": "mcap_protobuf.decoder"}
_ANY_NAME = "any_msgs/msg/Any"  # of a message, as ROS 2 spells them
_DEEPEST = 8  # messages in messages
MOST_LISTED = 64
"""Numbers of a list that are channels; longer ones are a scan or a picture."""
DAMAGED = (ValueError, RecursionError)
"""What a decoder raises of a message that is damaged."""


class Contents:
    """Decoders of messages, made once for each schema."""

    def __init__(self) -> None:
        self._made: dict[tuple[str, int], Decoder | None] = {}

    def decoder(self, encoding: str, schema: Any) -> Decoder | None:
        """What reads messages of an encoding; None where nothing that is installed does.

        Args:
            schema: the record of their schema, None without one.
        """
        if encoding == "json":
            return _from_json
        key = (encoding, -1 if schema is None else schema.id)
        if key not in self._made:
            self._made[key] = _made(encoding, schema)
        return self._made[key]


def _made(encoding: str, schema: Any) -> Decoder | None:
    if encoding not in _FACTORIES:
        return None
    read = _reader(encoding, schema)
    if read is None and encoding == "cdr" and schema is not None:
        read = _reader(encoding, replace(schema, name=_ANY_NAME))  # recorders of their own name schemas as they like
    if read is None:
        return None

    def decode(data: bytes) -> Content:
        try:
            return _object(read(data), 0)
        except Exception as error:  # decoders have errors of their own
            raise ValueError(str(error)) from None

    return decode


def _reader(encoding: str, schema: Any) -> Callable[[bytes], Any] | None:
    """The decoder of mcap for a schema; None without one."""
    try:
        made: Callable[[bytes], Any] | None
        made = importlib.import_module(_FACTORIES[encoding]).DecoderFactory().decoder_for(encoding, schema)
    except Exception:  # it is not installed, or has errors of its own for schemas that it does not know
        return None
    return made


def _from_json(data: bytes) -> Content:
    content = json.loads(data)
    return content if isinstance(content, dict) else {}


def _object(message: Any, deep: int) -> Content:
    """The numbers of a message, the messages in it as objects, and lists of numbers; text is left out."""
    if deep >= _DEEPEST:
        return {}
    found: Content = {}
    for name in _fields(message):
        value = getattr(message, name)
        if isinstance(value, (bool, int, float)):
            found[name] = value
        elif _fields(value):
            found[name] = _object(value, deep + 1)
        elif not isinstance(value, (str, bytes, Mapping)) and hasattr(value, "__len__") and len(value) <= MOST_LISTED:
            found[name] = [float(one) if isinstance(one, (bool, int, float)) else None for one in value]
    return found


def _fields(message: Any) -> tuple[str, ...]:
    """The names of a message's fields, none of what is no message."""
    descriptor = getattr(message, "DESCRIPTOR", None)
    if descriptor is not None and hasattr(descriptor, "fields"):
        return tuple(one.name for one in descriptor.fields)
    if isinstance(message, (str, bytes, list, tuple, Mapping)) or message is None:
        return ()
    names = getattr(message, "__slots__", None) or getattr(message, "__dict__", {})
    return tuple(str(name) for name in names if not str(name).startswith("_"))


def unpacked_chunk(data: bytes, compression: str, says: int, most: int) -> bytes:
    """The bytes of a chunk.

    Args:
        compression: ``zstd``, ``lz4`` or "" for none.

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
