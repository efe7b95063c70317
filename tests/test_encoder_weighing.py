"""What the encoder says of lifts, read back as a controller does: objects, a PDO of them, and the J1939 messages."""

import re
import struct
import time
from pathlib import Path

import cantools
import pytest
from typer.testing import CliRunner

import ramsight
from ramsight import machine
from ramsight.api.live_weighing import weigher_for
from ramsight.cli import app
from ramsight.deploy.encoder import Settings, encoder_for, runner
from ramsight.deploy.encoder.frame import EXTENDED, Frame
from ramsight.deploy.encoder.j1939 import Broadcasting, Message, WeighingMessages, weighing_messages_of
from ramsight.deploy.encoder.objects import LOAD_STATUSES, NO_SCALE, NO_WEIGHING, QUALITIES, object_dictionary
from ramsight.deploy.encoder.played_drive import played_map
from ramsight.duty.linked_duty import simulate_linked, unit_run
from ramsight.duty.loading import lifting
from ramsight.logs import write_log
from ramsight.logs.channel_map import load_map
from ramsight.plant.linked import build_linked
from ramsight.tool.load_chart import LoadStatus
from ramsight.tool.weighing_events import Quality

from .encoder_bus import DRIVE, NODE, RATED, WARM, Master, boom, encoder, played

PAGE = (Path(__file__).parents[1] / "docs" / "reference" / "encoder.md").read_text(encoding="utf-8")
MASSES = [3000.0, 8000.0]
FIRST = 0.1  # s, when the drive speaks for the first time
OBJECTS = {
    "mass": 0x2040, "std": 0x2041, "count": 0x2042, "quality": 0x2043, "total": 0x2044, "total_std": 0x2045,
    "share": 0x2046, "share_std": 0x2047, "status": 0x2048,
}  # fmt: skip


def said(bus):
    return {name: bus.node.sdo[index].raw for name, index in OBJECTS.items()}


@pytest.fixture(scope="module")
def log():
    linked = build_linked(machine.load_machine("mining-loader"))
    return ramsight.drive_report(unit_run(simulate_linked(linked, lifting(linked, MASSES)), "boom"))


def device(folder, **how):
    (folder / "map.toml").write_text(played_map(DRIVE, WARM, RATED))
    weigher = weigher_for("mining-loader", at={"bucket": "250 mm"}, **how)
    return encoder_for(boom(), load_map(folder / "map.toml"), Settings(NODE, DRIVE), weigher=weigher)


def work(bus, log, preset=True):
    """Play a log whose piston begins at 70 mm; what the objects said whenever their counter was another one."""
    seen = []
    for k, (at, frame) in enumerate(played(log, warm_node=WARM)):
        bus.put(at + FIRST, Frame(frame.cob_id, frame.data, at + FIRST))
        if preset and k == 5:
            bus.node.sdo[0x6003].raw = 7000
        if frame.cob_id == 0x180 + DRIVE and bus.node.sdo[0x2042].raw != len(seen):
            seen.append(said(bus))
    return seen


@pytest.fixture(scope="module")
def worked(tmp_path_factory, log):
    bus = Master(device(tmp_path_factory.mktemp("worked")))
    return bus, work(bus, log)


def test_each_lift_is_counted_with_its_mass_its_quality_and_the_rated_load(worked, log):
    bus, seen = worked
    whole = ramsight.weigh("mining-loader", log, start="70 mm", at={"bucket": "250 mm"})
    assert [one["count"] for one in seen] == [1, 2]
    for one, mass, alike in zip(seen, MASSES, whole.weighings, strict=True):
        assert abs(one["mass"] - mass) < 2.0 * one["std"] < 500
        assert one["mass"] == pytest.approx(alike.mass, abs=20.0), "the bus rounds speed and torque"
        assert one["std"] == pytest.approx(alike.std, rel=0.1)
        assert one["share"] == pytest.approx(1e3 * alike.rated_share, rel=0.01)
        assert one["share_std"] == pytest.approx(1e3 * alike.rated_share_std, rel=0.1)
        assert QUALITIES[one["quality"]] is Quality.GOOD
    assert [LOAD_STATUSES[one["status"]] for one in seen] == [LoadStatus.WITHIN, whole.weighings[1].rated_status]
    assert seen[1]["total"] == pytest.approx(seen[0]["mass"] + seen[1]["mass"], abs=1.0)
    assert seen[1]["total_std"] > seen[1]["std"]
    assert said(bus)["count"] == 2, "lowering an empty bucket is no weighing"


