"""Flow and torque of a pump, or its efficiencies, as measured: from a CSV file to the table that laws take."""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ramsight.bounded_toml import LARGEST
from ramsight.errors import DescriptionError
from ramsight.machine.catalogue import own_folder
from ramsight.machine.declare import declaration
from ramsight.machine.parts import Oil, Pump
from ramsight.machine.pump_description import COLUMNS
from ramsight.machine.viscosity import MM2, viscosity_of
from ramsight.units import to_si

KEY = "efficiency_file"
_CHOICES = (
    ("viscosity_mm2s", "temperature_c"),
    ("volumetric_efficiency", "flow_l_min"),
    ("hydromechanical_efficiency", "torque_nm"),
)
_ALLOWED = "pressure_bar, speed_rpm, and of each pair one: " + "; ".join(" or ".join(pair) for pair in _CHOICES)


def with_map(pump: dict[str, Any], oil: Any, folder: Path) -> dict[str, Any]:
    """A pump's values with the table of its file in the place of the file's name.

    Args:
        pump: values as they are written, those of its model among them, with ``efficiency_file``.
        oil: of the unit, the same; its viscosities are needed where the file states temperatures.
        folder: that the file's name counts from, and that holds the file: a description reads no others.

    Raises:
        DescriptionError: the file is elsewhere, cannot be read, or is no full grid of what is needed; names file, line
            and value.
    """
    name = pump[KEY]
    if not isinstance(name, str):
        raise DescriptionError("is no file's name", key=KEY, value=name)
    if not any(_is_within(folder / name, place) for place in (folder, own_folder())):
        raise DescriptionError(
            "leads out of the description's folder", key=KEY, value=name, allowed="a file beside the description"
        )
    if not (folder / name).exists():
        raise DescriptionError("no such file", key=KEY, value=name, allowed="a file beside the description")
    size = _value(Pump, "displacement", pump) * int(pump.get("chambers", 1)) * int(pump.get("blocks", 1))
    points = {
        key: _value(Oil, key, oil if isinstance(oil, Mapping) else {}) for key in ("viscosity_40c", "viscosity_100c")
    }

    def viscosity(kelvin: float) -> float:
        return viscosity_of(points["viscosity_40c"], points["viscosity_100c"], kelvin)

    table = read_map(folder / name, size, viscosity)
    return {**{key: value for key, value in pump.items() if key != KEY}, "losses": "table", "efficiency_table": table}


def _is_within(path: Path, folder: Path) -> bool:
    """Whether a file is in a folder or below it, by its name; links are followed only when it is read."""
    return Path(os.path.abspath(path)).is_relative_to(os.path.abspath(folder))


def read_map(path: Path, displacement: float, viscosity: Callable[[float], float]) -> str:
    """The table of a pump's file, as text with the columns of `pump_description.COLUMNS`.

    Flow is that at the outlet, torque that at the shaft, of all chambers and blocks, in pump operation.

    Args:
        path: CSV with the columns pressure_bar, speed_rpm, viscosity_mm2s or temperature_c, volumetric_efficiency or
            flow_l_min, hydromechanical_efficiency or torque_nm.
        displacement: of all chambers and blocks [m3/rad].
        viscosity: of the oil at a temperature [K], in m2/s.

    Raises:
        DescriptionError: it cannot be read; names file, line and value.
    """
    file = str(path)
    rows = _rows(path)
    if len(rows) < 2:
        raise DescriptionError("needs a line of columns, and a line for each point", file=file, allowed=_ALLOWED)
    names = [name.strip() for name in rows[0]]
    for pair in (("pressure_bar",), ("speed_rpm",), *_CHOICES):
        if sum(name in names for name in pair) != 1:
            raise DescriptionError(
                f"needs one column {' or '.join(pair)}", file=file, value=", ".join(names), allowed=_ALLOWED
            )
    lines = [",".join(COLUMNS)]
    for number, row in enumerate(rows[1:], 2):
        lines.append(_line(f"{file}, line {number}", dict(zip(names, row, strict=False)), displacement, viscosity))
    return "\n".join(lines)


def _line(place: str, row: dict[str, str], displacement: float, viscosity: Callable[[float], float]) -> str:
    """A point as a line of the table."""

    def number(name: str) -> float:
        try:
            if not row[name].isascii():
                raise ValueError
            value = float(row[name])
        except (KeyError, ValueError):
            raise DescriptionError("is no number", file=place, key=name, value=row.get(name, "nothing")) from None
        if not (math.isfinite(value) and (value > 0.0 or name == "temperature_c")):
            raise DescriptionError("is out of range", file=place, key=name, value=row[name], allowed="above 0")
        return value

    pressure, speed = number("pressure_bar"), number("speed_rpm")
    if "viscosity_mm2s" in row:
        thickness = number("viscosity_mm2s")
    else:
        thickness = viscosity(to_si(number("temperature_c"), "degC")) / MM2
    theory = displacement * to_si(speed, "rpm")
    flow = to_si(number("flow_l_min"), "l/min") / theory if "flow_l_min" in row else number("volumetric_efficiency")
    if "torque_nm" in row:
        torque = displacement * to_si(pressure, "bar") / number("torque_nm")
    else:
        torque = number("hydromechanical_efficiency")
    for name, value in (("volumetric", flow), ("hydro-mechanical", torque)):
        if value > 1.0:
            text = f"makes a {name} efficiency of {value:.3f}: is the displacement right, are all chambers counted?"
            raise DescriptionError(text, file=place, allowed="up to 1")
    return f"{pressure:.9g},{speed:.9g},{thickness:.6g},{flow:.9g},{torque:.9g}"


def _rows(path: Path) -> list[list[str]]:
    try:
        with open(path, "rb") as stream:
            content = stream.read(LARGEST + 1)
        if len(content) > LARGEST:
            raise DescriptionError("is too large for a pump's map", file=str(path), allowed="up to 1 MiB")
        text = content.decode("utf-8-sig")
        return [
            row for row in csv.reader(io.StringIO(text), skipinitialspace=True) if row and not row[0].startswith("#")
        ]
    except FileNotFoundError:
        raise DescriptionError("no such file", file=str(path), key=KEY) from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DescriptionError(f"cannot be read: {error}", file=str(path), key=KEY) from None


def _value(part: Any, key: str, values: Mapping[str, Any]) -> float:
    """A value as it is written, in SI."""
    declared = declaration(part.model_fields[key])
    assert declared is not None
    if key not in values:
        raise DescriptionError(f"needs {key}, which is missing", key=KEY)
    return float(declared.read(values[key], from_file=True))
