"""MDF files as asammdf reads them, with one kind of error for whatever its parser stumbles over."""

from __future__ import annotations

import importlib
import logging
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ramsight.errors import LogError
from ramsight.logs.lines import check_file, file_name, first_line
from ramsight.logs.source import needs

_MOST_PACKED = 1100  # how many times smaller deflate can make a block of zeros


def _quieten() -> None:
    """Keep asammdf from writing to standard error: what it has to say is in the error that is raised here."""
    logging.getLogger("asammdf").setLevel(logging.CRITICAL + 1)
    for name in ("mdf_v3.MDF3", "mdf_v4.MDF4"):
        module, _, kind = name.partition(".")
        reader = getattr(importlib.import_module(f"asammdf.blocks.{module}"), kind)
        reader.__del__ = _close  # its own raises where a damaged file was never opened


def _close(reader: Any) -> None:
    with suppress(Exception):
        reader.close()


class MdfFile:
    """An MDF file.

    Args:
        path: the file.

    Attributes:
        groups: its groups of channels, as asammdf has them.

    Raises:
        LogError: it is no MDF file, is damaged, or asammdf is not installed.
    """

    def __init__(self, path: str | Path) -> None:
        check_file(path)
        self._file, self._size = file_name(path), Path(path).stat().st_size
        asammdf = needs("asammdf", "logs", self._file)
        _quieten()
        with self._said("is no MDF file, or a damaged one"):
            self._mdf: Any = asammdf.MDF(str(path))
            self.groups: list[Any] = list(self._mdf.groups)
            for number, group in enumerate(self.groups):
                self._check_size(number, group.channel_group)

    def _check_size(self, number: int, group: Any) -> None:
        """Refuse a group that claims more than the file could hold, before memory is taken for it."""
        claimed = group.cycles_nr * max(getattr(group, "samples_byte_nr", 1), 1)
        if claimed > _MOST_PACKED * self._size:
            raise ValueError(f"group {number} claims {claimed} bytes")

    def clock(self, group: int) -> NDArray[np.float64]:
        """The times of a group [s]."""
        with self._said("is damaged", group=group):
            return np.asarray(self._mdf.get_master(group), dtype=np.float64)
        raise AssertionError

    def master(self, group: int) -> int | None:
        """Which of a group's channels is its clock."""
        found: int | None = self._mdf.masters_db.get(group)
        return found

    def unit(self, group: int, index: int) -> str:
        """The unit of a channel, "" if the file says none."""
        with self._said("is damaged", group=group):
            return str(self._mdf.get_channel_unit(group=group, index=index) or "").strip()
        raise AssertionError

    def values(self, group: int, index: int, start: int, count: int, *, raw: bool = False) -> tuple[Any, Any]:
        """Samples of a channel, and which of them are invalid."""
        with self._said("is damaged", group=group, channel=self.groups[group].channels[index].name):
            values, invalid = self._mdf.get(
                group=group, index=index, samples_only=True, raw=raw, record_offset=start, record_count=count
            )
            if len(values) != count:
                raise ValueError(f"{len(values)} samples from sample {start + 1} on where {count} should be")
            return values, invalid
        raise AssertionError

    @contextmanager
    def _said(self, what: str, *, group: int | None = None, channel: str | None = None) -> Iterator[None]:
        try:
            yield
        except LogError:
            raise
        except Exception as error:  # asammdf raises whatever its parser stumbles over
            place = "" if group is None else f" in group {group}"
            raise LogError(f"{what}{place}: {first_line(error)}", file=self._file, column=channel) from None
