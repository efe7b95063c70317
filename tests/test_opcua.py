"""The OPC UA server beside the encoder, as a client of another library's own sees it."""

import asyncio
import math
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from evaluation.page_tables import quality_table
from ramsight.deploy.encoder.alarms import Fault
from ramsight.deploy.encoder.opcua import NAMESPACE, OpcuaError, OpcuaServer, address_of
from ramsight.deploy.encoder.quality import QUALITY, quality_of
from ramsight.errors import DescriptionError

from .encoder_bus import Master, encoder
from .waiting import PATIENCE, wait_for

asyncua = pytest.importorskip("asyncua")
NUMBERS = ("Position", "Velocity", "StandardDeviation", "Bound")


@pytest.fixture
def port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


def asked(port, what, user=None):
    """What a coroutine of a client gives."""

    async def ask():
        client = asyncua.Client(f"opc.tcp://127.0.0.1:{port}/ramsight", timeout=PATIENCE)
        if user is not None:
            client.set_user(user)
            client.set_password("")
        async with client:
            return await what(client, await client.get_namespace_index(NAMESPACE))

    return asyncio.run(ask())


def values(port, *names):
    """Value and name of the status code of some variables of the boom."""

    async def read(client, space):
        found = []
        for name in names:
            node = await client.nodes.objects.get_child([f"{space}:boom", f"{space}:{name}"])
            said = await node.read_data_value(raise_on_bad_status=False)
            found.append((None if said.Value is None else said.Value.Value, said.StatusCode.name))
        return found

    return asked(port, read)


OLD = "ramsight.deploy.encoder.opcua._OLD"


@pytest.fixture
def patient(monkeypatch):
    """What a server has said is old later than a busy computer needs for an answer."""
    monkeypatch.setattr("ramsight.deploy.encoder.opcua._START", PATIENCE)
    monkeypatch.setattr(OLD, PATIENCE)


def test_a_client_reads_the_position_with_what_it_is_worth(port, patient, monkeypatch):
    device, written = encoder(), []
    bus = Master(device)
    gives = OpcuaServer._value
    monkeypatch.setattr(OpcuaServer, "_value", lambda one, name: written.append(name) or gives(one, name))
    with OpcuaServer(device, "boom", port=port) as server:

        def offered(*names):
            server._next = -1.0
            server.take()
            written.clear()
            wait_for(lambda: written.count("position") > 2)  # what began after it is offered
            return values(port, *names)

        assert values(port, *NUMBERS)[0][1] == "BadWaitingForInitialData", "nobody has said anything yet"
        bus.put(0.5, _warm(bus))
        bus.rest(0.2)
        for value, code in offered(*NUMBERS):
            assert code == "BadWaitingForInitialData"
            assert value is None or math.isnan(value)
        bus.node.sdo[0x6003].raw = 10000
        bus.rest(0.2)
        found = offered(*NUMBERS, "Status", "Referenced")
        assert found[0] == (pytest.approx(0.1, abs=1e-4), "Good")
        assert [code for _, code in found] == ["Good"] * 6
        assert found[2][0] < found[3][0] < 0.05
        assert [value for value, _ in found[4:]] == [0, True]

        bus.node.sdo[0x2100].raw = -(1 << 15)
        assert offered("Position")[0] == (pytest.approx(0.1, abs=1e-4), "UncertainSubNormal")
        bus.pass_time(bus.now + 1.0)
        silent = offered("Position", "Text")
        assert silent[0][1] == "BadNoCommunication"
        assert silent[0][0] is None or math.isnan(silent[0][0])
        assert "drive silent" in silent[1][0]


def _warm(bus):
    from ramsight.deploy.encoder.frame import Frame

    bus.node.sdo[0x2100].raw = 400
    return Frame(0x80)


def test_what_the_encoder_says_before_the_server_begins_is_served(port, patient):
    device = encoder()
    bus = Master(device)
    bus.node.sdo[0x2100].raw = 400
    bus.rest(0.2)
    bus.node.sdo[0x6003].raw = 10000
    server = OpcuaServer(device, "boom", port=port)
    server.take()
    with server:
        assert values(port, "Position", "Status")[0][0] == pytest.approx(0.1, abs=1e-4)


