"""What stands in CAN frames by a DBC file (or another that cantools reads: KCD, SYM, ARXML)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ramsight.errors import LogError
from ramsight.logs.can_field import Field, big_endian, little_endian
from ramsight.logs.lines import check_file, file_name, first_line
from ramsight.logs.source import needs

_LONGEST_FRAME = 512  # bits
_PDU2 = 0xF0  # J1939: from this format on the lower byte is part of the group's number, below it an address


def j1939_group(frame_id: int) -> int:
    """The bits of an extended identifier that name a J1939 parameter group: no priority, no source address.

    Example:
        >>> hex(j1939_group(0x18FE6817)), hex(j1939_group(0x0CEF2117))
        ('0xfe6800', '0xef0000')
    """
    wide = (frame_id >> 16) & 0xFF
    return frame_id & (0x03FFFF00 if wide >= _PDU2 else 0x03FF0000)


def dbc_fields(path: Path) -> tuple[dict[int, list[Field]], dict[int, list[Field]]]:
    """The fields of every message in a file.

    Args:
        path: the file.

    Returns:
        Fields by identifier, bit 31 set for an extended one; and those of J1939 messages by group.

    Raises:
        LogError: the file cannot be read, or cantools is not installed.
    """
    file = file_name(path)
    check_file(path)
    cantools = needs("cantools", "can", file)
    try:
        database = cantools.database.load_file(path, strict=False)
        messages = database.messages
    except Exception as error:  # every format has parsers and errors of its own
        raise LogError(f"does not say what CAN frames mean: {first_line(error)}", file=file) from None
    exact: dict[int, list[Field]] = {}
    groups: dict[int, list[Field]] = {}
    for message in messages:
        is_j1939 = message.protocol == "j1939"
        fields = _message_fields(message, is_j1939)
        if is_j1939:
            groups.setdefault(j1939_group(message.frame_id), []).extend(fields)
        else:
            exact.setdefault(message.frame_id | (message.is_extended_frame << 31), []).extend(fields)
    return exact, groups


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
