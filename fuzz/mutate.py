"""Damage as it comes: flipped bits, lost and repeated pieces, power cuts, numbers that cannot be."""

from __future__ import annotations

from collections.abc import Callable

from harness import Rng

_NUMBERS = [0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 1 << 40, (1 << 63) - 1, (1 << 64) - 1]
_TEXTS = [
    b"",
    b"nan",
    b"inf",
    b"-",
    b"1e999",
    b",",
    b";",
    b"\n",
    b"\r",
    b'"',
    b"\0",
    b"\xff",
    b"\xef\xbb\xbf",
    b"9" * 400,
]


def _flip(data: bytearray, rng: Rng) -> bytearray:
    for place in rng.integers(len(data), size=rng.integers(1, 9)):
        data[place] ^= 1 << int(rng.integers(8))
    return data


def _replace(data: bytearray, rng: Rng) -> bytearray:
    place, length = int(rng.integers(len(data))), int(rng.integers(1, 17))
    data[place : place + length] = rng.bytes(length)
    return data


def _lose(data: bytearray, rng: Rng) -> bytearray:
    place = int(rng.integers(len(data)))
    del data[place : place + int(rng.integers(1, max(len(data) // 4, 2)))]
    return data


def _repeat(data: bytearray, rng: Rng) -> bytearray:
    place = int(rng.integers(len(data)))
    piece = data[place : place + int(rng.integers(1, max(len(data) // 4, 2)))]
    data[place:place] = piece
    return data


def _cut(data: bytearray, rng: Rng) -> bytearray:
    return data[: int(rng.integers(len(data)))]


def _blank(data: bytearray, rng: Rng) -> bytearray:
    place, length = int(rng.integers(len(data))), int(rng.integers(1, 4096))
    data[place : place + length] = bytes(len(data[place : place + length]))
    return data


def _power_cut(data: bytearray, rng: Rng) -> bytearray:
    place = int(rng.integers(len(data)))
    return data[:place] + bytes(len(data) - place)


def _swap(data: bytearray, rng: Rng) -> bytearray:
    first, second = sorted(int(place) for place in rng.integers(len(data), size=2))
    length = int(rng.integers(1, 65))
    one, other = bytes(data[first : first + length]), bytes(data[second : second + length])
    data[second : second + length] = one
    data[first : first + length] = other
    return data


def _number(data: bytearray, rng: Rng) -> bytearray:
    width = int(rng.choice([1, 2, 4, 8]))
    place = int(rng.integers(max(len(data) - width, 1)))
    value = _NUMBERS[int(rng.integers(len(_NUMBERS)))] & ((1 << 8 * width) - 1)
    data[place : place + width] = value.to_bytes(width, "little")
    return data


def _text(data: bytearray, rng: Rng) -> bytearray:
    place = int(rng.integers(len(data)))
    data[place : place + int(rng.integers(0, 9))] = _TEXTS[int(rng.integers(len(_TEXTS)))]
    return data


def _digits(data: bytearray, rng: Rng) -> bytearray:
    """Other digits in the place of some: the numbers change, the form does not."""
    places = [k for k, letter in enumerate(data) if 0x30 <= letter <= 0x39]
    for _ in range(int(rng.integers(1, 17))):
        if places:
            data[places[int(rng.integers(len(places)))]] = 0x30 + int(rng.integers(10))
    return data


def _lines(data: bytearray, rng: Rng) -> bytearray:
    """Lines that are lost, there twice, or in another order; bytes up to a newline in a file that is no text."""
    lines = bytes(data).split(b"\n")
    for _ in range(int(rng.integers(1, 9))):
        place, other = (int(one) for one in rng.integers(len(lines), size=2))
        kind = int(rng.integers(3))
        if kind == 0 and len(lines) > 1:
            del lines[place]
        elif kind == 1:
            lines.insert(place, lines[place])
        else:
            lines[place], lines[other] = lines[other], lines[place]
    return bytearray(b"\n".join(lines))


KINDS: list[Callable[[bytearray, Rng], bytearray]] = [
    _flip, _flip, _replace, _lose, _repeat, _cut, _blank, _power_cut, _swap, _number, _number, _text,
    _digits, _digits, _lines, _lines,
]  # fmt: skip


def mutated(content: bytes, rng: Rng) -> bytes:
    """A file's content with one to three damages."""
    data = bytearray(content)
    for _ in range(int(rng.choice([1, 1, 1, 2, 3]))):
        if data:
            data = KINDS[int(rng.integers(len(KINDS)))](data, rng)
    return bytes(data)