def test_before_the_first_lift_and_on_a_machine_that_weighs_nothing_there_is_no_number(tmp_path):
    none = {"mass": 0x7FFF_FFFF, "std": 0xFFFF_FFFF, "count": 0, "total": 0, "total_std": 0, "share": 0xFFFF,
            "share_std": 0xFFFF, "status": LOAD_STATUSES.index(LoadStatus.UNKNOWN)}  # fmt: skip
    assert said(Master(device(tmp_path))) == none | {"quality": NO_WEIGHING}
    assert said(Master(encoder())) == none | {"quality": NO_SCALE}


def test_a_lift_from_an_unknown_position_is_bad_and_says_why(tmp_path, log):
    (one, _) = work(Master(device(tmp_path)), log, preset=False)
    assert QUALITIES[one["quality"]] is Quality.UNKNOWN_POSITION
    assert (one["total"], LOAD_STATUSES[one["status"]]) == (0, LoadStatus.UNKNOWN)


def test_a_pdo_holds_mass_counter_quality_and_status(worked):
    bus, _ = worked
    mapped, sdo = (0x2040_0020, 0x2042_0010, 0x2043_0008, 0x2048_0008), bus.node.sdo
    bus.node.nmt.state = "PRE-OPERATIONAL"
    sdo[0x1801][1].raw = 0xC000_0280 + NODE
    sdo[0x1A01][0].raw = 0
    for k, one in enumerate(mapped, 1):
        sdo[0x1A01][k].raw = one
    sdo[0x1A01][0].raw = len(mapped)
    sdo[0x1801][1].raw = 0x4000_0280 + NODE
    bus.node.nmt.state = "OPERATIONAL"
    bus.send_message(0x080, b"")
    _, data = bus.sent(0x280 + NODE)[-1]
    now = said(bus)
    assert struct.unpack("<iHBB", data) == (now["mass"], now["count"], now["quality"], now["status"])


def test_the_numbers_of_the_eds_and_of_the_page_are_those_of_the_code():
    dictionary = object_dictionary(NODE)
    assert {dictionary[index].name for index in OBJECTS.values()} >= {"Mass of the last weighing", "Weighing quality"}
    assert "0 good, 1 too short, 2 too fast, 3 digging, 4 spilled, 5 unknown position; 254 no weighing yet" in PAGE
    assert [one.name for one in LOAD_STATUSES] == ["WITHIN", "NEAR", "EXCEEDED", "UNKNOWN"]


# J1939


def described():
    ((text,),) = [re.findall(r"<!-- j1939_weighing -->\n\n```\n(.*?)```", PAGE, flags=re.DOTALL)]
    return cantools.database.load_string(text, "dbc")


def test_the_messages_read_back_by_the_dbc_file_of_the_page(worked):
    bus, _ = worked
    messages, now = WeighingMessages(), said(bus)
    last, total = messages.frames(bus.device)
    assert [one.cob_id for one in (last, total)] == [0x18FF4180 | EXTENDED, 0x18FF4280 | EXTENDED]
    names = described()
    found = names.decode_message(messages.identifiers[0], last.data, decode_choices=False)
    assert found == pytest.approx({
        "Mass": now["mass"], "StandardDeviation": now["std"], "RatedShare": 0.1 * now["share"],
        "Weighings": now["count"], "Quality": now["quality"], "RatedStatus": now["status"],
    }, abs=0.51)  # fmt: skip
    found = names.decode_message(messages.identifiers[1], total.data)
    assert found == {"Total": now["total"], "TotalStandardDeviation": now["total_std"]}


