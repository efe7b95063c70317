"""Tables of pages that the code itself states: thresholds, the encoder's, maps of drives, checks of two units."""

from __future__ import annotations

from ramsight.constant import constants_of
from ramsight.deploy.encoder.alarms import OF_STATUS, Fault
from ramsight.deploy.encoder.objects import OBJECTS, Entry, code
from ramsight.deploy.encoder.opcua import GOOD, QUALITY
from ramsight.logs.drive_maps import drive_maps
from ramsight.tracking.sharing import SHARED


def constant_table(module: object) -> str:
    """A table of constants as Markdown, for the documentation."""
    rows = [
        f"| `{name}` | {float(value):g} | {value.unit} | {value.reason} |"
        for name, value in constants_of(module).items()
    ]
    return "\n".join(["| constant | value | unit | where it comes from |", "|---|---|---|---|", *rows])


def shared_table() -> str:
    """The rows for the documentation, in Markdown."""
    rows = ["| | signals | hypothesis | threshold | summed up over | then |", "|" + "---|" * 6]
    threshold = "one false alarm in 1000 h, from declared noise, what lasts, and delay"
    rows += [
        f"| `{one.name}` | {one.signals} | {one.hypothesis} | {threshold} | {one.memory:g} s | {one.then} |"
        for one in SHARED
    ]
    return "\n".join(rows)


def drive_map_table() -> str:
    """The channel maps of drives that ramsight brings, in Markdown, each with its source."""
    lines = ["| map | drive | source | tried |", "|---|---|---|---|"]
    lines += [f"| `{one.name}` | {one.title} | {one.source} | {one.tried} |" for one in drive_maps()]
    return "\n".join(lines)


def fault_table() -> str:
    """The faults as a table for the documentation, in Markdown."""
    lines = ["| condition | sensor status | position | 6503h | 6505h | EMCY | NE 107 |", "|" + "---|" * 7]
    for fault in Fault:
        from_status = ", ".join(status.name.lower() for status, of in OF_STATUS.items() if of is fault)
        validity = "invalid" if fault.alarm else ("uncertain" if fault.warning else "valid")
        emcy = f"{fault.emcy:04X}h" if fault.emcy else "–"
        lines.append(
            f"| {fault.text} | {from_status or '–'} | {validity} | {_bits(fault.alarm)} | {_bits(fault.warning)} "
            f"| {emcy} | {fault.ne107} |"
        )
    return "\n".join(lines) + "\n"


def _bits(word: int) -> str:
    return ", ".join(str(k) for k in range(16) if word >> k & 1) or "–"


def object_table() -> str:
    """The objects as a table for the documentation, in Markdown."""
    lines = ["| object | name | type | access | default | meaning |", "|---|---|---|---|---|---|"]
    for one in OBJECTS:
        for entry in one.entries:
            if one.kind != "VAR" and entry.subindex == 0 and entry.access == "const":
                continue
            if entry.subindex > 1 and one.index in (0x1003, 0x1A00, 0x1A01):
                continue
            name = entry.name + (" … 8" if one.index in (0x1003, 0x1A00, 0x1A01) and entry.subindex else "")
            mapped = ", PDO" if entry.mappable else ""
            lines.append(
                f"| {code(one.index, entry.subindex)} | {name} | {entry.type} | {entry.access}{mapped} "
                f"| {_shown(entry)} | {entry.text} |"
            )
    return "\n".join(lines) + "\n"


def _shown(entry: Entry) -> str:
    """A default as text: identifiers and signatures in hexadecimal."""
    if entry.default is None:
        return ""
    if isinstance(entry.default, str):
        return entry.default.replace("$NODEID", "node")
    return f"{entry.default:X}h" if abs(entry.default) > 0xFFFF and entry.default > 0 else str(entry.default)


def quality_table() -> str:
    """The qualities as a table for the documentation, in Markdown."""
    lines = ["| quality | while |", "|---|---|", f"| {GOOD} | nothing is wrong |"]
    codes = sorted(set(QUALITY.values()), key=lambda one: (one.startswith("Bad"), one))
    while_ = {code: "; ".join(fault.text for fault in Fault if QUALITY[fault] == code) for code in codes}
    return "\n".join([*lines, *(f"| {code} | {text} |" for code, text in while_.items())]) + "\n"
