"""The encoder as a client sees it that knows CiA 406 and nothing else, on a bus without time of its own."""

import errno
import json
import math
import os
import re
import struct
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from canopen import SdoAbortedError
from canopen.sdo.base import SdoVariable
from hypothesis import given
from hypothesis import strategies as st

from ramsight import machine
from ramsight.deploy.encoder import Frame, Settings, encoder_for
from ramsight.deploy.encoder.alarms import OF_STATUS, Fault
from ramsight.deploy.encoder.bus_clock import BusClock
from ramsight.deploy.encoder.listening import Listener, _Channel, drive_map
from ramsight.deploy.encoder.objects import (
    BITS,
    ENTRIES,
    FORGET,
    LOAD,
    OBJECTS,
    RUNNING,
    SAVE,
    STORED,
    eds_text,
    object_dictionary,
)
from ramsight.deploy.encoder.parameters import ParameterFile
from ramsight.errors import DescriptionError, UnknownNameError
from ramsight.logs import read_log, read_truth
from ramsight.logs.mapped import Mapped
from ramsight.output import HeldError
from ramsight.plant.ddh import build_ddh
from ramsight.sensor.kalman import kalman
from ramsight.sensor.persistence import StateFile
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import BRIDGED_GAP, USUAL_PERIOD

from .encoder_bus import (
    COLD,
    DRIVE,
    DUE,
    EDS,
    FAULT,
    NODE,
    NOT_REFERENCED,
    PE,
    WARM,
    WATCHDOG,
    Master,
    boom,
    bus_map,
    encoder,
    lose_power,
    played,
    sample,
    usual_map,
)

ROOT = Path(__file__).parent.parent
STEP = 1e-5  # m, of 6004h by default


@pytest.fixture
def master():
    """Booted, warm, operational, at rest, not referenced."""
    bus = Master(encoder())
    bus.node.sdo[0x2100].raw = 400
    bus.node.nmt.state = "OPERATIONAL"
    bus.rest(0.2)
    return bus


SWITCH = '[[reference]]\nchannel = "2020h"\nposition = "300 mm"\n'


def abort_of(action) -> int:
    with pytest.raises(SdoAbortedError) as refused:
        action()
    return refused.value.code


def write(bus, index, value, subindex=0):
    """As a client does that knows the rules: parameters are written while the node is pre-operational."""
    if (index, subindex) in STORED and index not in RUNNING:
        with bus.configuring():
            write_now(bus, index, value, subindex)
    else:
        write_now(bus, index, value, subindex)


def write_now(bus, index, value, subindex=0):
    entry = bus.node.sdo[index]
    (entry if isinstance(entry, SdoVariable) else entry[subindex]).raw = value


# ---- the dictionary ----------------------------------------------------------------------------------------------


def test_the_shipped_eds_is_the_declared_dictionary():
    assert EDS.read_text(encoding="ascii") == eds_text(), "write it anew: ramsight encoder ... --eds"


def test_defaults_stand_in_hexadecimal_as_wide_as_their_type():
    section = ""
    for line in eds_text().splitlines():
        if line.startswith("["):
            section = line.strip("[]")
        if line.startswith("DefaultValue=") and "NODEID" not in line:
            index, _, subindex = section.partition("sub")
            entry = ENTRIES[int(index, 16), int(subindex or "0", 16)]
            value = line.partition("=")[2]
            if entry.type in BITS and entry.default >= 0:
                assert re.fullmatch(rf"0x[0-9A-F]{{{BITS[entry.type] // 4}}}", value), line
            assert value == str(entry.default) or int(value, 16) == entry.default


def test_canopen_imports_every_declared_entry():
    dictionary = object_dictionary(NODE)
    for one in OBJECTS:
        for entry in one.entries:
            found = dictionary.get_variable(one.index, entry.subindex)
            assert found is not None
            assert (found.name, found.access_type, found.pdo_mappable) == (entry.name, entry.access, entry.mappable)
            of_node = str(entry.default).startswith("$NODEID+")
            default = NODE + int(str(entry.default).removeprefix("$NODEID+"), 0) if of_node else entry.default
            assert found.default == default
            assert (found.min, found.max) == (entry.low, entry.high)


def test_a_client_reads_every_readable_entry(master):
    for (index, subindex), entry in ENTRIES.items():
        if entry.access != "wo":
            assert master.node.sdo.upload(index, subindex)


def test_it_says_that_it_is_a_linear_encoder(master):
    sdo = master.node.sdo
    assert sdo[0x1000].raw & 0xFFFF == 406
    assert sdo[0x1000].raw >> 16 == 8
    assert sdo[0x1008].raw == "ramsight encoder"
    assert sdo[0x1018][4].raw == sdo[0x650B].raw == 4711
    assert sdo[0x6002].raw == round(boom().cylinder.stroke / STEP)
    assert sdo[0x650A][3].raw == sdo[0x6002].raw
    assert sdo[0x6504].raw == 0x7001
    assert sdo[0x6506].raw == 0xF025


