"""The canopen library's local node, on a bus that is a list: SDO, NMT and emergencies are its, time is not."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

from ramsight.deploy.encoder.frame import Frame
from ramsight.deploy.encoder.objects import BITS, ENTRIES, object_dictionary
from ramsight.optional import needing

with needing("can"):
    import canopen
    from canopen.objectdictionary import ODVariable
    from canopen.sdo.exceptions import SdoAbortedError
    from canopen.sdo.server import SdoServer

STOPPED, OPERATIONAL, PRE_OPERATIONAL = 4, 5, 127
RESET_NODE, RESET_COMMUNICATION = 129, 130
COMMANDS = (1, 2, 128, RESET_NODE, RESET_COMMUNICATION)

READ_ONLY, NO_SUBINDEX = 0x0601_0002, 0x0609_0011
NOT_MAPPABLE, TOO_LONG, TOO_MUCH = 0x0604_0041, 0x0604_0042, 0x0607_0012
INVALID, TOO_HIGH, TOO_LOW = 0x0609_0030, 0x0609_0031, 0x0609_0032
NOT_STORED, BY_STATE, COMMAND = 0x0800_0020, 0x0800_0022, 0x0504_0001
"""Abort codes of CiA 301."""

_LONGEST = 64  # bytes that a segmented write may bring; no object here is longer
_UNSIZED = 0x02  # of the two lowest bits: expedited, without a size
_DOWNLOAD, _SEGMENT, _UPLOAD_SEGMENT, _ABORTED = 1, 0, 3, 4


class _NoTask:
    """Stands for canopen's own heartbeat task: the encoder has a schedule."""

    def stop(self) -> None:
        """Do nothing: there is no task."""

    def update(self, data: bytes) -> None:
        """Do nothing: there is no task."""


class Wire(canopen.Network):
    """A network that hands its frames to whoever asks, and has no threads."""

    def __init__(self) -> None:
        super().__init__()
        self.sent: list[Frame] = []

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        """Keep a frame."""
        self.sent.append(Frame(can_id, bytes(data)))

    def send_periodic(self, can_id: int, data: bytes, period: float, remote: bool = False) -> Any:
        """No task: periodic frames are the encoder's."""
        return _NoTask()


class _Server(SdoServer):
    """An SDO server that survives whatever is sent to it."""

    def on_request(self, can_id: int, data: bytes, timestamp: float) -> None:
        """Answer a request, or abort it; one that continues no transfer is aborted as unknown."""
        kind = data[0] >> 5
        _, index, subindex = struct.unpack_from("<BHB", data)
        if kind == _ABORTED:
            self._buffer = None
            return
        if kind in (_SEGMENT, _UPLOAD_SEGMENT):
            if self._buffer is None:
                self._send_abort(0, 0, COMMAND)
                return
            if kind == _SEGMENT and len(self._buffer) > _LONGEST:
                self._buffer = None
                self._send_abort(self._index or 0, self._subindex or 0, TOO_MUCH)
                return
        else:
            self._index, self._subindex, self._buffer = index, subindex, None
        if kind == _DOWNLOAD and not data[0] & 0x02:
            reason = self._refusal(index, subindex)
            if reason:
                self._send_abort(index, subindex, reason)
                return
        super().on_request(can_id, self._sized(data) if kind == _DOWNLOAD else data, timestamp)

    def _sized(self, data: bytes) -> bytes:
        """An expedited write that does not say how long its data are: as long as the object's."""
        if data[0] & 0x03 != _UNSIZED:
            return data
        _, index, subindex = struct.unpack_from("<BHB", data)
        entry = ENTRIES.get((index, subindex))
        if entry is None or entry.type not in BITS:
            return data
        unused = 4 - BITS[entry.type] // 8
        return bytes([data[0] & 0xE0 | unused << 2 | 0x03]) + bytes(data[1:])

    def _refusal(self, index: int, subindex: int) -> int:
        """Why a segmented write cannot end well; 0 if it can."""
        try:
            entry: ODVariable = self._node._find_object(index, subindex)
        except SdoAbortedError as error:
            return int(error.code)
        return 0 if entry.writable else READ_ONLY

    def _send_abort(self, index: int, subindex: int, code: int) -> None:
        self.send_response(struct.pack("<BHBL", 0x80, index, subindex, code))


