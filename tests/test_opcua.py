"""The OPC UA server beside the encoder, as a client of another library's own sees it."""

import asyncio
import math
import signal
import socket
import subprocess
import sys
import time

import pytest

from ramsight.deploy.encoder.alarms import Fault
from ramsight.deploy.encoder.frame import Frame
from ramsight.deploy.encoder.opcua import QUALITY, OpcuaError, OpcuaServer, address_of, quality_of
from ramsight.deploy.opcua_process import FIRST_CLIENTS, MOST_CLIENTS, NAMESPACE
from ramsight.errors import DescriptionError

from .encoder_bus import Master, encoder
from .waiting import PATIENCE, wait_for

asyncua = pytest.importorskip("asyncua")
START = "ramsight.deploy.encoder.opcua._START"
NUMBERS = ("Position", "Velocity", "StandardDeviation", "Bound")


@pytest.fixture(autouse=True)
def patient(monkeypatch):
    """A busy computer may need longer to begin a process."""
    monkeypatch.setattr(START, PATIENCE)


def a_port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


@pytest.fixture
def port():
    return a_port()


@pytest.fixture(scope="module")
def served():
    """The port of a server that serves what no sensor has said yet: for who asks for what never changes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(START, PATIENCE)
        port = a_port()
        with OpcuaServer(encoder(), "boom", port=port):
            yield port


def asked(port, what, user=None):
    """What a coroutine of a client gives."""

    async def ask():
        client = asyncua.Client(f"opc.tcp://127.0.0.1:{port}/ramsight", timeout=20.0)
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


def comes(condition):
    """Wait until it holds, slowly enough for a server that turns away who comes too often."""

    def holds():
        try:
            return condition()
        except (ConnectionError, TimeoutError):  # turned away, or a busy computer
            return False

    wait_for(holds, lambda: time.sleep(2.0 / FIRST_CLIENTS))


def test_a_client_reads_the_position_with_what_it_is_worth(port):
    device = encoder()
    bus = Master(device)
    with OpcuaServer(device, "boom", port=port, old=PATIENCE) as server:

        def offered(code, *names):
            found = []

            def came():
                server._next = -1.0
                server.take()
                found[:] = values(port, *names)
                return found[0][1] == code

            comes(came)
            return found

        assert values(port, *NUMBERS)[0][1] == "BadWaitingForInitialData", "nobody has said anything yet"
        bus.put(0.5, _warm(bus))
        bus.rest(0.2)
        for value, code in offered("BadWaitingForInitialData", *NUMBERS):
            assert code == "BadWaitingForInitialData"
            assert value is None or math.isnan(value)
        bus.node.sdo[0x6003].raw = 10000
        bus.rest(0.2)
        found = offered("Good", *NUMBERS, "Status", "Referenced")
        assert found[0] == (pytest.approx(0.1, abs=1e-4), "Good")
        assert [code for _, code in found] == ["Good"] * 6
        assert found[2][0] < found[3][0] < 0.05
        assert [value for value, _ in found[4:]] == [0, True]

        bus.node.sdo[0x2100].raw = -(1 << 15)
        assert offered("UncertainSubNormal", "Position")[0][0] == pytest.approx(0.1, abs=1e-4)
        bus.pass_time(bus.now + 1.0)
        silent = offered("BadNoCommunication", "Position", "Text")
        assert silent[0][0] is None or math.isnan(silent[0][0])
        assert "drive silent" in silent[1][0]


def _warm(bus):
    bus.node.sdo[0x2100].raw = 400
    return Frame(0x80)


def referenced():
    """An encoder that has been told where the piston is."""
    device = encoder()
    bus = Master(device)
    bus.node.sdo[0x2100].raw = 400
    bus.rest(0.2)
    bus.node.sdo[0x6003].raw = 10000
    return device


@pytest.mark.slow
def test_what_the_encoder_said_before_the_server_began_is_served_and_is_not_good_once_it_is_old(port):
    server = OpcuaServer(referenced(), "boom", port=port, old=3.0)
    server.take()
    with server:

        def is_good():
            found = values(port, "Position", "Status")
            if found[0][1] == "BadNoCommunication":  # a busy computer asked so late that it is old: said once more
                server.take()
            return found[0] == (pytest.approx(0.1, abs=1e-4), "Good")

        comes(is_good)
        comes(lambda: values(port, "Position", "Status")[1][1] == "BadNoCommunication")
        assert values(port, "Position")[0][1] == "BadNoCommunication"


@pytest.mark.parametrize("user", [None, "admin"])
def test_nobody_writes(served, user):
    ua = asyncua.ua

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
        assert not asked(served, write).StatusCode.is_good()
    else:
        with pytest.raises(ua.UaStatusCodeError, match="BadIdentityToken"):
            asked(served, write, user)


def test_units_stand_beside_the_numbers(served):
    async def read(client, space):
        place = await client.nodes.objects.get_child([f"{space}:boom"])
        units = [await place.get_child([f"{space}:{name}", "0:EngineeringUnits"]) for name in NUMBERS]
        return [(await unit.read_value()).DisplayName.Text for unit in units]

    assert asked(served, read) == ["m", "m/s", "m", "m"]


def test_what_makes_a_position_invalid_is_bad_and_nothing_wrong_is_good():
    assert set(QUALITY) == set(Fault)
    for fault, code in QUALITY.items():
        assert code.startswith("Bad") == bool(fault.alarm), fault
        assert code.startswith(("Bad", "Uncertain"))
        assert getattr(asyncua.ua.StatusCodes, code)
        assert quality_of(frozenset({fault, Fault.GAP}), valid=not fault.alarm) != "Good"
    assert quality_of(frozenset(), valid=False).startswith("Bad")


@pytest.mark.slow
def test_a_port_that_is_taken_and_words_that_are_none_are_refused(port):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", port))
        taken.listen()
        with pytest.raises(OpcuaError, match=rf"opc\.tcp://127\.0\.0\.1:{port}/ramsight: cannot be served"):
            OpcuaServer(encoder(), "boom", port=port).__enter__()
    for wrong in ("", "host", "host:", "127.0.0.1:99999"):
        with pytest.raises(DescriptionError, match="--opcua"):
            address_of(wrong)


def is_closed(connection):
    """Whether the other end has closed it."""
    try:
        return connection.recv(1) == b""
    except ConnectionError:
        return True
    except TimeoutError:
        return False


@pytest.mark.slow
def test_a_flood_of_connections_is_turned_away_and_delays_nobody(port):
    """Malformed ones, of which some stay open; the encoder's loop passes its values on meanwhile."""
    device = encoder()
    with OpcuaServer(device, "boom", port=port, old=PATIENCE) as server:
        kept = []
        for _ in range(10 * FIRST_CLIENTS):
            one = socket.create_connection(("127.0.0.1", port))
            one.sendall(b"HELF" + bytes(60))
            kept.append(one)
            server._next = -1.0
            server.take()
            one.settimeout(0.05)

        def turned_away():
            return sum(map(is_closed, kept)) >= len(kept) - MOST_CLIENTS - FIRST_CLIENTS

        comes(turned_away)
        for one in kept:
            one.close()
        comes(lambda: values(port, "Status")[0][1] == "Good")


@pytest.mark.slow
def test_a_server_that_has_ended_is_no_matter_to_the_encoder(port):
    with OpcuaServer(encoder(), "boom", port=port) as server:
        server._process.kill()
        server._process.join()
        for _ in range(3):
            server._next = -1.0
            server.take()


@pytest.mark.slow
def test_the_verb_serves_it_on_this_machine(port):
    verb = ["encoder", "mining-loader", "--unit", "boom", "--interface", "virtual", "--channel", "test",
            "--node-id", "6", "--drive-node", "5", "--rated-torque", "80 N m", "--opcua", str(port)]  # fmt: skip
    with subprocess.Popen([sys.executable, "-m", "ramsight", *verb], stdout=subprocess.PIPE, text=True) as process:
        try:
            said = [process.stdout.readline(), process.stdout.readline()]
            comes(lambda: values(port, "Status")[0] == (255, "Good"))
            assert values(port, "Position")[0][1] == "BadWaitingForInitialData"
        finally:
            process.send_signal(signal.SIGTERM)
            said.append(process.stdout.read())
    assert process.returncode == 0
    assert said[1] == f"opc.tcp://127.0.0.1:{port}/ramsight: read only\n"
