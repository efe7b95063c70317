"""CAN frames in BLF files, Vector's binary logging format.

A file is a header and objects, each with its size; most objects are containers, compressed, and what they hold is
objects again, which may go on in the next container.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator
from pathlib import Path
from struct import Struct
from typing import IO

from ramsight.errors import LogError, warn_of_log
from ramsight.logs.frames import EXTENDED, Frame
from ramsight.logs.lines import Advance, file_name
from ramsight.logs.packed import opened

_FILE = Struct("<4sL8xQQL")  # signature, header size, file size, uncompressed size, number of objects
_OBJECT = Struct("<4sHHLL")  # signature, header size, header version, object size, object type
_V1, _V2 = Struct("<LHHQ"), Struct("<LBxHQ8x")  # flags, client or status, object version, time
_CONTAINER = Struct("<H6xL4x")  # method, size of what is inside
_CAN = Struct("<HBBL8s")  # channel, flags, length, identifier, data
_FD = Struct("<HBBLLBBB5x64s")  # channel, flags, length code, identifier, ..., valid bytes, data
_FD64 = Struct("<BBBBLLLLLLLHBBL")  # channel, length code, valid bytes, -, identifier, -, flags, ..., offset, -

_CAN_FRAMES, _FD_FRAME, _FD64_FRAME, _ERROR_FRAMES, _CONTAINERS = (1, 86), 100, 101, (2, 73), 10
_LARGEST = 1 << 26  # bytes of a container
_LARGEST_INSIDE = 1 << 22  # bytes of an object in a container
_REMOTE, _REMOTE_FD64 = 0x80, 0x10


def blf_frames(path: str | Path, advance: Advance | None = None) -> Iterator[Frame]:
    """The frames of a BLF file; time counts from the start of the recording.

    Raises:
        LogError: it is no BLF file, or is damaged; says at which byte.
    """
    file = file_name(path)
    with opened(path) as stored:
        size = os.fstat(stored.fileno()).st_size
        head = stored.read(_FILE.size)
        if len(head) < _FILE.size or not head.startswith(b"LOGG"):
            raise LogError("is no BLF file: it does not begin with LOGG", file=file)
        _, header_size, file_size, _, objects = _FILE.unpack(head)
        if not _FILE.size <= header_size <= size:
            raise LogError(f"is no BLF file: a header of {header_size} bytes in a file of {size}", file=file)
        stored.seek(header_size)
        inside = _Inside(file)
        for place, data, is_whole in _containers(stored, header_size, size, file):
            yield from inside.frames(data, place)
            if advance is not None:
                advance(min(len(data), size) / size if is_whole else 0.0)
        cut = size < file_size or inside.is_cut or inside.objects < objects
        if cut or stored.tell() < size:
            said = f"; {inside.objects} of {objects} objects" if inside.objects < objects else ""
            warn_of_log(
                f"the file breaks off at byte {size}{said}; read {inside.count} frames, up to {inside.time:.6g} s",
                file=file,
            )


def _containers(stored: IO[bytes], place: int, size: int, file: str) -> Iterator[tuple[int, bytes, bool]]:
    """What the containers hold, and objects that stand outside of them; where each begins and whether it is whole."""
    while place + _OBJECT.size <= size:
        stored.seek(place)
        head = stored.read(_OBJECT.size)
        signature, _, _, object_size, kind = _OBJECT.unpack(head)
        if signature != b"LOBJ":
            raise LogError(f"is damaged at byte {place}: no object begins there", file=file)
        if not _OBJECT.size <= object_size <= _LARGEST:
            raise LogError(f"is damaged at byte {place}: an object of {object_size} bytes", file=file)
        body = stored.read(object_size - _OBJECT.size)
        is_whole = len(body) == object_size - _OBJECT.size
        if kind != _CONTAINERS:
            yield place, head + body, is_whole
        elif len(body) >= _CONTAINER.size:
            yield place, _unpacked(body, is_whole, place, file), is_whole
        place += object_size + object_size % 4
    stored.seek(min(place, size))


def _unpacked(body: bytes, is_whole: bool, place: int, file: str) -> bytes:
    method, length = _CONTAINER.unpack_from(body)
    body = body[_CONTAINER.size :]
    if method == 0:
        return body
    if method != 2 or length > _LARGEST:
        what = f"packed by method {method}" if method != 2 else f"with {length} bytes in it"
        raise LogError(f"cannot be read at byte {place}: a container {what}", file=file)
    unpacking = zlib.decompressobj()
    try:
        data = unpacking.decompress(body, max(length, 1))
    except zlib.error:
        data = b""
    if is_whole and (len(data) != length or unpacking.unconsumed_tail):
        raise LogError(f"is damaged at byte {place}: a container that cannot be unpacked", file=file)
    return data


class _Inside:
    """Goes through the objects in containers.

    Attributes:
        count: how many frames.
        time: of the last one [s].
    """

    def __init__(self, file: str) -> None:
        self._file, self._rest = file, b""
        self.objects, self.count, self.time = 0, 0, 0.0

    @property
    def is_cut(self) -> bool:
        """Whether an object has begun that has not ended."""
        return bool(self._rest.strip(b"\0"))

    def frames(self, data: bytes, place: int) -> Iterator[Frame]:
        """The frames in what a container holds; an object without its end waits for the next container."""
        data, position = self._rest + data, 0
        while True:
            begin = data.find(b"LOBJ", position, position + 8)
            if begin < 0 or begin + _OBJECT.size > len(data):
                if begin < 0 and position + 8 <= len(data):
                    raise self._damaged(place, "no object where one should begin")
                break
            _, header_size, version, size, kind = _OBJECT.unpack_from(data, begin)
            if not _OBJECT.size <= size <= _LARGEST_INSIDE:
                raise self._damaged(place, f"an object of {size} bytes")
            if begin + size > len(data):
                position = begin
                break
            self.objects += 1
            frame = self._frame(data[begin : begin + size], header_size, version, kind, place)
            if frame is not None:
                self.count, self.time = self.count + 1, frame.time
                yield frame
            position = begin + size
        self._rest = data[position:]

    def _frame(self, data: bytes, header_size: int, version: int, kind: int, place: int) -> Frame | None:
        begin = _OBJECT.size + (_V1 if version == 1 else _V2).size
        needed = {_FD_FRAME: _FD, _FD64_FRAME: _FD64}.get(kind, _CAN).size
        if version not in (1, 2) or kind not in (*_CAN_FRAMES, *_ERROR_FRAMES, _FD_FRAME, _FD64_FRAME):
            return None
        flags, _, _, ticks = (_V1 if version == 1 else _V2).unpack_from(data.ljust(begin, b"\0"), _OBJECT.size)
        time = ticks * 1e-5 if flags == 1 else ticks * 1e-9
        if kind in _ERROR_FRAMES:
            return Frame(time, 0, 0, None)
        if len(data) < begin + needed:
            raise self._damaged(place, f"a frame of {len(data)} bytes")
        if kind in _CAN_FRAMES:
            channel, how, length, key, content = _CAN.unpack_from(data, begin)
            content = None if how & _REMOTE else content[:length]
        elif kind == _FD_FRAME:
            channel, how, _, key, _, _, _, length, content = _FD.unpack_from(data, begin)
            content = None if how & _REMOTE else content[:length]
        else:
            found = _FD64.unpack_from(data, begin)
            channel, length, key, how, offset = found[0], min(found[2], 64), found[4], found[6], found[13]
            stored = max((offset or len(data)) - header_size - _FD64.size, 0)
            first = begin + _FD64.size
            content = data[first : first + min(length, stored)].ljust(length, b"\0")
            content = None if how & _REMOTE_FD64 else content
        return Frame(time, (key & 0x1FFFFFFF) | (key & EXTENDED), max(channel - 1, 0), content)

    def _damaged(self, place: int, what: str) -> LogError:
        return LogError(
            f"is damaged in the container at byte {place}: {what}, after {self.count} frames", file=self._file
        )