Read = Callable[[int, int], "int | str | None"]
Write = Callable[[int, int, int], None]


class Node:
    """A local node with its dictionary.

    Args:
        node_id: 1 to 127.
        read: the present value of an entry, None where the stored one is right.
        write: takes a value before it is stored; refuses it by `refuse`.
    """

    def __init__(self, node_id: int, read: Read, write: Write) -> None:
        self.id, self.wire = node_id, Wire()
        self._local = canopen.LocalNode(node_id, object_dictionary(node_id))
        self._local.sdo = _Server(0x600 + node_id, 0x580 + node_id, self._local)
        self._read, self._write = read, write
        self._local.add_read_callback(self._on_read)
        self._local.add_write_callback(self._on_write)
        self.wire[node_id] = self._local

    @property
    def state(self) -> int:
        """NMT state: 0, `STOPPED`, `OPERATIONAL` or `PRE_OPERATIONAL`."""
        return int(self._local.nmt._state)

    def boot(self) -> None:
        """Say that the node is there, and become pre-operational."""
        self._local.nmt.send_command(RESET_NODE)
        self._local.nmt.send_command(128)

    def command(self, data: bytes) -> int:
        """Take an NMT command; states which one it was, 0 if it was none for this node."""
        if len(data) != 2 or data[0] not in COMMANDS or data[1] not in (0, self.id):
            return 0
        self.wire.notify(0, bytearray(data), 0.0)
        return data[0]

    def request(self, data: bytes) -> None:
        """Answer an SDO request of 8 bytes."""
        self.wire.notify(0x600 + self.id, bytearray(data), 0.0)

    def emergency(self, code: int, register: int, data: bytes) -> None:
        """Send an emergency; code 0 takes errors back."""
        self._local.emcy.send(code, register, data)

    def get(self, index: int, subindex: int = 0) -> int:
        """A value of the dictionary."""
        value = self._entry(index, subindex).decode_raw(self._local.get_data(index, subindex))
        return int(value)

    def data(self, index: int, subindex: int = 0) -> bytes:
        """The bytes of a value of the dictionary."""
        return bytes(self._local.get_data(index, subindex))

    def set(self, index: int, subindex: int, value: int) -> None:
        """Set a value from inside, without checks."""
        self._local.data_store.setdefault(index, {})[subindex] = self._entry(index, subindex).encode_raw(value)

    def forget(self, index: int) -> None:
        """Let an object's values be its defaults."""
        self._local.data_store.pop(index, None)

    def _entry(self, index: int, subindex: int) -> ODVariable:
        entry: ODVariable = self._local._find_object(index, subindex)
        return entry

    def _on_read(self, index: int, subindex: int, od: ODVariable) -> int | str | None:
        _check_declared(index, subindex)
        return self._read(index, subindex)

    def _on_write(self, index: int, subindex: int, od: ODVariable, data: bytes) -> None:
        _check_declared(index, subindex)
        value = int(od.decode_raw(bytes(data)))
        if od.min is not None and value < od.min:
            refuse(TOO_LOW)
        if od.max is not None and value > od.max:
            refuse(TOO_HIGH)
        self._write(index, subindex, value)


def _check_declared(index: int, subindex: int) -> None:
    """Reject what canopen makes up: to it an array has 255 entries."""
    if (index, subindex) not in ENTRIES:
        refuse(NO_SUBINDEX)


def refuse(code: int) -> None:
    """Abort the SDO transfer that is being served.

    Raises:
        SdoAbortedError: always.
    """
    raise SdoAbortedError(code)
