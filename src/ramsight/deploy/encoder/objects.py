"""The encoder's objects, declared once: dictionary, EDS file, checks and documentation all come from here.

Communication objects are those of CiA 301, 6000h and up those of CiA 406 for a linear absolute encoder (class C2),
2000h and up are ours. 6001h and 6502h are of rotary encoders and are left out.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ramsight.tool.load_chart import LoadStatus
from ramsight.tool.weighing_events import Quality
from ramsight.tracking.availability import LONGEST_ALERT, TIME_TO_ALERT
from ramsight.tracking.comparing import TOLERANCE

if TYPE_CHECKING:
    from canopen import ObjectDictionary


TYPES = {"INT16": 3, "INT32": 4, "UINT8": 5, "UINT16": 6, "UINT32": 7, "VISIBLE_STRING": 9}
"""Data types of CiA 301 and their codes."""

BITS = {"INT16": 16, "INT32": 32, "UINT8": 8, "UINT16": 16, "UINT32": 32}

DEVICE_TYPE = 0x0008_0196
"""Absolute linear encoder, profile 406."""
PRODUCT = 0x5253_0001
REVISION = 0x0001_0001
SAVE, LOAD, FORGET = 0x6576_6173, 0x6461_6F6C, 0x6772_6F66
"""'save', 'load' and 'forg' as CiA 301 has signatures: the first letter in the lowest byte."""
NO_TEMPERATURE = -(1 << 15)
LEAST, MOST = -(1 << 31), (1 << 31) - 1

SHORTEST_HEARTBEAT = 10  # ms

QUALITIES, LOAD_STATUSES = tuple(Quality), tuple(LoadStatus)
"""What a weighing is worth, and whether it exceeded the rated load; their places here are their numbers."""
NO_WEIGHING, NO_SCALE = 254, 255
"""Qualities before the first weighing, and of a machine that weighs nothing."""


def _numbered(all_of: tuple[Quality, ...] | tuple[LoadStatus, ...]) -> str:
    return ", ".join(f"{number} {one.name.lower().replace('_', ' ')}" for number, one in enumerate(all_of))


COMMUNICATION, APPLICATION = "communication", "application"
"""What 1010h and 1011h keep apart."""


@dataclass(frozen=True)
class Entry:
    """One value."""

    subindex: int  # within its object
    name: str  # in the EDS
    type: str  # one of `TYPES`
    access: str  # `ro`, `rw`, `wo` or `const`
    # at first; None where it depends on the machine, `$NODEID+0x180` where it does on the node
    default: int | str | None
    text: str = ""  # what it means
    # low, high: the least and largest value that is taken
    low: int | None = None
    high: int | None = None
    mappable: bool = False  # whether a PDO may hold it


@dataclass(frozen=True)
class Object:
    """An object: one entry of subindex 0, or an array or record of them."""

    index: int  # its number
    name: str  # in the EDS
    entries: tuple[Entry, ...]  # its values
    kind: str = "VAR"  # `VAR`, `ARRAY` or `RECORD`

    @property
    def group(self) -> str:
        """Which parameters of 1010h it belongs to."""
        return COMMUNICATION if self.index < 0x2000 else APPLICATION


def _var(
    index: int, name: str, type: str, access: str, default: int | str | None, text: str = "",
    low: int | None = None, high: int | None = None, mappable: bool = False,
) -> Object:  # fmt: skip
    return Object(index, name, (Entry(0, name, type, access, default, text, low, high, mappable),))


def _many(
    index: int, name: str, entries: tuple[Entry, ...], kind: str = "RECORD", count: Entry | None = None
) -> Object:
    last = max(entry.subindex for entry in entries)
    zero = count or Entry(0, "Highest subindex supported", "UINT8", "const", last)
    return Object(index, name, (zero, *entries), kind)


def _signed(index: int, name: str, words: str) -> Object:
    parts = ("all parameters", "communication parameters", "application parameters")
    entries = (Entry(k, f"{name}: {part}", "UINT32", "rw", 1, words) for k, part in enumerate(parts, 1))
    return _many(index, name, tuple(entries), "ARRAY")


def _tpdo(number: int, cob: int, type: int, timer: int) -> tuple[Object, Object]:
    name = f"TPDO{number + 1}"
    settings = (
        Entry(1, f"{name} COB-ID", "UINT32", "rw", f"$NODEID+0x{cob:X}", "bit 31 switches it off; bit 30: no RTR"),
        Entry(2, f"{name} transmission type", "UINT8", "rw", type, "0, 1–240: with SYNC; 254, 255: by its event timer"),
        Entry(5, f"{name} event timer", "UINT16", "rw", timer, "ms" + ", the same as 6200h" * (number == 0)),
    )
    mapped = tuple(
        Entry(k, f"{name} mapped object {k}", "UINT32", "rw", 0x6004_0020 if k == 1 else 0, "index, subindex, bits")
        for k in range(1, 9)
    )
    count = Entry(0, f"{name} number of mapped objects", "UINT8", "rw", 1, "0 while the mapping is changed", 0, 8)
    return (
        _many(0x1800 + number, f"{name} communication parameter", settings),
        _many(0x1A00 + number, f"{name} mapping parameter", mapped, count=count),
    )


_TPDO1, _MAP1 = _tpdo(0, 0x4000_0180, 254, 10)
_TPDO2, _MAP2 = _tpdo(1, 0x4000_0280, 1, 0)

OBJECTS: tuple[Object, ...] = (
    _var(0x1000, "Device type", "UINT32", "const", DEVICE_TYPE, "absolute linear encoder, profile 406"),
    _var(0x1001, "Error register", "UINT8", "ro", 0,
         "bit 0 any, 3 temperature, 4 communication, 5 profile, 7 device", mappable=True),
    _many(0x1003, "Pre-defined error field",
          tuple(Entry(k, f"Error {k}", "UINT32", "ro", 0, "code, and the status above it") for k in range(1, 9)),
          "ARRAY", Entry(0, "Number of errors", "UINT8", "rw", 0, "0 clears them")),
    _var(0x1005, "COB-ID SYNC", "UINT32", "const", 0x80),
    _var(0x1008, "Manufacturer device name", "VISIBLE_STRING", "const", "ramsight encoder"),
    _var(0x1009, "Manufacturer hardware version", "VISIBLE_STRING", "const", "virtual"),
    _var(0x100A, "Manufacturer software version", "VISIBLE_STRING", "const", None, "version of ramsight"),
    _signed(0x1010, "Store", "'save' stores; also the position and what was learned"),
    _signed(0x1011, "Restore defaults", "'load' restores, from the next reset on"),
    _var(0x1014, "COB-ID EMCY", "UINT32", "const", "$NODEID+0x80"),
    _var(0x1015, "Inhibit time EMCY", "UINT16", "rw", 100, "0.1 ms; between two emergencies"),
    _many(0x1016, "Consumer heartbeat time",
          (Entry(1, "Heartbeat of the drive", "UINT32", "rw", 0, "node << 16 | ms; 0 does not watch", 0, 0x007F_FFFF),),
          "ARRAY"),
    _var(0x1017, "Producer heartbeat time", "UINT16", "rw", 1000, f"ms, at least {SHORTEST_HEARTBEAT}; 0 stops it"),
    _many(0x1018, "Identity object", (
        Entry(1, "Vendor-ID", "UINT32", "const", 0, "none is registered"),
        Entry(2, "Product code", "UINT32", "const", PRODUCT),
        Entry(3, "Revision number", "UINT32", "const", REVISION),
        Entry(4, "Serial number of the device", "UINT32", "ro", None),
    )),
    _many(0x1029, "Error behaviour",
          (Entry(1, "Communication error", "UINT8", "const", 1, "its NMT state stays"),), "ARRAY"),
    _many(0x1200, "SDO server parameter", (
        Entry(1, "COB-ID client to server", "UINT32", "const", "$NODEID+0x600"),
        Entry(2, "COB-ID server to client", "UINT32", "const", "$NODEID+0x580"),
    )),
    _TPDO1, _TPDO2, _MAP1, _MAP2,
    _var(0x2000, "Position while invalid", "UINT8", "rw", 1, "0: the last valid one is held; 1: the fault value", 0, 1),
    _var(0x2001, "Fault value", "INT32", "rw", MOST, "in measuring steps; far from any position"),
    _var(0x2002, "Drive timeout", "UINT16", "rw", 100, "ms without speed or torque until the position is invalid",
         10, 10000),
    _var(0x2003, "Forget the position", "UINT32", "wo", None, "'forg': not referenced any more; factors stay"),
    _var(0x2004, "Drive period", "UINT16", "rw", 0, "0.1 ms between two frames of the drive; 0: learned", 0, 10000),
    _var(0x2010, "Position standard deviation", "UINT32", "ro", None, "measuring steps", mappable=True),
    _var(0x2011, "Sensor status", "UINT8", "ro", None, "number of the sensor's status", mappable=True),
    _var(0x2012, "Sensor status text", "VISIBLE_STRING", "ro", None),
    _var(0x2013, "Load", "INT32", "ro", None, "N, positive against lifting", mappable=True),
    _var(0x2014, "Position bound", "UINT32", "ro", None, "measuring steps; one error in 100000 exceeds it",
         mappable=True),
    _var(0x2015, "Referenced since power-up", "UINT8", "ro", None, "1: an end stop, a switch or a preset has been seen",
         mappable=True),
    _var(0x2016, "Load standard deviation", "UINT32", "ro", None, "N; FFFFFFFFh: unknown", mappable=True),
    _var(0x2017, "Load age", "UINT32", "ro", None, "ms since the torque has shown the load; FFFFFFFFh: unknown",
         mappable=True),
    _var(0x2030, "Position by the real sensor", "INT32", "ro", None, "measuring steps; 7FFFFFFFh: it says none",
         mappable=True),
    _var(0x2031, "Verdict on both sensors", "UINT8", "ro", None,
         "0 agree, 1 unchecked, 2 apart, 3 the real one is wrong, 4 this one is wrong; 255: no real one is mapped",
         mappable=True),
    _var(0x2032, "Tolerance of the real sensor", "UINT32", "rw", round(1e6 * TOLERANCE), "µm", 1, 1_000_000),
    _var(0x2033, "Time to alert", "UINT16", "rw", round(1e3 * TIME_TO_ALERT), "ms for which both have to be apart",
         0, round(1e3 * LONGEST_ALERT)),
    _var(0x2040, "Mass of the last weighing", "INT32", "ro", None, "kg; 7FFFFFFFh: none", mappable=True),
    _var(0x2041, "Mass standard deviation", "UINT32", "ro", None, "kg; FFFFFFFFh: unknown", mappable=True),
    _var(0x2042, "Number of weighings", "UINT16", "ro", None,
         "since power-up, 0 after FFFFh; lowering the same load makes the last one better and adds none",
         mappable=True),
    _var(0x2043, "Weighing quality", "UINT8", "ro", None,
         f"{_numbered(QUALITIES)}; 254 no weighing yet, 255 this machine weighs nothing", mappable=True),
    _var(0x2044, "Total mass", "UINT32", "ro", None, "kg since power-up, one good weighing of each cycle",
         mappable=True),
    _var(0x2045, "Total mass standard deviation", "UINT32", "ro", None, "kg", mappable=True),
    _var(0x2046, "Share of the rated load", "UINT16", "ro", None,
         "0.1 %, the largest of the last lift; FFFFh: unknown", mappable=True),
    _var(0x2047, "Share standard deviation", "UINT16", "ro", None, "0.1 %; FFFFh: unknown", mappable=True),
    _var(0x2048, "Rated load status", "UINT8", "ro", None, f"{_numbered(LOAD_STATUSES)}; no safety function",
         mappable=True),
    _var(0x2100, "Oil temperature", "INT16", "rw", NO_TEMPERATURE, "0.1 °C, for who writes it; 8000h: none"),
    _var(0x6000, "Operating parameters", "UINT16", "rw", 0x0004,
         "bit 2: steps of 6005h, else of 6501h; bit 3: extending counts down"),
    _var(0x6002, "Total measuring range in measuring units", "UINT32", "ro", None, "the stroke"),
    _var(0x6003, "Preset value", "INT32", "rw", 0, "the piston is here now: a reference by hand"),
    _var(0x6004, "Position value", "INT32", "ro", None, "measuring steps", mappable=True),
    _many(0x6005, "Linear encoder measuring step settings", (
        Entry(1, "Measuring step", "UINT32", "rw", 10_000, "0.001 µm", 1_000, 100_000_000),
        Entry(2, "Speed step", "UINT32", "rw", 10, "0.01 mm/s", 1, 100_000),
    ), "ARRAY"),
    _many(0x6030, "Speed value", (Entry(1, "Speed", "INT16", "ro", None, "speed steps", mappable=True),), "ARRAY"),
    _var(0x6200, "Cyclic timer", "UINT16", "rw", 10, "ms, of TPDO1; the same as 1800h:05"),
    _many(0x6400, "Area state register",
          (Entry(1, "Work area state", "UINT8", "ro", None, "bit 0 outside, 1 above, 2 below", mappable=True),),
          "ARRAY"),
    _many(0x6401, "Work area low limit",
          (Entry(1, "Low limit", "INT32", "rw", LEAST, "measuring steps"),), "ARRAY"),
    _many(0x6402, "Work area high limit",
          (Entry(1, "High limit", "INT32", "rw", MOST, "measuring steps"),), "ARRAY"),
    _var(0x6500, "Operating status", "UINT16", "ro", None, "6000h as it is"),
    _var(0x6501, "Measuring step", "UINT32", "const", 1_000, "0.001 µm, the finest"),
    _var(0x6503, "Alarms", "UINT16", "ro", None,
         "bit 0 position error, 12 stored data damaged, 13 state cannot be saved, 14 a real sensor contradicts",
         mappable=True),
    _var(0x6504, "Supported alarms", "UINT16", "ro", None),
    _var(0x6505, "Warnings", "UINT16", "ro", None,
         "bit 0 overspeed, 2 input lost, 5 not referenced, 12 reference due, 13 limits, 14 temperature, 15 gap",
         mappable=True),
    _var(0x6506, "Supported warnings", "UINT16", "ro", None),
    _var(0x6507, "Profile and software version", "UINT32", "const", 0x0001_0302),
    _var(0x6508, "Operating time", "UINT32", "const", 0xFFFF_FFFF, "not counted"),
    _var(0x6509, "Offset value", "INT32", "const", 0, "a preset moves the position, not an offset"),
    _many(0x650A, "Module identification", (
        Entry(1, "Manufacturer offset value", "INT32", "const", 0),
        Entry(2, "Minimum position value", "INT32", "const", 0),
        Entry(3, "Maximum position value", "INT32", "ro", None, "the stroke"),
    ), "ARRAY"),
    _var(0x650B, "Serial number", "UINT32", "ro", None),
)  # fmt: skip
"""All objects, by index."""

ENTRIES = {(one.index, entry.subindex): entry for one in OBJECTS for entry in one.entries}
GROUPS = {one.index: one.group for one in OBJECTS}

PASSING = {0x1003, 0x1010, 0x1011, 0x2003, 0x2100, 0x6003}
"""Objects that are written but are no parameters."""

RUNNING = {0x6401, 0x6402}
"""Parameters that may be written while the node is operational: they change neither position nor messages."""

STORED = tuple(key for key, entry in ENTRIES.items() if entry.access == "rw" and key[0] not in PASSING)


def code(index: int, subindex: int = 0) -> str:
    """How the pages call an entry.

    Example:
        >>> code(0x6004), code(0x6005, 1)
        ('6004h', '6005h:01')
    """
    alone = (index, 1) not in ENTRIES
    return f"{index:04X}h" if alone else f"{index:04X}h:{subindex:02X}"


def limits(type: str) -> tuple[int, int]:
    """The least and the largest value of an integer type.

    Example:
        >>> limits("INT16"), limits("UINT8")
        ((-32768, 32767), (0, 255))
    """
    bits, sign = BITS[type], type.startswith("INT")
    return (-(1 << bits - 1), (1 << bits - 1) - 1) if sign else (0, (1 << bits) - 1)


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