@pytest.mark.parametrize(
    ("action", "code"),
    [
        (lambda bus: bus.node.sdo.upload(0x6001, 0), 0x06020000),
        (lambda bus: bus.node.sdo.upload(0x6005, 9), 0x06090011),
        (lambda bus: bus.node.sdo.upload(0x2003, 0), 0x06010001),
        (lambda bus: bus.node.sdo.download(0x6004, 0, bytes(4)), 0x06010002),
        (lambda bus: bus.node.sdo.download(0x6004, 0, bytes(12)), 0x06010002),
        (lambda bus: bus.node.sdo.download(0x6200, 0, bytes(4)), 0x06070010),
        (lambda bus: write(bus, 0x6005, 999, 1), 0x06090032),
        (lambda bus: write(bus, 0x2002, 10001), 0x06090031),
        (lambda bus: write(bus, 0x6000, 1), 0x06090030),
        (lambda bus: write(bus, 0x1800, 241, 2), 0x06090030),
        (lambda bus: write(bus, 0x1800, 0x20000186, 1), 0x06090030),
        (lambda bus: write(bus, 0x1800, 0x186 + 1, 1), 0x06090030),
        (lambda bus: write(bus, 0x1A00, 0), 0x06090030),
        (lambda bus: write(bus, 0x1003, 1), 0x06090030),
        (lambda bus: write(bus, 0x1016, (9 << 16) | 100, 1), 0x06090030),
        (lambda bus: write(bus, 0x2003, 1), 0x08000020),
        (lambda bus: write(bus, 0x1010, SAVE, 1), 0x08000020),  # nowhere to store
        (lambda bus: write(bus, 0x6003, 70001), 0x06090030),  # outside the stroke
        (lambda bus: write(bus, 0x6003, -1), 0x06090030),
    ],
)  # fmt: skip
def test_what_cannot_be_is_aborted_with_the_standards_code(master, action, code):
    assert abort_of(lambda: action(master)) == code


def test_parameters_stay_while_the_machine_runs(master):
    write(master, 0x6003, 10000)
    for key in STORED:
        if key[0] not in RUNNING:
            value = master.node.sdo.upload(*key)
            assert abort_of(lambda key=key, value=value: master.node.sdo.download(*key, value)) == 0x08000022
    assert master.position == 10000
    write_now(master, 0x6401, 100, 1)  # the work area's limits are no parameters
    write_now(master, 0x6402, 200, 1)


def test_a_pdo_takes_no_identifier_of_others(master):
    services = (0x000, 0x080, 0x080 + NODE, 0x100, 0x180, 0x600 + NODE, 0x580 + NODE, 0x700 + NODE, 0x7FF)
    with master.configuring():
        write_now(master, 0x1800, 0xC0000186, 1)
        for other in (*services, 0x180 + DRIVE, 0x200 + DRIVE, 0x500 + DRIVE, 0x280 + NODE):
            assert abort_of(lambda other=other: write_now(master, 0x1800, 0x40000000 | other, 1)) == 0x06090030
        write_now(master, 0x1800, 0x40000186 + 3, 1)


@pytest.mark.parametrize(
    ("index", "code", "refused", "taken"),
    [
        (
            0x2001, 0x06090030, (0, -1, 10000, 70000, 700_000, -700_000, 1_400_000),
            (FAULT, -(1 << 31), 1_400_001, -700_001),
        ),
        (0x1017, 0x06090032, (1, 9), (0, 10, 65535)),
    ],
    ids=["a fault value is no position", "a heartbeat is no flood"],
)  # fmt: skip
def test_values_of_an_object_that_are_refused_and_taken(master, index, code, refused, taken):
    for value in refused:
        assert abort_of(lambda value=value: write(master, index, value)) == code
    for value in taken:
        write(master, index, value)


@pytest.mark.parametrize(
    ("request_bytes", "key", "value"),
    [("2217100064000000", (0x1017, 0), 100), ("220020000000FFFF", (0x2000, 0), 0),
     ("2205600140420F00", (0x6005, 1), 1_000_000), ("22016401A0860100", (0x6401, 1), 100_000)],
)  # fmt: skip
def test_a_write_that_does_not_say_its_size_has_the_objects(master, request_bytes, key, value):
    with master.configuring():
        master.send_message(0x600 + NODE, bytes.fromhex(request_bytes))
        assert master.seen[-1][1].data[0] == 0x60
        assert int.from_bytes(master.node.sdo.upload(*key), "little") == value


def test_block_transfers_and_lost_segments_are_aborted(master):
    for request, code in (("C600600000000000", 0x05040001), ("6000000000000000", 0x05040001),
                          ("0000000000000000", 0x05040001), ("E000000000000000", 0x05040001)):  # fmt: skip
        master.send_message(0x600 + NODE, bytes.fromhex(request))
        assert struct.unpack("<BHBL", master.seen[-1][1].data)[3] == code
    master.send_message(0x600 + NODE, b"\x40\x00")  # too short to be a request
    assert master.seen[-1][1].data[0] == 0x80


# ---- positions ---------------------------------------------------------------------------------------------------


def test_a_preset_is_a_reference(master):
    assert (master.position, master.alarms, master.warnings) == (FAULT, PE, NOT_REFERENCED)
    write(master, 0x6003, 10000)
    assert (master.position, master.alarms, master.warnings) == (10000, 0, 0)
    assert master.node.sdo[0x6003].raw == 10000
    assert master.node.sdo[0x2010].raw * STEP < 4e-3, "at rest a load may change unseen"
    assert master.node.sdo[0x2014].raw > master.node.sdo[0x2010].raw
    assert master.node.sdo[0x2015].raw == 1


def test_the_load_has_its_deviation_and_its_age(master):
    master.rest(0.5)
    load, std, age = (master.node.sdo[one].raw for one in (0x2013, 0x2016, 0x2017))
    estimate, says = master.device._estimate, master.device._sensor.says
    assert load == pytest.approx(estimate.load, abs=1.0)
    assert std == pytest.approx(says("load_std"), abs=1.0)
    assert 0 < std < 0xFFFF_FFFF
    assert age == pytest.approx(1e3 * says("load_age"), abs=1.0)
    assert age > 0


