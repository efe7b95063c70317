"""The process that reads MDF files with asammdf, on behalf of `mdf_file`.

A damaged file can bring asammdf's compiled parts down, or keep them busy for ever; here that ends this process and not
the one that asked. It takes a request a line as JSON and answers with a line of JSON and the bytes of arrays.
"""

from __future__ import annotations

import json
import logging
import os
import sys
from contextlib import suppress
from typing import Any

import numpy as np

_MOST_PACKED = 1100  # how many times smaller deflate can make a block of zeros


_TIME = 1  # sync type of a clock; files before MDF 4 have no other


class Server:
    """Answers requests about the files that it has opened."""

    def __init__(self) -> None:
        self._files: dict[int, Any] = {}
        self._number = 0

    def answer(self, request: dict[str, Any]) -> tuple[Any, list[Any]]:
        """What a request asks for: a value, and arrays."""
        what, number = request["do"], int(request.get("file", 0))
        if what == "open":
            return self._open(request["path"]), []
        if what == "close":
            with suppress(Exception):
                self._files.pop(number).close()
            return None, []
        mdf = self._files[number]
        if what == "clock":
            return None, [np.asarray(mdf.get_master(request["group"]), dtype=np.float64)]
        start, count = request["start"], request["count"]
        values, invalid = mdf.get(
            group=request["group"],
            index=request["index"],
            samples_only=True,
            raw=request["raw"],
            ignore_invalidation_bits=True,
            record_offset=start,
            record_count=count,
        )
        if len(values) != count:
            raise ValueError(f"{len(values)} samples from sample {start + 1} on where {count} should be")
        return None, [np.asarray(values), *([] if invalid is None else [np.asarray(invalid, dtype=np.bool_)])]

    def _open(self, path: str) -> dict[str, Any]:
        import asammdf

        mdf: Any = asammdf.MDF(path)
        groups = []
        for number, group in enumerate(mdf.groups):
            cycles, row = group.channel_group.cycles_nr, getattr(group.channel_group, "samples_byte_nr", 1)
            if cycles * max(row, 1) > _MOST_PACKED * os.path.getsize(path):
                raise ValueError(f"group {number} claims {cycles} samples of {row} bytes")
            names = [channel.name for channel in group.channels]
            units = [str(mdf.get_channel_unit(group=number, index=k) or "").strip() for k in range(len(names))]
            master = mdf.masters_db.get(number)
            kind = _TIME if master is None else int(getattr(group.channels[master], "sync_type", _TIME))
            groups.append({"cycles": cycles, "master": master, "kind": kind, "names": names, "units": units})
        self._number += 1
        self._files[self._number] = mdf
        return {"file": self._number, "groups": groups}


def main() -> None:
    """Serve until standard input ends."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what libraries print is no answer
    logging.disable(logging.CRITICAL)
    server = Server()
    for line in sys.stdin.buffer:
        arrays: list[Any] = []
        try:
            value, arrays = server.answer(json.loads(line))
            head: dict[str, Any] = {"value": value}
        except Exception as error:  # asammdf raises whatever its parser stumbles over
            head = {"error": str(error)[:1000], "kind": type(error).__name__}
        plain = [np.ascontiguousarray(one if one.dtype.kind in "iufb" else one[:0].astype("S1")) for one in arrays]
        head["arrays"] = [[one.dtype.str, list(one.shape)] for one in plain]
        answers.write(json.dumps(head).encode() + b"\n")
        for one in plain:
            answers.write(one.tobytes())
        answers.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
