"""What the drives of a rig have reported and where the pistons were: the log of a live run, with its truth."""

from __future__ import annotations

import json
import math
import zipfile
from array import array
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ramsight.arrays import Array
from ramsight.duty.live import Reported
from ramsight.errors import OutputError
from ramsight.logs import write_log
from ramsight.logs.channels import DRIVE_LOG, MOTOR_SPEED, MOTOR_TORQUE, OIL_TEMPERATURE, REFERENCE
from ramsight.optional import needing
from ramsight.output import atomic_path
from ramsight.output.table_file import write_table

LONGEST = 3600.0  # s of a run that are kept
_SLACK = 1.1  # times as much may be kept before the oldest is dropped, so that it is dropped seldom


class Recorder:
    """The log of one unit's drive and its truth, of the newest hour.

    Args:
        period: of the samples [s].
    """

    def __init__(self, period: float) -> None:
        self._most = round(LONGEST / period)
        self._reports: dict[str, array[float]] = {}
        self._truth: dict[str, array[float]] = {"time_s": array("d"), "position_m": array("d")}

    def report(self, time: float, values: Mapping[str, float]) -> None:
        """Keep what the drive has reported.

        Args:
            time: [s].
            values: by signal, in SI; NaN is kept of signals that are missing.
        """
        count = len(self._reports.get("time", ()))
        for name in sorted({"time", *values} - set(self._reports)):
            self._reports[name] = array("d", [math.nan]) * count
        for name, column in self._reports.items():
            column.append(time if name == "time" else values.get(name, math.nan))
        self._drop(self._reports)

    def truth(self, time: float, position: float) -> None:
        """Keep where the piston is [m] at a time [s]."""
        self._truth["time_s"].append(time)
        self._truth["position_m"].append(position)
        self._drop(self._truth)

    def _drop(self, columns: Mapping[str, array[float]]) -> None:
        count = len(next(iter(columns.values())))
        if count > _SLACK * self._most:
            for column in columns.values():
                del column[: count - self._most]

    def _known_reports(self) -> dict[str, Array]:
        """The reports since the truth begins; of a drive that was silent older ones are kept."""
        columns = {key: np.array(column) for key, column in self._reports.items()}
        is_known = columns["time"] >= self._truth["time_s"][0]
        return {key: column[is_known] for key, column in columns.items()}

    def save(self, path: Path, name: str, toml: str) -> None:
        """Write log, truth and description as a ZIP file, with the command that tracks them.

        The log is in CSV and, where the extra `logs` is installed, in MCAP.

        Raises:
            OutputError: the drive has not reported anything yet, or the file cannot be written.
        """
        with needing("datasets"):
            import xarray

        if not self._reports:
            raise OutputError(f"{name}: the drive has not reported anything yet")
        columns = self._known_reports()
        if not len(columns["time"]):
            raise OutputError(f"{name}: the drive has not reported anything for {LONGEST / 60.0:g} min")
        known = {key: ("time", column) for key, column in columns.items() if key != "time"}
        if not np.isfinite(columns[REFERENCE.name]).any():
            del known[REFERENCE.name]
        log = xarray.Dataset(known, coords={"time": columns["time"]}, attrs={"kind": DRIVE_LOG})
        with TemporaryDirectory(dir=path.parent) as made:
            folder = Path(made)
            for suffix in (".csv", ".mcap") if find_spec("mcap") else (".csv",):
                write_log(log, folder / f"log{suffix}")
            truth = {key: np.array(column) for key, column in self._truth.items()}
            write_table(truth, folder / "truth.csv")
            (folder / "machine.toml").write_text(toml, encoding="utf-8", newline="\n")
            start = float(np.interp(columns["time"][0], truth["time_s"], truth["position_m"]))
            (folder / "README.txt").write_text(_readme(name, start), encoding="utf-8", newline="\n")
            with atomic_path(path) as file, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
                for one in sorted(folder.iterdir()):
                    archive.write(one, one.name)


def reported(said: Reported, reference: float | None, further: Mapping[str, float]) -> dict[str, float]:
    """One report of a drive as a log has it, in SI; NaN where there is no reference."""
    channels = (MOTOR_SPEED, MOTOR_TORQUE, OIL_TEMPERATURE)
    three = {one.name: float(getattr(said, one.name)) for one in channels}
    return three | {REFERENCE.name: math.nan if reference is None else reference, **further}


def _readme(unit: str, start: float) -> str:
    position = json.dumps(f"{1e3 * start:.1f} mm")
    return (
        "A run of the studio: the drive's log, the true position of the piston, and the machine's description.\n\n"
        f"ramsight track machine.toml log.csv --unit {unit} --truth truth.csv --figure track.png\n\n"
        f"With the position at the beginning: --start {position}\n"
    )