def test_a_preset_that_contradicts_is_refused_and_told_until_the_position_is_forgotten(master):
    write(master, 0x6003, 10000)
    master.rest(0.1)
    assert abort_of(lambda: write(master, 0x6003, 40000)) == 0x08000022
    master.rest(0.1)
    assert master.alarms & PE
    assert master.position == FAULT
    assert 0xFF02 in master.emergencies()
    assert abort_of(lambda: write(master, 0x6003, 40000)) == 0x08000022
    write(master, 0x2003, FORGET)
    assert (master.alarms, master.warnings) == (PE, NOT_REFERENCED)
    write(master, 0x6003, 40000)
    master.rest(0.1)
    assert (master.position, master.alarms) == (40000, 0)
    assert master.emergencies()[-1] == 0


def test_a_preset_needs_a_drive_that_reports(master):
    master.pass_time(master.now + 0.2)
    assert abort_of(lambda: write(master, 0x6003, 10000)) == 0x08000022


def test_steps_and_direction_are_the_clients(master):
    write(master, 0x6003, 10000)
    write(master, 0x6005, 100_000, 1)  # 0.1 mm
    assert (master.position, master.node.sdo[0x6002].raw) == (1000, 7000)
    write(master, 0x6000, 0x000C)
    assert (master.position, master.node.sdo[0x6500].raw) == (6000, 0x000C)
    write(master, 0x6000, 0)
    assert master.position == pytest.approx(100_000, abs=5)  # 6501h: 1 µm
    write(master, 0x6401, 200_000, 1)
    assert master.node.sdo[0x6400][1].raw == 0b101
    write(master, 0x6401, 0, 1)
    write(master, 0x6402, 90_000, 1)
    assert master.node.sdo[0x6400][1].raw == 0b011


def test_an_invalid_position_is_a_fault_value_or_held(master):
    write(master, 0x6003, 10000)
    write(master, 0x2001, -(1 << 31))
    master.pass_time(master.now + 0.2)
    assert (master.alarms, master.warnings, master.position) == (PE, WATCHDOG, -(1 << 31))
    assert master.node.sdo[0x6030][1].raw == 0x7FFF
    write(master, 0x2000, 0)
    assert (master.position, master.node.sdo[0x6030][1].raw) == (10000, 0)


def test_it_follows_the_piston_of_another_simulator(trace):
    case = trace("boom_441kN_40C")
    truth = read_truth(case.truth)
    bus = Master(encoder())
    bus.node.nmt.state = "OPERATIONAL"
    frames = list(played(read_log(case.log)))
    bus.play(frames[:10])
    write(bus, 0x2100, 400)
    write(bus, 0x6003, 10000)
    bus.play(frames[10:])
    times, values = zip(*bus.sent(0x180 + NODE, since=0.2), strict=True)
    positions = STEP * np.array([struct.unpack("<i", data)[0] for data in values])
    lag = 0.01  # TPDOs fall between samples
    error = positions - np.interp(np.array(times) - lag, truth["time"], truth["position"])
    assert len(times) > 2500
    assert np.abs(error).max() < 1.5e-3
    speeds = np.abs(np.diff(positions)).max()
    assert speeds <= 1.1 * boom().max_velocity * 0.021 + STEP


# ---- time --------------------------------------------------------------------------------------------------------


def test_pdos_and_heartbeat_keep_to_their_grid_whatever_comes_between(master):
    write(master, 0x1017, 50)
    begin = master.now
    random = np.random.default_rng(1)
    while master.now < begin + 5.0:
        master.put(master.now + random.uniform(0.0, 0.03), sample(0, 20.0 + random.normal()))
    for cob_id, period in ((0x180 + NODE, 0.01), (0x700 + NODE, 0.05)):
        times = np.array([at for at, _ in master.sent(cob_id, since=begin + 0.05)])
        grid = times[0] + period * np.arange(len(times))
        assert np.abs(times - grid).max() < 1e-9


def test_a_stalled_encoder_sends_once_and_returns_to_its_grid(master):
    due = master.device.due
    master.now = due + 0.055
    frames = master.device.advance(master.now)
    assert sum(frame.cob_id == 0x180 + NODE for frame in frames) == 1
    assert (master.device.due - due) % 0.01 == pytest.approx(0.0, abs=1e-6) or master.device.due < due + 0.06


def test_the_cyclic_timer_is_the_event_timer(master):
    write(master, 0x6200, 25)
    assert master.node.sdo[0x1800][5].raw == 25
    write(master, 0x1800, 40, 5)
    assert master.node.sdo[0x6200].raw == 40
    begin = master.now
    master.pass_time(begin + 0.2)
    times = [at - begin for at, _ in master.sent(0x180 + NODE, since=begin + 1e-6)]
    assert times == pytest.approx([0.04, 0.08, 0.12, 0.16, 0.2], abs=1e-9)
    write(master, 0x6200, 0)
    begin = master.now + 1e-3
    master.pass_time(begin + 0.2)
    assert master.sent(0x180 + NODE, since=begin) == []


def test_sync_brings_the_second_pdo(master):
    before = len(master.sent(0x280 + NODE))
    master.send_message(0x80, b"")
    assert len(master.sent(0x280 + NODE)) == before + 1
    write(master, 0x1801, 3, 2)
    for _ in range(6):
        master.send_message(0x80, b"")
    assert len(master.sent(0x280 + NODE)) == before + 3
    write(master, 0x1801, 0, 2)
    for _ in range(3):
        master.send_message(0x80, b"")
    assert len(master.sent(0x280 + NODE)) == before + 4  # only what has changed


def test_a_client_maps_what_it_likes_into_a_pdo(master):
    pdo = master.node.tpdo[1]
    master.node.tpdo.read()
    pdo.clear()
    for name in ("Position value", "Alarms", "Warnings"):
        pdo.add_variable(name)
    pdo.event_timer = 20
    pdo.enabled = True
    with master.configuring():
        master.node.tpdo.save()
    begin = master.now
    master.pass_time(begin + 0.05)
    assert [len(data) for _, data in master.sent(0x180 + NODE, since=begin + 1e-6)] == [8, 8]
    assert pdo["Alarms"].raw == PE
    assert pdo["Warnings"].raw == NOT_REFERENCED


