"""The position as a J1939 message: bytes, beat, errors, and the encoder unchanged beside it."""

import math
import re
import struct
from pathlib import Path

import cantools
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ramsight import machine
from ramsight.deploy.encoder.encoder import Encoder, Settings
from ramsight.deploy.encoder.frame import EXTENDED, Frame
from ramsight.deploy.encoder.j1939 import Broadcasting, Message, message_of
from ramsight.deploy.encoder.listening import Listener, drive_map
from ramsight.errors import DescriptionError
from ramsight.logs.can_field import Field, little_endian
from ramsight.plant.build import build
from ramsight.sensor.kalman import kalman
from ramsight.sensor.status import Status

BOOM = build(machine.load_machine("mining-loader").unit("boom"), "boom")
DATA = struct.Struct("<HHBBH")


def encoder():
    return Encoder(kalman(BOOM), BOOM, Listener(drive_map(5, rated_torque=35.0)), Settings(node_id=6, drive_node=5))


@given(st.floats(0.0, 6.0), st.floats(-3.0, 3.0), st.floats(0.0, 0.5), st.booleans(), st.booleans())
def test_what_is_sent_reads_back(position, velocity, std, warns, referenced):
    data = Message().data(position, velocity, std, 0, valid=True, warns=warns, referenced=referenced)
    place, speed, flags, status, deviation = DATA.unpack(data)
    assert place * 1e-4 == pytest.approx(position, abs=0.51e-4)
    assert speed * 1e-4 - 3.2 == pytest.approx(velocity, abs=0.51e-4)
    assert deviation * 1e-5 == pytest.approx(std, abs=0.51e-5)
    assert status == 0
    assert flags == 0b00000101 | warns << 4 | referenced << 6


PAGE = (Path(__file__).parents[1] / "docs" / "reference" / "encoder.md").read_text(encoding="utf-8")


def test_the_frame_and_the_dbc_file_of_the_page_are_those_that_are_sent():
    message = Message()
    data = message.data(0.3482, -0.0215, 1.2e-3, 0, valid=True, warns=False, referenced=True)
    assert f"`{message.identifier:X}h  {data.hex(' ').upper()}` says 348.2 mm, −21.5 mm/s" in PAGE
    ((text,),) = [re.findall(r"<!-- j1939 -->\n\n```\n(.*?)```", PAGE, flags=re.DOTALL)]
    described = cantools.database.load_string(text, "dbc")
    said = described.decode_message(message.identifier, data)
    assert said == pytest.approx({
        "Position": 348.2, "Velocity": -21.5, "Valid": 1, "Known": 1, "Warning": 0, "Referenced": 1, "Status": 0,
        "StandardDeviation": 1.2,
    })  # fmt: skip
    unknown = message.data(
        math.nan, 0.0, math.inf, int(Status.NOT_REFERENCED), valid=False, warns=True, referenced=False
    )
    said = described.decode_message(message.identifier, unknown)
    top = {signal.name: signal.maximum for signal in described.messages[0].signals}
    assert said["Position"] > top["Position"], "no number that could be a position"
    assert said["StandardDeviation"] > top["StandardDeviation"]
    assert (said["Valid"], said["Known"], said["Warning"], said["Status"]) == (0, 0, 1, int(Status.NOT_REFERENCED))


def test_what_is_not_known_is_never_a_number():
    data = Message().data(
        math.nan, math.nan, math.inf, int(Status.NOT_REFERENCED), valid=False, warns=True, referenced=False
    )
    place, speed, flags, status, deviation = DATA.unpack(data)
    assert 0xFE00 <= place <= 0xFEFF, "an error, by SAE J1939-71"
    assert speed == deviation == 0xFFFF
    assert flags & 0b1111 == 0
    assert status == Status.NOT_REFERENCED


def test_the_largest_number_is_the_last_below_the_reserved_ones():
    data = Message().data(1e3, 1e3, 1e3, 0, valid=True, warns=False, referenced=True)
    assert DATA.unpack(data)[::2] == (0xFAFF, 0b01000101, 0xFAFF)
    assert DATA.unpack(data)[1] == 0xFAFF
    data = Message().data(-1.0, -1e3, 0.0, 0, valid=True, warns=False, referenced=False)
    assert DATA.unpack(data) == (0, 0, 0b00000101, 0, 0)


@pytest.mark.parametrize(
    ("length", "valid", "reserved"),
    [(8, [0, 0xFA], [0xFB, 0xFD, 0xFE, 0xFF]), (16, [0, 0xFAFF], [0xFB00, 0xFDFF, 0xFE00, 0xFFFF])],
)
def test_reserved_numbers_of_a_log_are_none(length, valid, reserved):
    field = Field("speed", little_endian(0, length), reserved=True)
    frames = np.array([list(number.to_bytes(2, "little")) for number in (*valid, *reserved)], dtype=np.uint8)
    np.testing.assert_array_equal(field.values(frames), [*valid, *[np.nan] * len(reserved)])
    plain = Field("speed", little_endian(0, length))
    np.testing.assert_array_equal(plain.values(frames), [*valid, *reserved])


@pytest.mark.parametrize(
    "wrong", [{"pgn": 0xFEFF}, {"source": 254}, {"priority": 8}, {"period": 1e-3}, {"resolution": 0.1}]
)
def test_what_cannot_be_sent_is_refused(wrong):
    with pytest.raises(DescriptionError, match=next(iter(wrong))):
        Message(**wrong)


def test_words_of_the_command_line():
    assert message_of("FF40 21", "100 ms") == Message(0xFF40, 0x21, period=0.1)
    for words in ("FF40h", "position", "FF40h 80h 1"):
        with pytest.raises(DescriptionError, match="--j1939"):
            message_of(words, "20 ms")


def test_a_resolution_that_the_stroke_does_not_fit_into_is_refused():
    with pytest.raises(DescriptionError, match="resolution"):
        Broadcasting(encoder(), Message(resolution=1e-6))


def test_it_is_sent_on_its_beat_beside_what_the_encoder_sends():
    alone, both = encoder(), Broadcasting(encoder(), Message(period=0.05))
    assert both.start(0.0) == alone.start(0.0)
    wide, others, plain = [], [], []
    for k in range(1, 200):
        now = 0.01 * k
        frames = [*both.advance(now)]
        plain += alone.advance(now)
        if k % 2 == 0:
            drive = Frame(0x185, struct.pack("<ih", 600, 100), now)
            frames += both.receive(now, drive)
            plain += alone.receive(now, drive)
        wide += [(now, frame) for frame in frames if frame.cob_id & EXTENDED]
        others += [frame for frame in frames if not frame.cob_id & EXTENDED]
    assert others == plain
    assert len(wide) == pytest.approx(199 * 0.01 / 0.05, abs=1.0)
    assert all(frame.cob_id == 0x18FF4080 | EXTENDED and len(frame.data) == 8 for _, frame in wide)
    assert both.due <= wide[-1][0] + 0.05 + 1e-9
    place, speed, *_ = DATA.unpack(wide[-1][1].data)
    assert place >= 0xFE00, "nobody has told where the piston is"
    assert speed * 1e-4 - 3.2 > 0.0
    late = [frame for _ in range(2) for frame in both.advance(10.0) if frame.cob_id & EXTENDED]
    assert len(late) == 1, "what was missed is not made up for"
    both.stop()