def test_what_the_encoder_has_not_said_lately_is_not_good(port, patient, monkeypatch):
    device = encoder()
    bus = Master(device)
    bus.node.sdo[0x2100].raw = 400
    bus.rest(0.2)
    bus.node.sdo[0x6003].raw = 10000
    with OpcuaServer(device, "boom", port=port) as server:
        server.take()
        wait_for(lambda: values(port, "Position")[0][1] == "Good")
        monkeypatch.setattr(OLD, 0.5)
        wait_for(lambda: values(port, "Position", "Status")[1][1] == "BadNoCommunication")
        assert values(port, "Position")[0][1] == "BadNoCommunication"


@pytest.mark.parametrize("user", [None, "admin"])
def test_nobody_writes(port, user):
    ua = asyncua.ua
    with OpcuaServer(encoder(), "boom", port=port):

        async def write(client, space):
            node = await client.nodes.objects.get_child([f"{space}:boom", f"{space}:Position"])
            with pytest.raises(ua.UaStatusCodeError):
                await node.write_value(0.5)
            with pytest.raises(ua.UaStatusCodeError):
                await client.nodes.objects.add_variable(space, "mine", 1.0)
            with pytest.raises(ua.UaStatusCodeError):
                await client.delete_nodes([node])
            return await node.read_data_value(raise_on_bad_status=False)

        if user is None:
            assert not asked(port, write).StatusCode.is_good()
        else:
            with pytest.raises(ua.UaStatusCodeError, match="BadIdentityToken"):
                asked(port, write, user)


def test_units_stand_beside_the_numbers(port):
    with OpcuaServer(encoder(), "boom", port=port):

        async def read(client, space):
            place = await client.nodes.objects.get_child([f"{space}:boom"])
            units = [await place.get_child([f"{space}:{name}", "0:EngineeringUnits"]) for name in NUMBERS]
            return [(await unit.read_value()).DisplayName.Text for unit in units]

        assert asked(port, read) == ["m", "m/s", "m", "m"]


def test_what_makes_a_position_invalid_is_bad_and_nothing_wrong_is_good():
    assert set(QUALITY) == set(Fault)
    for fault, code in QUALITY.items():
        assert code.startswith("Bad") == bool(fault.alarm), fault
        assert code.startswith(("Bad", "Uncertain"))
        assert getattr(asyncua.ua.StatusCodes, code)
        assert quality_of(frozenset({fault, Fault.GAP}), valid=not fault.alarm) != "Good"
    assert quality_of(frozenset(), valid=False).startswith("Bad")


def test_the_page_has_the_table_of_the_code():
    page = Path(__file__).parents[1] / "docs" / "reference" / "encoder-protocols.md"
    assert quality_table() in page.read_text(encoding="utf-8")


def test_a_port_that_is_taken_and_words_that_are_none_are_refused(port):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", port))
        taken.listen()
        with pytest.raises(OpcuaError, match=rf"opc\.tcp://127\.0\.0\.1:{port}/ramsight: cannot be served"):
            OpcuaServer(encoder(), "boom", port=port).__enter__()
    for wrong in ("", "host", "host:", "127.0.0.1:99999"):
        with pytest.raises(DescriptionError, match="--opcua"):
            address_of(wrong)


def test_the_verb_serves_it_on_this_machine(port):
    verb = ["encoder", "mining-loader", "--unit", "boom", "--interface", "virtual", "--channel", "test",
            "--node-id", "6", "--drive-node", "5", "--rated-torque", "80 N m", "--opcua", str(port)]  # fmt: skip
    with subprocess.Popen([sys.executable, "-m", "ramsight", *verb], stdout=subprocess.PIPE, text=True) as process:
        try:
            said = [process.stdout.readline(), process.stdout.readline()]
            wait_for(lambda: values(port, "Status")[0] == (255, "Good"))
            assert values(port, "Position")[0][1] == "BadWaitingForInitialData"
        finally:
            process.send_signal(signal.SIGTERM)
            said.append(process.stdout.read())
    assert process.returncode == 0
    assert said[1] == f"opc.tcp://127.0.0.1:{port}/ramsight: read only\n"
