"""The numbers of a machine as a table that exported C is handed: one build, a table for each machine of the kind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ramsight.deploy.c_function import literal
from ramsight.deploy.c_text import indented


@dataclass(frozen=True)
class MachineTable:
    """All that differs between the sensors of machines of one kind."""

    kind: int  # of the step's text: tables of the same kind are of the same circuit, options and assumptions
    identity: int  # of machine and sensor, for slots
    stroke: float  # of the cylinder [m]
    start: Mapping[str, float]  # states before the first sample, in the struct's order
    constants: Mapping[str, float]  # what the step reads, by name

    @property
    def numbers(self) -> dict[str, float]:
        """All of it, by the names of an FMU's parameters, in the struct's order."""
        head = {"kind": float(self.kind), "identity": float(self.identity), "stroke": self.stroke}
        return {
            **{f"machine.{name}": value for name, value in head.items()},
            **{f"machine.start.{name}": value for name, value in self.start.items()},
            **{f"machine.constant.{name.removeprefix('k_')}": value for name, value in self.constants.items()},
        }


def declared(table: MachineTable, prefix: str) -> str:
    """The struct of a table, and the one of the machine that was exported."""
    macro = prefix.upper()
    fields = indented(f"{prefix}_real {name};" for name in table.constants)
    return f"""/* The numbers of a machine; `ramsight export parameters` writes those of another one of this kind. */
#define {macro}_KIND UINT32_C(0x{table.kind:08X})
typedef struct {{
  uint32_t kind, identity;
  double stroke; /* [m] */
  double start[{len(table.start)}]; /* states before the first sample */
{fields}
}} {prefix}_machine;
extern const {prefix}_machine {prefix}_described; /* the machine that was exported */

"""


def initializer(table: MachineTable, prefix: str) -> str:
    """The value of a table."""
    start = ", ".join(map(literal, table.start.values()))
    numbers = ",\n".join(f"  ({prefix}_real)({literal(v)}) /* {name} */" for name, v in table.constants.items())
    head = f"UINT32_C(0x{table.kind:08X}), UINT32_C(0x{table.identity:08X}), {literal(table.stroke)}"
    return f"{{\n  {head},\n  {{{start}}},\n{numbers}\n}}"


def table_header(table: MachineTable, prefix: str, name: str) -> str:
    """A header with the table of a machine."""
    guard = f"{prefix}_{name}_MACHINE_H".upper()
    return (
        f"/* The numbers of {name}, for {prefix}_of(). Pass it before init, start or resume. */\n"
        f'#ifndef {guard}\n#define {guard}\n\n#include "{prefix}.h"\n\n'
        f"static const {prefix}_machine {prefix}_of_{name} = {initializer(table, prefix)};\n\n#endif\n"
    )
