"""What stands in CAN frames by a DBC file (or another that cantools reads: KCD, SYM, ARXML)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ramsight.errors import LogError
from ramsight.logs.can_field import Field, big_endian, little_endian
from ramsight.logs.lines import check_file, file_name, first_line
from ramsight.logs.source import needs

_LONGEST_FRAME = 512  # bits
_NULL = 0xFE  # J1939: address of a device that has none
_PDU2 = 0xF0  # J1939: from this format on the lower byte is part of the group's number, below it an address


def j1939_group(frame_id: int) -> int:
    """The bits of an extended identifier that name a J1939 parameter group: no priority, no source address.

    Example:
        >>> hex(j1939_group(0x18FE6817)), hex(j1939_group(0x0CEF2117))
        ('0xfe6800', '0xef0000')
    """
    wide = (frame_id >> 16) & 0xFF
    return frame_id & (0x03FFFF00 if wide >= _PDU2 else 0x03FF0000)


def destination_address(frame_id: int) -> int | None:
    """The J1939 address that an extended identifier's frame goes to; None where its group is for all.

    Example:
        >>> hex(destination_address(0x0CEF2117)), destination_address(0x18FE6817)
        ('0x21', None)
    """
    return None if (frame_id >> 16) & 0xFF >= _PDU2 else (frame_id >> 8) & 0xFF


def source_address(frame_id: int) -> int:
    """The J1939 address that an extended identifier's frame comes from.

    Example:
        >>> hex(source_address(0x18FE6817))
        '0x17'
    """
    return frame_id & 0xFF


def dbc_fields(path: Path, j1939: bool | None = None) -> tuple[dict[int, list[Field]], dict[int, list[Field]]]:
    """The fields of every message in a file.

    Args:
        j1939: whether messages with extended identifiers are J1939 groups, which come from any address; None goes by
            the file: by its attributes, or by the null address FEh in an identifier, from which no device sends.

    Returns:
        Fields by identifier, bit 31 set for an extended one; and those of J1939 messages by group.

    Raises:
        LogError: the file cannot be read, or cantools is not installed.
    """
    file = file_name(path)
    check_file(path)
    cantools = needs("cantools", "can", file)
    try:
        database = cantools.database.load_file(path, strict=False, encoding=_encoding(path))
        messages = database.messages
    except Exception as error:  # every format has parsers and errors of its own
        raise LogError(f"does not say what CAN frames mean: {first_line(error)}", file=file) from None
    exact: dict[int, list[Field]] = {}
    groups: dict[int, list[Field]] = {}
    whole = _is_j1939_file(database) if j1939 is None else j1939
    for message in messages:
        is_j1939 = message.is_extended_frame and (
            whole or (j1939 is None and (message.protocol == "j1939" or source_address(message.frame_id) == _NULL))
        )
        fields = _message_fields(message, is_j1939)
        if is_j1939:
            groups.setdefault(j1939_group(message.frame_id), []).extend(fields)
        else:
            exact.setdefault(message.frame_id | (message.is_extended_frame << 31), []).extend(fields)
    return exact, groups


def _encoding(path: Path) -> str | None:
    """UTF-8 where a file is that, else what tools on Windows write; None where the format states its own."""
    if path.suffix.lower() not in (".dbc", ".sym"):
        return None
    try:
        path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"


def _is_j1939_file(database: Any) -> bool:
    """Whether a DBC file says of itself, and not of each message, that it is of J1939."""
    specifics = getattr(database, "dbc", None)
    if specifics is None or "VFrameFormat" in specifics.attribute_definitions:
        return False
    protocol = specifics.attributes.get("ProtocolType")
    return protocol is not None and "j1939" in str(protocol.value).lower()


def _message_fields(message: Any, is_j1939: bool) -> list[Field]:
    signals = {signal.name: signal for signal in message.signals}
    done: dict[str, Field] = {}

    def field(signal: Any) -> Field:
        if signal.name not in done:
            selector = None
            selecting = signals.get(signal.multiplexer_signal) if signal.multiplexer_ids is not None else None
            if selecting is not None and _is_number(selecting):
                selector = (field(signals[signal.multiplexer_signal]), tuple(signal.multiplexer_ids))
            place = big_endian if signal.byte_order == "big_endian" else little_endian
            done[signal.name] = Field(
                f"{message.name}.{signal.name}",
                place(signal.start, signal.length),
                signal.is_signed,
                signal.conversion.is_float,
                float(signal.conversion.scale),
                float(signal.conversion.offset),
                signal.unit or "",
                selector,
                is_j1939,
            )
        return done[signal.name]

    return [field(signal) for signal in message.signals if _is_number(signal)]


def _is_number(signal: Any) -> bool:
    """Whether a signal is a number within a frame; others are texts, or slips."""
    if signal.conversion.is_float and signal.length not in (16, 32, 64):
        return False
    if not 1 <= signal.length <= 64 or signal.start < 0:
        return False
    first = signal.start // 8 * 8 + 7 - signal.start % 8 if signal.byte_order == "big_endian" else signal.start
    return bool(first + signal.length <= _LONGEST_FRAME)
