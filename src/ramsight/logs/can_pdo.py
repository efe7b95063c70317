"""What stands in CANopen process data: objects of CiA 402 and of some drives, and others by their type."""

from __future__ import annotations

import re

from ramsight.errors import DescriptionError
from ramsight.logs.can_field import Field, little_endian
from ramsight.logs.mapped import ChannelMap

_BITS = {
    "BOOLEAN": 1, "INT8": 8, "INT16": 16, "INT24": 24, "INT32": 32, "INT64": 64,
    "UINT8": 8, "UINT16": 16, "UINT24": 24, "UINT32": 32, "UINT64": 64, "REAL32": 32, "REAL64": 64,
}  # fmt: skip
_OBJECT = re.compile(r"(?:0x)?([0-9A-Fa-f]{4})h?(?:\s*[:.]\s*(?:0x)?([0-9A-Fa-f]{1,2})h?)?(?:\s+([A-Za-z]+[0-9]*))?")

_KNOWN = {
    (0x6040, 0): ("UINT16", "", 1.0),  # controlword
    (0x6041, 0): ("UINT16", "", 1.0),  # statusword
    (0x6060, 0): ("INT8", "", 1.0),  # modes of operation
    (0x6061, 0): ("INT8", "", 1.0),  # modes of operation display
    (0x6064, 0): ("INT32", "", 1.0),  # position actual value, of the motor
    (0x606B, 0): ("INT32", "rpm", 1.0),  # velocity demand value
    (0x606C, 0): ("INT32", "rpm", 1.0),  # velocity actual value, in user units: rpm unless the map states otherwise
    (0x6071, 0): ("INT16", "permille", 1.0),  # target torque
    (0x6074, 0): ("INT16", "permille", 1.0),  # torque demand
    (0x6076, 0): ("UINT32", "N m", 1e-3),  # motor rated torque, in mN m
    (0x6077, 0): ("INT16", "permille", 1.0),  # torque actual value
    (0x6078, 0): ("INT16", "permille", 1.0),  # current actual value
    (0x6079, 0): ("UINT32", "V", 1e-3),  # DC link circuit voltage
    (0x607A, 0): ("INT32", "", 1.0),  # target position
    (0x60FF, 0): ("INT32", "rpm", 1.0),  # target velocity
    (0x6004, 0): ("UINT32", "", 1.0),  # CiA 406: position value of an encoder, in its steps
    (0x4602, 0x0C): ("INT16", "N m", 1.0 / 16.0),  # Sevcon: actual torque
    (0x0001, 0): ("BOOLEAN", "", 1.0), (0x0002, 0): ("INT8", "", 1.0), (0x0003, 0): ("INT16", "", 1.0),
    (0x0004, 0): ("INT32", "", 1.0), (0x0005, 0): ("UINT8", "", 1.0), (0x0006, 0): ("UINT16", "", 1.0),
    (0x0007, 0): ("UINT32", "", 1.0),  # dummy entries that fill a PDO
}  # fmt: skip
"""Type, unit and scale by index and subindex (CiA 402, CiA 301, Sevcon Gen4)."""

DUMMIES = range(0x0001, 0x0008)


def object_name(index: int, subindex: int) -> str:
    """How channels call an object.

    Example:
        >>> object_name(0x6077, 0), object_name(0x4602, 12)
        ('6077h', '4602h:0Ch')
    """
    return f"{index:04X}h" + (f":{subindex:02X}h" if subindex else "")


def pdo_fields(file_map: ChannelMap) -> dict[int, list[Field]]:
    """The fields of every PDO in a map, by COB-ID.

    An object that several PDOs hold is called ``0x181.606Ch`` and so on.

    Raises:
        DescriptionError: an object is not known and has no type, or the objects do not fit into a frame.
    """
    fields: dict[int, list[Field]] = {}
    for number, pdo in enumerate(file_map.pdos):
        key, start = f"can.pdo[{number}].objects", 0
        listed = fields.setdefault(pdo.cob_id, [])
        for text in pdo.objects:
            index, subindex, kind, unit, scale = _read_object(text, file_map.file, key)
            bits = little_endian(start, _BITS[kind])
            start += _BITS[kind]
            if index not in DUMMIES:
                name = object_name(index, subindex)
                signed, floating = kind.startswith("INT"), kind.startswith("REAL")
                listed.append(Field(name, bits, signed, floating, scale, 0.0, unit))
        if start > 64:
            raise DescriptionError(
                "do not fit into a frame", file=file_map.file, key=key, value=f"{start} bits", allowed="64 bits"
            )
    return fields


def _read_object(text: str, file: str | None, key: str) -> tuple[int, int, str, str, float]:
    match = _OBJECT.fullmatch(text.strip())
    if match is None:
        raise DescriptionError(
            "is no object", file=file, key=key, value=text, allowed="606Ch, 4602h:0Ch, 2010h:01 INT16"
        )
    index, subindex = int(match[1], 16), int(match[2] or "0", 16)
    kind, unit, scale = _KNOWN.get((index, subindex), ("", "", 1.0))
    if match[3]:
        kind = match[3].upper().replace("UNSIGNED", "UINT").replace("INTEGER", "INT")
    if kind not in _BITS:
        what = "is of no known type" if kind else "is not known here: its type has to be said"
        allowed = f"{object_name(index, subindex)} followed by {', '.join(_BITS)}"
        raise DescriptionError(what, file=file, key=key, value=text, allowed=allowed)
    return index, subindex, kind, unit, scale
