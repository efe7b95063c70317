"""The EDS file, written from the declared objects; the node's own dictionary is read from the same text."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

from ramsight.deploy.encoder.objects import BITS, OBJECTS, PRODUCT, REVISION, TYPES, Entry, Object

if TYPE_CHECKING:
    from canopen import ObjectDictionary

NAME = "ramsight-encoder.eds"
_KINDS = {"VAR": 7, "ARRAY": 8, "RECORD": 9}
_MANDATORY = (0x1000, 0x1001, 0x1018)
_RATES = (10, 20, 50, 125, 250, 500, 800, 1000)


def eds_text() -> str:
    """The EDS file's text (CiA 306).

    Example:
        >>> "[6004]" in eds_text()
        True
    """
    optional = [one for one in OBJECTS if one.index not in _MANDATORY and not 0x2000 <= one.index < 0x6000]
    ours = [one for one in OBJECTS if 0x2000 <= one.index < 0x6000]
    parts = [
        _section("FileInfo", {
            "FileName": NAME, "FileVersion": 1, "FileRevision": 0, "EDSVersion": "4.0",
            "Description": "virtual position sensor as a linear encoder, CiA 406", "CreatedBy": "ramsight",
            "CreationTime": "12:00AM", "CreationDate": "01-01-2026",
            "ModificationTime": "12:00AM", "ModificationDate": "01-01-2026", "ModifiedBy": "ramsight",
        }),
        _section("DeviceInfo", {
            "VendorName": "ramsight", "VendorNumber": 0, "ProductName": "ramsight encoder",
            "ProductNumber": f"0x{PRODUCT:08X}", "RevisionNumber": f"0x{REVISION:08X}", "OrderCode": "encoder",
            **{f"BaudRate_{rate}": 1 for rate in _RATES},
            "SimpleBootUpMaster": 0, "SimpleBootUpSlave": 1, "Granularity": 8, "DynamicChannelsSupported": 0,
            "CompactPDO": 0, "GroupMessaging": 0, "NrOfRXPDO": 0, "NrOfTXPDO": 2, "LSS_Supported": 0,
        }),
        _section("DummyUsage", {f"Dummy{k:04d}": 0 for k in range(1, 8)}),
        _section("Comments", {"Lines": 0}),
        _listed("MandatoryObjects", [one for one in OBJECTS if one.index in _MANDATORY]),
        _listed("OptionalObjects", optional),
        _listed("ManufacturerObjects", ours),
        *(text for one in OBJECTS for text in _object(one)),
    ]  # fmt: skip
    return "\n".join(parts)


def object_dictionary(node_id: int) -> ObjectDictionary:
    """The dictionary of a node, as canopen reads it from the EDS.

    Args:
        node_id: 1 to 127.
    """
    from canopen.objectdictionary.eds import import_eds

    dictionary: ObjectDictionary = import_eds(io.StringIO(eds_text()), node_id)
    return dictionary


def _section(name: str, values: dict[str, object]) -> str:
    return "\n".join((f"[{name}]", *(f"{key}={value}" for key, value in values.items()), ""))


def _listed(name: str, objects: list[Object]) -> str:
    numbers = {str(k): f"0x{one.index:04X}" for k, one in enumerate(objects, 1)}
    return _section(name, {"SupportedObjects": len(objects), **numbers})


def _object(one: Object) -> list[str]:
    if one.kind == "VAR":
        return [_section(f"{one.index:04X}", _entry(one.entries[0]))]
    head: dict[str, object] = {
        "ParameterName": one.name,
        "ObjectType": f"0x{_KINDS[one.kind]:X}",
        "SubNumber": len(one.entries),
    }
    below = [_section(f"{one.index:04X}sub{entry.subindex:X}", _entry(entry)) for entry in one.entries]
    return [_section(f"{one.index:04X}", head), *below]


def _default(entry: Entry) -> str:
    """A default as other EDS files have it: in hexadecimal, as wide as its type; what is below 0 has no such form."""
    if entry.type not in BITS or not isinstance(entry.default, int) or entry.default < 0:
        return str(entry.default)
    return f"0x{entry.default:0{BITS[entry.type] // 4}X}"


def _entry(entry: Entry) -> dict[str, object]:
    values: dict[str, object] = {
        "ParameterName": entry.name,
        "ObjectType": f"0x{_KINDS['VAR']:X}",
        "DataType": f"0x{TYPES[entry.type]:04X}",
        "AccessType": entry.access,
    }
    if entry.default is not None:
        values["DefaultValue"] = _default(entry)
    limits = {"LowLimit": entry.low, "HighLimit": entry.high}
    values |= {key: limit for key, limit in limits.items() if limit is not None}
    return {**values, "PDOMapping": int(entry.mappable)}