@pytest.mark.parametrize(
    ("mapped", "code"), [((0x6003_0020,), 0x06040041), ((0x6004_0010,), 0x06040041), ((0x6004_0020,) * 3, 0x06040042)]
)
def test_mappings_that_cannot_be_are_refused(master, mapped, code):
    sdo = master.node.sdo
    master.node.nmt.state = "PRE-OPERATIONAL"
    sdo[0x1801][1].raw = 0xC0000286
    sdo[0x1A01][0].raw = 0

    def put():
        for k, one in enumerate(mapped, 1):
            sdo[0x1A01][k].raw = one
        sdo[0x1A01][0].raw = len(mapped)

    assert abort_of(put) == code


# ---- the network -------------------------------------------------------------------------------------------------


def test_it_boots_and_obeys_the_network_management():
    bus = Master(encoder())
    assert str(bus.seen[0][1]) == "706#00"
    bus.pass_time(2.5)
    assert [data for _, data in bus.sent(0x706)] == [b"\0", b"\x7f", b"\x7f"]
    assert bus.sent(0x186) == []
    bus.node.nmt.state = "OPERATIONAL"
    bus.pass_time(3.5)
    assert bus.sent(0x706)[-1][1] == b"\x05"
    assert len(bus.sent(0x186)) == 101
    bus.node.nmt.state = "STOPPED"
    count = len(bus.seen)
    bus.send_message(0x606, bytes.fromhex("4000100000000000"))
    bus.send_message(0x80, b"")
    bus.pass_time(4.5)
    assert [str(frame) for _, frame in bus.seen[count:]] == ["706#04"]
    bus.send_message(0, bytes([129, 9]))  # for somebody else
    bus.send_message(0, bytes([99, NODE]))
    bus.send_message(0, bytes([1]))
    assert len(bus.seen) == count + 1
    bus.node.nmt.state = "RESET"
    assert str(bus.seen[count + 1][1]) == "706#00"
    bus.node.nmt.state = "RESET COMMUNICATION"
    assert len(bus.sent(0x706)) == 7


def test_a_reset_keeps_the_position(master):
    write(master, 0x6003, 10000)
    write(master, 0x6200, 50)
    master.node.nmt.state = "RESET"
    assert master.position == 10000
    assert master.node.sdo[0x6200].raw == 10


# ---- faults ------------------------------------------------------------------------------------------------------


def test_every_status_of_the_sensor_has_its_fault():
    assert set(OF_STATUS) == set(Status) - {Status.OK}
    for status, fault in OF_STATUS.items():
        if status.validity != "uncertain":
            assert fault.alarm, "what the sensor calls invalid is invalid"


def test_a_lost_drive_is_told_within_two_cycles_of_its_timeout(master):
    write(master, 0x6003, 10000)
    master.rest(0.1)
    last = master.now
    master.pass_time(last + 0.5)
    bad = [at for at, data in master.sent(0x186, since=last) if struct.unpack("<i", data)[0] == FAULT]
    assert last + 0.1 <= bad[0] <= last + 0.1 + 2 * 0.01
    emergencies = master.sent(0x86, since=last)
    assert [data[:3] for _, data in emergencies] == [b"\x50\x82\x11"]
    assert emergencies[0][0] == pytest.approx(last + 0.1)
    assert master.node.sdo[0x1001].raw == 0x11
    master.rest(0.3)
    assert master.alarms == 0
    assert master.emergencies()[-1] == 0
    assert master.node.sdo[0x1001].raw == 0
    assert master.node.sdo[0x1003][1].raw & 0xFFFF == 0x8250
    write(master, 0x1003, 0)
    assert master.node.sdo[0x1003][0].raw == 0


def test_torque_alone_or_speed_alone_is_no_drive(tmp_path):
    objects = ((0x185, "606Ch"), (0x285, "4602h:0Ch"))
    bus = Master(encoder(channel_map=bus_map(tmp_path, *objects, torque='channel = "4602h:0Ch"')))
    for k in range(30):
        bus.put(0.02 * k, Frame(0x185, bytes(4), 0.02 * k))
        if k < 10:
            bus.put(0.02 * k + 0.003, Frame(0x285, struct.pack("<h", 320 + k % 2), 0.02 * k + 0.003))
        if k == 5:
            write(bus, 0x6003, 10000)
            assert bus.alarms == 0
    assert bus.alarms == PE
    assert 0x8250 in bus.emergencies()


def test_a_frame_that_comes_twice_is_no_fault_and_a_clock_that_stands_is_a_lost_drive(master):
    write(master, 0x6003, 10000)
    for _ in range(2):
        master.rest(0.1)
        twice = Frame(0x180 + DRIVE, sample(0, 20.0).data, master.now)
        master.put(master.now + 0.001, twice)
        assert master.alarms == 0
    for k in range(10):
        master.put(master.now + 0.02, Frame(0x180 + DRIVE, sample(0, 20.0 + k).data, twice.time))
    assert master.alarms == PE
    assert master.emergencies()[-1] == 0x8250


def test_a_missing_heartbeat_of_the_drive_is_told(master):
    write(master, 0x1016, (DRIVE << 16) | 250, 1)
    write(master, 0x6003, 10000)
    master.rest(1.0)  # it has never come: not yet watched
    assert master.alarms == 0
    master.put(master.now, Frame(0x700 + DRIVE, b"\x05"))
    master.rest(0.2)
    assert master.alarms == 0
    master.rest(0.2)
    assert master.alarms == PE
    assert 0x8130 in master.emergencies()
    master.put(master.now, Frame(0x700 + DRIVE, b"\x05"))
    assert master.alarms == PE, "no sample of the time without a heartbeat was used: the position is from before it"
    master.rest(0.02)
    assert master.alarms == 0


