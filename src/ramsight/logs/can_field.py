"""Numbers out of CAN frames: a field's bits, for many frames at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Array, Bools

Bytes = NDArray[np.uint8]


@dataclass(frozen=True)
class Field:
    """A number in a frame: ``scale * bits + offset``."""

    name: str
    # where its bits are, the most significant first; bit 0 is the highest of byte 0, bit 8 that of byte 1
    bits: tuple[int, ...]
    signed: bool = False  # two's complement
    floating: bool = False  # an IEEE number of 16, 32 or 64 bits
    scale: float = 1.0
    offset: float = 0.0  # in `unit`
    unit: str = ""
    # another field that states whether this one is in the frame, and the values for which it is
    selector: tuple[Field, tuple[int, ...]] | None = None
    reserved: bool = False  # whether the highest values mean "not available" where it is unsigned, as in J1939

    @property
    def length(self) -> int:
        """Bytes that a frame needs to hold it."""
        own = max(self.bits) // 8 + 1
        return own if self.selector is None else max(own, self.selector[0].length)

    def raw(self, frames: Bytes) -> NDArray[np.generic]:
        """The bits as whole numbers, or as the IEEE numbers that they are.

        Args:
            frames: shape (frames, bytes), with `length` bytes at least.
        """
        width = 64 if not self.floating else len(self.bits)
        spread = np.zeros((len(frames), width), dtype=np.uint8)
        spread[:, width - len(self.bits) :] = np.unpackbits(frames, axis=1)[:, list(self.bits)]
        packed = np.packbits(spread, axis=1)
        if self.floating:
            return packed.view(f">f{width // 8}")[:, 0]
        whole = packed.view(">u8")[:, 0]
        if not self.signed:
            return whole
        missing = 64 - len(self.bits)  # so many bits up and down again carry the sign
        return (whole.astype(np.uint64) << np.uint64(missing)).view(np.int64) >> np.int64(missing)

    def values(self, frames: Bytes) -> Array:
        """The numbers in `unit`, NaN where a reserved one stands.

        Args:
            frames: shape (frames, bytes), with `length` bytes at least.

        Example:
            >>> speed = Field("speed", little_endian(8, 16), signed=True, scale=0.5)
            >>> speed.values(np.array([[0, 0xFE, 0xFF]], dtype=np.uint8)).tolist()
            [-1.0]
        """
        bits = self.raw(frames)
        numbers = bits.astype(np.float64) * self.scale + self.offset
        if self.reserved and len(self.bits) >= 8 and not self.floating and not self.signed:
            top = self.raw(frames).astype(np.uint64) >> np.uint64(len(self.bits) - 8)
            numbers[(top & np.uint64(0xFF)) > 0xFA] = np.nan
        numbers[~np.isfinite(numbers)] = np.nan
        return numbers

    def present(self, frames: Bytes) -> Bools:
        """In which frames it is, by its selector."""
        if self.selector is None:
            return np.ones(len(frames), dtype=np.bool_)
        field, wanted = self.selector
        return field.present(frames) & np.isin(field.raw(frames).astype(np.int64), wanted)


def little_endian(start: int, length: int) -> tuple[int, ...]:
    """Bits of a field whose lowest bit is bit `start`, counted from the lowest of byte 0.

    Example:
        >>> little_endian(0, 8)
        (0, 1, 2, 3, 4, 5, 6, 7)
    """
    return tuple(bit // 8 * 8 + 7 - bit % 8 for bit in reversed(range(start, start + length)))


def big_endian(start: int, length: int) -> tuple[int, ...]:
    """Bits of a field whose highest bit is bit `start` in the numbering of a DBC file.

    Example:
        >>> big_endian(7, 8)
        (0, 1, 2, 3, 4, 5, 6, 7)
    """
    first = start // 8 * 8 + 7 - start % 8
    return tuple(range(first, first + length))