@pytest.mark.parametrize(("make", "number"), [(device, NO_WEIGHING), (lambda _: encoder(), NO_SCALE)])
def test_without_a_weighing_no_signal_of_a_message_is_in_its_range(tmp_path, make, number):
    last, _ = WeighingMessages().frames(make(tmp_path))
    names = described()
    found = names.decode_message(0x18FF4180, last.data, decode_choices=False)
    top = {signal.name: signal.maximum for signal in names.messages[0].signals}
    assert all(found[name] > top[name] for name in ("Mass", "StandardDeviation", "RatedShare"))
    assert found["Quality"] == number & 0xF
    choices = next(one.choices for one in names.messages[0].signals if one.name == "Quality")
    assert [str(choices[k]).lower() for k in range(len(QUALITIES))] == [one.name.lower() for one in QUALITIES]
    assert {14, 15} < set(choices)


def test_both_kinds_of_messages_have_a_beat_each(tmp_path):
    both = Broadcasting(device(tmp_path), Message(period=0.05), WeighingMessages(period=0.2))
    both.start(0.0)
    came = [frame.cob_id for k in range(1, 101) for frame in both.advance(0.01 * k) if frame.cob_id & EXTENDED]
    position, *lifted = (came.count(one | EXTENDED) for one in (0x18FF4080, 0x18FF4180, 0x18FF4280))
    assert position in (19, 20)
    assert lifted == [5, 5]
    both.stop()


def test_words_of_the_command_line():
    assert weighing_messages_of("FF41h 80h") == WeighingMessages()
    for words in ("FF41h", "mass", "FFFFh 80h"):
        with pytest.raises(ramsight.DescriptionError):
            weighing_messages_of(words)


# The verb


@pytest.fixture
def verb(monkeypatch):
    """Runs `ramsight encoder` up to where it would serve: what it made, and what it printed."""
    made = []
    monkeypatch.setattr(runner, "serve", lambda ready, *_, **__: made.append(ready))

    def run(unit, *words):
        words = ["mining-loader", "--unit", unit, "--interface", "virtual", "--channel", "lifts", *words]
        done = CliRunner().invoke(
            app, ["encoder", *words, "--node-id", "6", "--drive-node", "5", "--rated-torque", "80Nm"]
        )
        return (made[-1] if made else None), done

    return run


@pytest.mark.slow
def test_the_verb_weighs_with_the_scale_that_known_masses_teach(verb, tmp_path):
    linked = build_linked(machine.load_machine("mining-loader"))
    wrong = ramsight.drive_report(unit_run(simulate_linked(linked, lifting(linked, [5000.0])), "boom"))
    wrong["motor_torque"] *= 1.02
    write_log(wrong, tmp_path / "five.csv")
    words = ("--at", "bucket=250 mm", "--j1939-weighing", "FF41h 80h")
    plain, _ = verb("boom", *words)
    taught, done = verb("boom", *words, "--known", f"5 t={tmp_path / 'five.csv'}", "--known-start", "70 mm")
    assert done.exit_code == 0, done.output
    scales = [one.weighings._weigher.tally.scale for one in (plain._encoder, taught._encoder)]
    assert [one.masses for one in scales] == [0, 1]
    assert scales[1].std[0] < scales[0].std[0]
    assert scales[1].value[0] < -0.005, "the drive reports 2 % too much"


def test_the_verb_of_a_unit_that_lifts_nothing_weighs_nothing(verb):
    bucket, _ = verb("bucket")
    assert bucket.weighings.quality == NO_SCALE
    _, done = verb("bucket", "--at", "boom=100 mm")
    assert "--unit = 'bucket': lifts nothing that is weighed" in str(done.exception)


# Time


def test_a_sample_that_ends_a_lift_leaves_the_bus_its_turn(tmp_path, log):
    """By the time of this thread, the best of three: other programs run as well."""
    for k in range(3):
        (tmp_path / str(k)).mkdir()
        node = device(tmp_path / str(k))
        took, step = [], node.weighings._weigher.step

        def timed(*sample, step=step, took=took):
            begin = time.thread_time()
            step(*sample)
            took.append(time.thread_time() - begin)

        node.weighings._weigher.step = timed
        assert [one["count"] for one in work(Master(node), log)] == [1, 2]
        if max(took) < 2e-3:
            break
    assert max(took) < 2e-3