def test_a_missing_temperature_makes_it_uncertain(master):
    write(master, 0x6003, 10000)
    assert master.warnings == 0
    write(master, 0x2100, -32768)
    master.rest(0.1)
    assert (master.alarms, master.warnings, master.position) == (0, COLD, 10000)
    assert master.emergencies()[-1] == 0x4200
    assert master.node.sdo[0x1001].raw == 0x09
    write(master, 0x2100, 400)
    master.rest(0.1)
    assert master.warnings == 0
    assert master.emergencies()[-1] == 0
    master.rest(61.0)  # nobody wrote it again
    assert master.warnings & COLD


def test_a_short_pdo_of_the_drive_is_told_once(master):
    write(master, 0x6003, 10000)
    for _ in range(3):
        master.put(master.now + 0.02, Frame(0x180 + DRIVE, b"\0\0\0"))
    assert master.emergencies().count(0x8210) == 1
    assert master.alarms == 0
    master.rest(0.1)
    assert master.emergencies()[-1] == 0


def test_emergencies_keep_their_inhibit_time(master):
    write(master, 0x1015, 1000)
    write(master, 0x6003, 10000)
    begin = master.now + 0.2
    master.rest(0.2)
    for k in range(50):
        write(master, 0x2100, -32768 if k % 2 else 400)
        master.rest(0.02)
    times = [at for at, _ in master.sent(0x86, since=begin)]
    assert np.diff(times).min() >= 0.1 - 1e-9


def test_a_switch_is_a_reference_and_a_switch_that_contradicts_an_alarm(tmp_path):
    made = bus_map(
        tmp_path, (0x185, "606Ch", "4602h:0Ch"), (0x180 + WARM, "2010h:01 INT16", "2020h UINT8"),
        torque='channel = "4602h:0Ch"', temperature='channel = "2010h:01h", unit = "degC", scale = 0.1, hold = "2 s"',
        more=SWITCH,
    )  # fmt: skip
    bus = Master(encoder(channel_map=made))

    def stand(switch: int, seconds: float) -> None:
        begin = bus.now
        for k in range(round(seconds / 0.02)):
            at = begin + 0.02 * k
            bus.put(at, Frame(0x180 + WARM, struct.pack("<hB", 400, switch), at))
            bus.put(at, Frame(0x185, struct.pack("<ih", 0, 320 + k % 3), at))

    stand(0, 0.2)
    assert bus.alarms == PE
    stand(1, 0.2)  # the edge comes with a sample that the sensor passes over: its time has not advanced
    assert (bus.alarms, bus.position) == (0, 30000)
    write(bus, 0x2003, FORGET)
    write(bus, 0x6003, 60000)
    stand(0, 0.2)
    assert bus.alarms == 0
    stand(1, 0.2)
    assert bus.alarms == PE
    assert 0xFF02 in bus.emergencies()


# ---- power cycles ------------------------------------------------------------------------------------------------


def power_up(state: Path) -> Master:
    bus = Master(encoder(state))
    bus.node.nmt.state = "OPERATIONAL"
    bus.node.sdo[0x2100].raw = 400
    return bus


def rested(state: Path, torque: float = 20.0) -> Master:
    """Powered up, given a position, and at rest for long enough that the file has it."""
    bus = power_up(state)
    bus.rest(0.2, torque)
    write(bus, 0x6003, 10000)
    bus.rest(2.0, torque)
    return bus


def test_it_knows_its_position_after_a_power_loss_at_rest(tmp_path):
    rested(tmp_path / "boom.state")
    again = power_up(tmp_path / "boom.state")  # no stop: the power just went
    assert again.position == FAULT
    again.rest(0.1)
    assert (again.alarms, again.position) == (0, 10000)


def test_after_a_power_loss_in_motion_it_does_not_know(tmp_path, trace):
    bus = power_up(tmp_path / "boom.state")
    frames = list(played(read_log(trace("boom_441kN_40C").log)))
    bus.play(frames[:10])
    write(bus, 0x6003, 10000)
    bus.play(frames[10:400])
    assert bus.alarms == 0
    assert bus.position > 11000
    again = power_up(tmp_path / "boom.state")
    again.rest(0.1)
    assert (again.alarms, again.warnings) == (PE, NOT_REFERENCED)
    assert again.emergencies() == [0x4200, 0]


def test_a_damaged_state_is_told_until_a_reference_comes(tmp_path):
    state = tmp_path / "boom.state"
    state.write_bytes(b"ramsight state\n\0 torn")
    bus = power_up(state)
    bus.rest(0.2)
    assert bus.alarms == PE | 1 << 12
    assert 0x6300 in bus.emergencies()
    write(bus, 0x6003, 10000)
    bus.rest(0.1)
    assert (bus.alarms, bus.position) == (0, 10000)


def test_a_state_of_another_machine_is_as_good_as_damaged(tmp_path):
    bus = power_up(tmp_path / "boom.state")
    bus.rest(0.2)
    write(bus, 0x6003, 10000)
    bucket = build_ddh("bucket", machine.load_machine("mining-loader").unit("bucket"))
    lose_power(bus.device)
    other = Master(encoder_for(bucket, usual_map(), Settings(NODE, DRIVE), tmp_path / "boom.state"))
    other.rest(0.1)
    assert other.alarms == PE | 1 << 12


