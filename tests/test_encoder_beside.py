"""A real position sensor beside the encoder: what the comparison makes of position, alarms, warnings, emergencies."""

import numpy as np
import pytest

from ramsight.deploy.encoder.assembly import overrides
from ramsight.deploy.encoder.beside import ALONE
from ramsight.deploy.encoder.frame import Frame
from ramsight.deploy.encoder.played_drive import played_map
from ramsight.logs import read_log, read_truth
from ramsight.logs.channel_map import load_map
from ramsight.tracking.comparing import Verdict

from .encoder_bus import DRIVE, FAULT, NODE, OTHER_MAP, PE, RATED, WARM, Master, encoder, other_frame, played

CONTRADICTED, INPUT = 1 << 14, 1 << 2
LATE = 0.012  # s, from a frame of the drive to one of the real sensor
FIRST = 1.0  # s, of the played log by the encoder's clock


@pytest.fixture
def together(tmp_path, trace):
    """Plays a recorded log beside a real sensor that says `steps_of(time, steps)`: what was said of each sample."""
    case = trace("boom_258kN_40C")
    log, truth = read_log(case.log).isel(time=slice(30, 250)), read_truth(case.truth)
    begin = float(log["time"][0])
    log = log.assign_coords(time=log["time"] - begin)
    (tmp_path / "map.toml").write_text(played_map(DRIVE, WARM, RATED) + OTHER_MAP)
    channel_map = load_map(tmp_path / "map.toml")
    when, where = truth["time"].values - begin, 1e5 * truth["position"].values

    def steps_at(time):
        return round(float(np.interp(time, when, where)))

    def play(steps_of, warm=True):
        device = encoder(None, channel_map, overrides=overrides(False, None, 1e-3, 0.1))
        bus, said = Master(device), []
        bus.put(FIRST - 0.02, Frame(0x188, other_frame(steps_at(0.0)).data, FIRST - 0.02))
        for at, frame in played(log, warm_node=WARM if warm else None):
            bus.put(at + FIRST, Frame(frame.cob_id, frame.data, at + FIRST))
            if frame.cob_id != 0x180 + DRIVE:
                continue
            if not device.referenced:
                bus.node.sdo[0x6003].raw = steps_at(at)
            said.append((at, bus.node.sdo[0x2031].raw, bus.alarms, bus.warnings, bus.position - steps_at(at),
                         bus.node.sdo[0x2030].raw - steps_at(at)))  # fmt: skip
            steps = steps_of(at + LATE, steps_at(at + LATE))
            if steps is not None:
                bus.put(at + FIRST + LATE, Frame(0x188, other_frame(steps).data, at + FIRST + LATE))
        return bus, np.array(said).T

    return play


def test_a_real_sensor_that_is_right_agrees_in_motion_whatever_its_beat(together):
    bus, (_, verdict, alarms, warnings, _, other) = together(lambda at, steps: steps)
    assert (verdict[2:] == Verdict.AGREE).all()
    assert not alarms[2:].any()
    assert not (warnings[2:].astype(int) & INPUT).any()
    assert np.abs(other[2:]).max() <= 5, (
        "a report that is 8 ms old is 16 steps behind; at the time of the drive it is not"
    )
    assert not {0xFF05, 0xFF06, 0xFF07} & set(bus.emergencies())
    bus.pass_time(bus.now + 0.2)
    assert bus.node.sdo[0x2031].raw == Verdict.UNCHECKED, "while the drive is silent nothing is compared"


@pytest.mark.parametrize(
    "wrong",
    [
        lambda at, steps: steps + 3000 * (at > 2.0),
        lambda at, steps: steps if at < 2.0 else 13000,
        lambda at, steps: steps if at < 2.0 else None,
    ],
    ids=["leaps", "stands", "falls silent"],
)
def test_a_real_sensor_that_is_wrong_is_a_warning_and_the_position_goes_on(together, wrong):
    bus, (_, verdict, alarms, warnings, error, _) = together(wrong)
    assert verdict[-1] == Verdict.OTHER_WRONG
    assert alarms[-1] == 0
    assert int(warnings[-1]) & INPUT
    assert abs(error[-1]) < 300
    assert 0xFF06 in bus.emergencies()


def test_two_that_are_apart_make_the_position_invalid(together):
    bus, (time, verdict, alarms, _, _, _) = together(lambda at, steps: steps + round(1000 * max(at - 2.0, 0.0)))
    assert verdict[-1] == Verdict.APART
    assert alarms[-1] == PE | CONTRADICTED
    assert bus.position == FAULT
    assert 0xFF05 in bus.emergencies()
    assert time[np.argmax(verdict == Verdict.APART)] > 2.1


def test_a_virtual_sensor_that_is_not_sure_is_the_one_that_is_wrong(together):
    bus, (_, verdict, alarms, _, _, _) = together(lambda at, s: s + round(1000 * max(at - 2.0, 0.0)), warm=False)
    assert verdict[-1] == Verdict.VIRTUAL_WRONG
    assert alarms[-1] == PE | CONTRADICTED
    assert 0xFF07 in bus.emergencies()


def test_without_a_real_sensor_there_is_no_verdict():
    bus = Master(encoder())
    assert (bus.node.sdo[0x2031].raw, bus.node.sdo[0x2030].raw) == (ALONE, FAULT)
    assert 0x80 + NODE in {frame.cob_id for _, frame in bus.seen}
