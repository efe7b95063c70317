"""Exported C, run from Python over whole logs: for comparisons with the sensor that it was made from."""

from __future__ import annotations

import ctypes
import tempfile
from pathlib import Path
from string import Template

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ramsight.deploy.c_sensor import ROW, SensorSource, reading
from ramsight.deploy.compiler import STRICT, library
from ramsight.sensor.virtual_sensor import VirtualSensor


class CompiledSensor:
    """A sensor's C as a function of a log.

    Args:
        source: header and body.
        sensor: whose outputs it has.
        compiler: path of the C compiler.
        single: with floats.
        options: further ones of the compiler, for example ``-march=native``.
    """

    def __init__(
        self,
        source: SensorSource,
        sensor: VirtualSensor,
        compiler: str,
        *,
        single: bool = False,
        options: tuple[str, ...] = (),
    ) -> None:
        outputs = sensor.recursion.outputs
        copies = "\n".join(f"    *out++ = (double)said.{name};" for name in outputs)
        further = sensor.further
        reads = reading(source.prefix, further, "sample", "in")
        text = Template(Path(__file__).with_name("sensor_replay.c").read_text(encoding="utf-8"))
        replay = text.substitute(p=source.prefix, copies=copies, further=reads, columns=len(ROW) + len(further))
        files = {**source.files, "replay.c": replay}
        files = {name: text for name, text in files.items() if not name.endswith("_test.c")}
        self._outputs = len(outputs)
        with tempfile.TemporaryDirectory() as folder:
            target = Path(folder) / "sensor.so"
            library(compiler, files, target, *STRICT, f"-D{source.prefix.upper()}_FLOAT={int(single)}", *options)
            self._replay = ctypes.CDLL(str(target)).replay
        self._replay.restype = None

    def track(self, rows: ArrayLike, start: float = np.nan, std: float = 1e-3) -> NDArray[np.float64]:
        """All outputs, shape (samples, outputs).

        Args:
            rows: time [s], motor speed [rad/s], torque [N m], oil temperature [K], reference [m] or NaN, and what
                else the sensor takes; shape (samples, 5 and more).
            start: position at first [m]; NaN if unknown.
            std: of it [m].
        """
        rows = np.ascontiguousarray(rows, dtype=np.float64)
        out = np.empty((len(rows), self._outputs))
        pointers = (table.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for table in (rows, out))
        inputs, outputs = pointers
        self._replay(ctypes.c_long(len(rows)), inputs, outputs, ctypes.c_double(start), ctypes.c_double(std))
        return out