@pytest.mark.parametrize("settings", [Settings(9, DRIVE, 4711), Settings(NODE, DRIVE, 4712)])
def test_the_state_of_a_twin_is_another_one(tmp_path, settings):
    """The left and the right cylinder of a machine have the same numbers."""
    bus = rested(tmp_path / "boom.state")
    lose_power(bus.device)
    other = Master(encoder_for(boom(), usual_map(), settings, tmp_path / "boom.state"))
    other.device.receive(0.0, sample(0, 20.0))
    assert Fault.STATE_DAMAGED in other.device.faults
    assert not other.device.valid


def test_a_state_file_is_one_encoder_s_until_it_ends(tmp_path):
    bus = power_up(tmp_path / "boom.state")
    bus.rest(0.2)
    twin = Settings(9, DRIVE)
    with pytest.raises(HeldError, match=r"boom\.state: another program"):
        encoder_for(boom(), usual_map(), twin, tmp_path / "boom.state")
    write(bus, 0x6003, 10000)
    bus.rest(2.0)
    again = power_up(tmp_path / "boom.state")
    again.rest(0.1)
    assert (again.alarms, again.position) == (0, 10000), "whom it refused has changed nothing"
    again.device.stop()
    encoder_for(boom(), usual_map(), twin, tmp_path / "boom.state").stop()


def test_a_program_that_comes_while_the_file_was_removed_is_not_overwritten(tmp_path, disk):
    state = tmp_path / "boom.state"
    bus = rested(state)
    disk.fails = True
    bus.play([(bus.now + 0.02, sample(100, 20.0))])
    assert not state.exists(), "removed, as it cannot say that the piston moves"
    disk.fails = False
    other = StateFile(state, kalman(boom()), "another cylinder")
    other.save()
    other.hold()
    content = state.read_bytes()
    bus.rest(5.0)
    assert Fault.NOT_SAVED in bus.device.faults
    assert state.read_bytes() == content
    other.release()


class Disk:
    """The computer's disk, which can fail: nothing reaches it, as when it is full or read-only."""

    def __init__(self, monkeypatch) -> None:
        self.fails = False
        self._open = os.open
        monkeypatch.setattr("ramsight.sensor.persistence.os.open", self._opened)

    def _opened(self, path, flags, *mode):
        if self.fails and flags & (os.O_RDWR | os.O_WRONLY):
            raise OSError(errno.EROFS, "Read-only file system", str(path))
        return self._open(path, flags, *mode)


@pytest.fixture
def disk(monkeypatch):
    return Disk(monkeypatch)


def move(bus: Master, trace, seconds: float) -> None:
    """The cycle of another simulator, from its first sample on."""
    frames = [(at, frame) for at, frame in played(read_log(trace("boom_441kN_40C").log)) if at < seconds]
    bus.play(frames, offset=bus.now + 0.02)


CANNOT_SAVE = 1 << 13


def test_a_position_that_was_resumed_cannot_come_back_from_a_disk_that_fails_later(tmp_path, trace, disk):
    state = tmp_path / "boom.state"
    bus = rested(state)
    bus = power_up(state)
    bus.rest(0.1)
    disk.fails = True
    assert (bus.alarms, bus.position) == (0, 10000)
    move(bus, trace, 8.0)
    assert bus.alarms == PE | CANNOT_SAVE, "a save that fails is a fault at once"
    assert bus.position == FAULT
    assert 0x5500 in bus.emergencies()
    assert "Read-only file system" in bus.device.said
    disk.fails = False
    again = power_up(state)
    again.rest(0.1)
    assert (again.alarms, again.warnings) == (PE, NOT_REFERENCED)


def test_a_position_that_cannot_be_taken_off_the_disk_is_not_resumed(tmp_path, disk):
    state = tmp_path / "boom.state"
    bus = rested(state)
    disk.fails = True
    bus = power_up(state)
    bus.rest(0.1)
    assert (bus.alarms, bus.warnings, bus.position) == (PE | CANNOT_SAVE, NOT_REFERENCED, FAULT)
    assert 0x5500 in bus.emergencies()


def test_a_power_up_without_the_drive_costs_nothing(tmp_path):
    state = tmp_path / "boom.state"
    rested(state)
    power_up(state).pass_time(5.0)
    idle = power_up(state)
    idle.pass_time(5.0)
    idle.device.stop()
    again = power_up(state)
    again.rest(0.1)
    assert (again.alarms, again.position) == (0, 10000)


def test_a_disk_that_cannot_be_written_is_told_from_the_start_and_tried_again(tmp_path, disk):
    disk.fails = True
    bus = power_up(tmp_path / "boom.state")
    bus.rest(0.2)
    write(bus, 0x6003, 10000)
    assert bus.alarms == PE | CANNOT_SAVE
    disk.fails = False
    bus.rest(1.2)
    assert bus.alarms == 0
    assert abs(bus.position - 10000) <= 1
    assert bus.emergencies()[-1] == 0
    bus.rest(1.2)
    again = power_up(tmp_path / "boom.state")
    again.rest(0.1)
    assert again.alarms == 0
    assert abs(again.position - 10000) <= 1


def test_a_position_that_cannot_be_written_over_is_removed(tmp_path, disk):
    """A full disk that copies on write, or a file that lost its mode: it cannot be written, but it can be removed."""
    state = tmp_path / "boom.state"
    bus = rested(state, torque=2.0)
    disk.fails = True
    bus.rest(1.0, torque=2.0)
    assert bus.alarms == 0, "the file says what is so"
    bus.put(bus.now + 0.02, sample(100, 30.0))
    assert bus.alarms == PE | CANNOT_SAVE
    disk.fails = False
    again = power_up(state)
    again.rest(0.1)
    assert (again.alarms, again.warnings) == (PE, NOT_REFERENCED)


