"""A calibrated sensor as a file: one zip of a TOML header and the arrays it names.

``sensor.toml`` says format, kind, unit, the arrays' units and shapes, and a hash of all of it; each array is an
``.npy`` file beside it. The same sensor always gives the same bytes.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from ramsight import bounded_toml
from ramsight.arrays import Array
from ramsight.errors import RamsightError, one_line
from ramsight.output import atomic_path
from ramsight.sensor.table import MovementTable

FORMAT = 1
SUFFIX = ".sensor"
_HEADER = "sensor.toml"
_UNITS = {"temperature": "K", "lift_torque": "N m", "lift": "m/rad", "lower_torque": "N m", "lower": "m/rad"}
_NUMBERS = {"motor_speed": "rad/s", "lift_sign": "1", "relief_torque": "N m"}
_LARGEST = 64 * 2**20  # bytes; a table that large would not fit into a sensor
_DAMAGED = (zipfile.BadZipFile, zlib.error, KeyError, ValueError, TypeError, EOFError, NotImplementedError)


class SensorFileError(RamsightError):
    """A sensor file that cannot be used; the text states why and what to do."""


def save(movement: MovementTable, path: str | Path) -> None:
    """Write a table's sensor whole, or not at all.

    Args:
        movement: the table.
        path: the file; it may have any name, `SUFFIX` is usual.

    Raises:
        OutputError: the file cannot be written.
    """
    members = {_HEADER: _header(movement).encode()}
    for name in _UNITS:
        content = io.BytesIO()
        np.save(content, _array(movement, name), allow_pickle=False)
        members[f"{name}.npy"] = content.getvalue()
    with atomic_path(path) as draft, zipfile.ZipFile(draft, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, data in members.items():
            packed.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)


def load(path: str | Path) -> MovementTable:
    """Read the table of a sensor file.

    Args:
        path: the file.

    Raises:
        SensorFileError: it cannot be read, is damaged, or was written by a newer ramsight.

    Example:
        >>> import tempfile
        >>> grid, values = np.array([1.0, 80.0]), np.array([[1.3e-4, 1.2e-4]])
        >>> made = MovementTable("boom", 157.0, np.array([313.15]), grid, values, grid, values, 1.0)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     save(made, Path(folder) / "boom.sensor")
        ...     load(Path(folder) / "boom.sensor").motor_speed
        157.0
    """
    shown = one_line(path)
    try:
        with zipfile.ZipFile(path) as packed:
            if sum(member.file_size for member in packed.infolist()) > _LARGEST:
                raise SensorFileError(f"{shown}: is too large for a sensor file")
            header = bounded_toml.loads(packed.read(_HEADER).decode())
            _check_format(header, shown)
            arrays = {name: _read_array(packed.read(f"{name}.npy")) for name in _UNITS}
            numbers = {name: float(header["numbers"][name]["value"]) for name in _NUMBERS}
            movement = MovementTable(
                unit=str(header["unit"]),
                motor_speed=numbers["motor_speed"],
                lift_sign=numbers["lift_sign"],
                relief_torque=numbers["relief_torque"],
                **arrays,
            )
    except OSError as error:
        raise SensorFileError(f"{shown}: cannot be read: {error.strerror or error}") from error
    except _DAMAGED as error:
        raise SensorFileError(f"{shown}: is damaged or no sensor file; calibrate again") from error
    problem = _problem(movement)
    if problem or header.get("hash") != table_hash(movement):
        raise SensorFileError(f"{shown}: is damaged ({problem or 'its hash does not fit'}); calibrate again")
    return movement


def table_hash(movement: MovementTable) -> str:
    """Hash of all that a table says; equal tables have the same one."""
    digest = hashlib.sha256(json.dumps([movement.unit, [_number(movement, n) for n in _NUMBERS]]).encode())
    for name in _UNITS:
        array = _array(movement, name)
        digest.update(f"{name}{array.shape}".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def _header(movement: MovementTable) -> str:
    lines = [
        f"format = {FORMAT}",
        'kind = "table"',
        f"unit = {json.dumps(movement.unit)}",
        f'hash = "{table_hash(movement)}"',
    ]
    for name, unit in _NUMBERS.items():
        lines += ["", f"[numbers.{name}]", f"value = {_number(movement, name)!r}", f'unit = "{unit}"']
    for name, unit in _UNITS.items():
        shape = list(_array(movement, name).shape)
        lines += ["", f"[arrays.{name}]", f'file = "{name}.npy"', f'unit = "{unit}"', f"shape = {shape}"]
    return "\n".join(lines) + "\n"


def _check_format(header: dict[str, Any], shown: str) -> None:
    stated = header.get("format")
    if isinstance(stated, int) and stated > FORMAT:
        raise SensorFileError(
            f"{shown}: format {stated} was written by a newer ramsight; this one reads up to {FORMAT}, update it"
        )
    if isinstance(stated, bool) or stated != FORMAT:
        raise SensorFileError(f"{shown}: format {stated!r} is no format of a sensor file (known: {FORMAT})")
    if header.get("kind") != "table":
        raise SensorFileError(f"{shown}: holds a sensor of unknown kind {header.get('kind')!r} (known: table)")


def _problem(movement: MovementTable) -> str:
    """What is wrong with a table, or nothing."""
    grids = {name: _array(movement, name) for name in ("temperature", "lift_torque", "lower_torque")}
    for name, grid in grids.items():
        if grid.ndim != 1 or not grid.size or not np.isfinite(grid).all() or not (np.diff(grid) > 0.0).all():
            return f"{name} does not increase"
    for name in ("lift", "lower"):
        array, shape = _array(movement, name), (grids["temperature"].size, grids[f"{name}_torque"].size)
        if array.shape != shape or not np.isfinite(array).all():
            return f"{name} is not a table of {shape[0]} x {shape[1]} numbers"
    numbers = movement.motor_speed > 0.0 and movement.relief_torque > 0.0 and abs(movement.lift_sign) == 1.0
    return "" if numbers and math.isfinite(movement.motor_speed) else "a number is out of its range"


def _read_array(data: bytes) -> Array:
    array = np.load(io.BytesIO(data), allow_pickle=False)
    if array.dtype != np.float64:
        raise ValueError("not an array of floats")
    return np.asarray(array)


def _array(movement: MovementTable, name: str) -> Array:
    return np.ascontiguousarray(getattr(movement, name), dtype=np.float64)


def _number(movement: MovementTable, name: str) -> float:
    return float(getattr(movement, name))