def test_a_slow_disk_is_told(tmp_path, monkeypatch):
    stuck = threading.Event()
    slow = encoder_for(boom(), usual_map(), Settings(NODE, DRIVE), tmp_path / "boom.state", aside=True)
    bus = Master(slow)
    bus.node.nmt.state = "OPERATIONAL"
    bus.rest(0.2, torque=2.0)
    fsync = os.fsync
    monkeypatch.setattr("ramsight.sensor.persistence.os.fsync", lambda file: (stuck.wait(30.0), fsync(file)))
    bus.node.sdo[0x6003].raw = 10000
    bus.rest(1.0, torque=2.0)
    assert bus.alarms == 0
    bus.rest(1.2, torque=2.0)
    assert bus.alarms == PE | CANNOT_SAVE
    stuck.set()
    slow.stop()
    assert bus.device._saving.failure == ""


def test_power_lost_at_any_frame_leaves_a_right_position_or_none(tmp_path, trace):
    state, lost = tmp_path / "boom.state", tmp_path / "lost.state"
    bus, case = power_up(state), trace("boom_441kN_40C")
    truth = read_truth(case.truth)
    frames = list(played(read_log(case.log)))
    bus.play(frames[:10])
    write(bus, 0x6003, 10000)
    begin, found = None, {}
    for k, (at, frame) in enumerate(frames[10:]):
        bus.put(at, frame)
        content = state.read_bytes()
        if content in found:
            continue
        begin = begin or at
        lost.write_bytes(content)
        again = power_up(lost)
        again.rest(0.1)
        found[content] = (k, again.alarms, again.position)
    position = np.interp([at for at, _ in frames[10:]], truth["time"], truth["position"])
    places = [(k, place) for k, alarm, place in found.values() if alarm == 0]
    assert 2 <= len(places) < len(found)
    ends = [*[k for k, _, _ in found.values()][1:], len(position)]
    for (k, alarm, place), end in zip(found.values(), ends, strict=True):
        if alarm == 0:  # this content is what a power loss leaves until the next one is written
            assert np.abs(place * STEP - position[k:end]).max() < 2e-3


def test_stored_parameters_that_cannot_be_are_not_used(tmp_path):
    state = tmp_path / "boom.state"
    for values in ({(0x2001, 0): 10000}, {(0x1800, 1): 0x40000080}, {(0x1017, 0): 1}, {(0x2002, 0): 5}):
        ParameterFile(tmp_path / "boom.state.parameters").save(values)
        bus = power_up(state)
        bus.rest(0.1)
        assert bus.alarms == PE | 1 << 12
        assert [bus.node.sdo[0x2001].raw, bus.node.sdo[0x1017].raw] == [FAULT, 1000]


def test_parameters_are_stored_and_restored(tmp_path):
    state = tmp_path / "boom.state"
    bus = power_up(state)
    write(bus, 0x6200, 50)
    write(bus, 0x1017, 200)
    write(bus, 0x6005, 100_000, 1)
    assert abort_of(lambda: write(bus, 0x1010, 1, 1)) == 0x08000020
    write(bus, 0x1010, SAVE, 1)
    bus = power_up(state)
    assert [bus.node.sdo[k].raw for k in (0x6200, 0x1017)] == [50, 200]
    assert bus.node.sdo[0x1800][5].raw == 50
    assert bus.node.sdo[0x6005][1].raw == 100_000
    write(bus, 0x1011, LOAD, 2)
    assert bus.node.sdo[0x1017].raw == 200  # until the next reset
    bus.node.nmt.state = "RESET"
    assert [bus.node.sdo[k].raw for k in (0x6200, 0x1017)] == [50, 1000]
    write(bus, 0x1011, LOAD, 1)
    bus = power_up(state)
    assert [bus.node.sdo[k].raw for k in (0x6200, 0x1017)] == [10, 1000]


def test_damaged_parameters_are_told_and_not_used(tmp_path):
    state = tmp_path / "boom.state"
    bus = power_up(state)
    write(bus, 0x6005, 100_000, 1)
    write(bus, 0x1010, SAVE, 3)
    kept = tmp_path / "boom.state.parameters"
    content = json.loads(kept.read_text())
    content["parameters"]["6005h:01"] = 200_000
    kept.write_text(json.dumps(content))
    bus = power_up(state)
    bus.rest(0.1)
    write(bus, 0x6003, 100)
    assert bus.alarms == PE | 1 << 12
    assert bus.node.sdo[0x6005][1].raw == 10_000
    write(bus, 0x1010, SAVE, 1)
    assert bus.alarms == 0


# ---- clocks and words --------------------------------------------------------------------------------------------


def test_a_wall_clock_that_is_set_back_does_not_move_the_sensors_time():
    clock, times = BusClock(), []
    for k in range(300):
        jump = -3600.0 if k >= 100 else 0.0
        times.append(clock.time(1e9 + 0.02 * k + jump, 5.0 + 0.02 * k + 0.001 * (k % 3)))
    assert np.abs(np.diff(times) - 0.02).max() < 0.0021
    assert clock.stood == 0.0
    stalled = [clock.time(0.02 * k, 11.18 if 5 <= k < 10 else 11.0 + 0.02 * k) for k in range(20)]
    assert np.abs(np.diff(stalled)[1:] - 0.02).max() < 1e-3


@given(slept=st.floats(0.05, 3600.0), at=st.integers(2, 98), late=st.floats(0.0, 0.01))
def test_while_the_local_clock_stands_the_buss_clock_says_how_much_time_passed(slept, at, late):
    clock, times = BusClock(), []
    for k in range(100):
        stamp = 1e6 + 0.02 * k + (slept if k >= at else 0.0)
        times.append(clock.time(stamp, 5.0 + 0.02 * k + late * (k % 2)))
    steps, unseen = np.diff(times), max(slept, BRIDGED_GAP + USUAL_PERIOD)
    assert steps[at - 1] == pytest.approx(0.02 + unseen, abs=0.011)
    assert np.delete(steps, at - 1) == pytest.approx(0.02, abs=0.011)
    assert clock.stood == pytest.approx(unseen, abs=0.011)


@pytest.mark.parametrize("back", [0.03, 0.055, 0.09, 0.5, 3600.0])
def test_a_wall_clock_that_is_set_back_loses_no_time(back):
    clock = BusClock()
    times = [clock.time(1e6 + 0.02 * k - (back if k >= 50 else 0.0), 5.0 + 0.02 * k) for k in range(100)]
    assert np.diff(times) == pytest.approx(0.02, abs=1e-3)


@pytest.mark.parametrize("set_by", [0.05, 0.1, 0.4, 2.0])
@pytest.mark.parametrize("counts", [True, False])
def test_a_wall_clock_that_is_set_forward_in_motion_makes_the_position_uncertain(tmp_path, set_by, counts):
    """Nobody knows whether the piston went on meanwhile; a drive that counts its frames is not late by it."""
    sequence = 'sequence = {channel = "2001h", modulus = 256}\n' if counts else ""
    device = encoder(channel_map=bus_map(tmp_path, (0x180 + DRIVE, "606Ch", "6077h", "2001h UINT16"), more=sequence))
    device.start(0.0)
    per_second = 1000 * math.pi / 30.0 * boom().travel_per_radian
    for k in range(150):
        at, rpm = 0.02 * k, min(max(100 * (k - 50), 0), 1000)
        if k == 40:
            device._sensor.start(0.1, 1e-4)
        share = (750 + k % 7).to_bytes(2, "little")
        data = rpm.to_bytes(4, "little") + share + (k % 256).to_bytes(2, "little")
        device.receive(at, Frame(0x180 + DRIVE, data, at + 1e6 + (set_by if k >= 100 else 0.0)))
        assert Fault.STALE not in device.faults
        if k == 99:
            before, std = device.position, device.std
            assert device.valid
        if k == 100 and device.valid:
            assert device.std > std + 0.5 * per_second * min(set_by, 0.5)
            assert abs(device.position - before) < 0.03 * per_second


@pytest.mark.parametrize("slept", [0.08, 0.3, 1.0, 3.0, 10.0, 3600.0])
def test_no_position_is_valid_and_wrong_after_a_computer_that_slept_while_the_machine_moved(slept):
    """The motor lifts all the time; the local clock stands, and the bus's goes on."""
    bus = Master(encoder())
    bus.node.nmt.state = "OPERATIONAL"
    bus.rest(3.0, torque=60.0)
    write(bus, 0x6003, 10_000)
    rpm, per_second = 500, 500 * math.pi / 30.0 * boom().travel_per_radian

    def lift(seconds, ahead):
        begin = bus.now
        for k in range(1, round(seconds / 0.02) + 1):
            at = begin + 0.02 * k
            bus.pass_time(at)
            bus.take(bus.device.receive(at, replace(sample(rpm, 60.0), time=at + ahead)))

    lift(0.4, 0.0)
    before = bus.device.position
    assert bus.device.valid
    lift(0.4, slept)
    if bus.device.valid:
        moved = min((0.4 + slept) * per_second, boom().cylinder.stroke)
        assert abs(bus.device.position - before - moved) < bus.device.bound
        assert bus.device.bound < 0.5 * boom().cylinder.stroke
    else:
        assert slept > 0.3


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"objects": ["6077h"], "rated_torque": 80.0}, "velocity and torque"),
        ({}, "rated torque"),
        ({"objects": ["606Ch", "6077h", "606Ch"], "rated_torque": 80.0}, "fit into a frame"),
    ],
)
def test_a_drive_that_cannot_be_is_refused(options, says):
    with pytest.raises(DescriptionError, match=says):
        drive_map(DRIVE, **options)


def test_the_page_quotes_what_was_measured():
    found = json.loads((ROOT / "results" / "encoder.json").read_text())
    page = (ROOT / "docs" / "reference" / "encoder.md").read_text(encoding="utf-8")
    for bus in ("virtual", "udp_multicast"):
        for name in ("pdo", "heartbeat"):
            row = " | ".join(f"{found[bus][name][key]:.2f}" for key in ("p50_ms", "p99_ms", "max_ms"))
            assert row in page
    assert re.search(r"FFFFFF7F", page)
    assert DUE in [fault.warning for fault in Fault]


def test_a_maps_scale_offset_and_sign_reach_the_encoders_samples():
    for sign, wanted in ((1.0, 205.0), (-1.0, -205.0)):
        channel = _Channel(Mapped("n", "rpm", sign=sign, scale=2.0, offset=5.0), np.pi / 30.0, 0.0)
        channel.take(100.0, 0.5, 0.6)
        assert channel.value == pytest.approx(wanted * np.pi / 30.0)
        assert (channel.sent, channel.at, channel.fresh) == (0.5, 0.6, True)


def test_what_is_wrong_with_a_map_names_its_file(tmp_path):
    own, drive = (0x180 + NODE, "606Ch", "6077h"), (0x185, "606Ch", "6077h")
    with pytest.raises(DescriptionError, match=rf"map\.toml: can\.pdo\.cob_id = '18{NODE}h': is what the encoder"):
        encoder(channel_map=bus_map(tmp_path, own))
    with pytest.raises(UnknownNameError, match=r"map\.toml: unknown channel '2020h'"):
        encoder(channel_map=bus_map(tmp_path, drive, more=SWITCH))
    with pytest.raises(UnknownNameError, match=r"map\.toml: unknown channel '0x186\.606Ch'; did you mean"):
        Listener(bus_map(tmp_path, drive, speed='channel = "0x186.606Ch", unit = "1/min"'))
