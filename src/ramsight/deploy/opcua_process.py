"""The process that serves OPC UA, on behalf of `ramsight.deploy.encoder.opcua`.

Whoever can reach the port can keep a server busy; here that costs this process time and memory, and the encoder none.
It knows nothing of encoders, takes what is to be offered from a pipe, and ends with it.
"""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import time
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from multiprocessing.connection import Connection
from typing import Any

from ramsight.errors import RamsightError
from ramsight.optional import imported

PERIOD = 0.1
"""Between two updates [s]."""
NAMESPACE = "urn:ramsight:encoder"
READY, TAKEN = "ready", "taken"
"""What it answers: that it serves; that it has taken what was said last."""
MOST_CLIENTS = 32
"""At a time; a control room has a few."""
NEW_CLIENTS, FIRST_CLIENTS = 10.0, 20
"""Connections that are taken a second, and at once; a thousand would be a flood."""
_SESSION_WITHIN = 5.0  # s; for which a connection may stay without a session
_NICE = 10  # of a process that gives way to the encoder's
_UNECE = "http://www.opcfoundation.org/UA/units/un/cefact"
_LENGTH, _VELOCITY = ("MTR", "m"), ("MTS", "m/s")
_NUMBERS = (
    ("Position", "position", _LENGTH, "of the piston, 0 = fully retracted"),
    ("Velocity", "velocity", _VELOCITY, "of the piston, extension positive"),
    ("StandardDeviation", "std", _LENGTH, "of the position"),
    ("Bound", "bound", _LENGTH, "one error of the position in 100 000 exceeds it"),
)
_WORDS = (
    ("Status", "status", "Byte", "number of the sensor's status; 255: no sample yet"),
    ("Text", "text", "String", "what is wrong, or the position"),
    ("Referenced", "referenced", "Boolean", "whether a reference has come since power-up"),
)
_NOTHING: dict[str, Any] = {"status": 255, "text": "", "referenced": False}


@dataclass(frozen=True)
class Serving:
    """What is served where."""

    # host, port: where it is found
    host: str
    port: int
    name: str  # of its object
    # waiting, stale: names of the status codes before anything was said, and after nothing was said for long
    waiting: str
    stale: str
    old: float  # for how long a word is good [s]

    @property
    def endpoint(self) -> str:
        """Its address as a client has it."""
        return f"opc.tcp://{self.host}:{self.port}/ramsight"


class Door:
    """Lets in so many connections a second, and a few at once.

    Example:
        >>> door = Door(10.0, 2)
        >>> [door.opens(now) for now in (0.0, 0.0, 0.0, 0.05, 0.1)]
        [True, True, False, False, True]
    """

    def __init__(self, rate: float, most: int) -> None:
        self._rate, self._most = rate, float(most)
        self._left, self._at = self._most, 0.0

    def opens(self, now: float) -> bool:
        """Whether one more may come in.

        Args:
            now: [s], runs only forward.
        """
        self._left = min(self._left + self._rate * (now - self._at), self._most)
        self._at = now
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True


class _TurnedAway(asyncio.Protocol):
    """A connection that is closed as it comes."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        transport.abort()  # type: ignore[attr-defined]


class _Loop(asyncio.SelectorEventLoop):
    """A loop whose servers take no more connections than a door lets in, whatever protocol they speak."""

    def __init__(self) -> None:
        super().__init__()
        self._door = Door(NEW_CLIENTS, FIRST_CLIENTS)

    async def create_server(self, protocol_factory: Any, *where: Any, **how: Any) -> Any:
        def let_in() -> asyncio.BaseProtocol:
            protocol: asyncio.BaseProtocol = protocol_factory() if self._door.opens(self.time()) else _TurnedAway()
            return protocol

        return await super().create_server(let_in, *where, **how)


def serve(pipe: Connection, what: Serving) -> None:
    """Serve until the pipe's other end is closed; answers with `READY`, or with what is wrong.

    Args:
        pipe: brings values by their names, one set at a time, and takes the answers.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the program that started it
    logging.disable(logging.CRITICAL)
    if hasattr(os, "nice"):
        os.nice(_NICE)
    try:
        with asyncio.Runner(loop_factory=_Loop) as runner:
            runner.run(_Server(pipe, what).run())
    except Exception as error:  # whatever it is, the encoder says it and goes on
        with suppress(OSError):
            pipe.send(" ".join(str(error).split()) or type(error).__name__)


class _Server:
    """A server, and what was said last."""

    def __init__(self, pipe: Connection, what: Serving) -> None:
        self._asyncua: Any = imported("asyncua", "opcua", RamsightError)
        self._pipe, self._what = pipe, what
        self._said: tuple[float, datetime, dict[str, Any]] | None = None

    async def run(self) -> None:
        """Offer what comes through the pipe."""
        server = await self._made()
        async with server:
            values = await self._offered(server)
            self._pipe.send(READY)
            while self._heard():
                for attribute, node in values.items():
                    await node.write_value(self._value(attribute))
                await asyncio.sleep(PERIOD)

    def _heard(self) -> bool:
        """Take what has been said; False once nobody will say anything more."""
        try:
            while self._pipe.poll():
                self._said = time.monotonic(), datetime.now(UTC), self._pipe.recv()
                self._pipe.send(TAKEN)
        except (EOFError, OSError):
            return False
        return True

    async def _made(self) -> Any:
        """A server that anybody may read and nobody may change, with limits."""
        rules: Any = imported("asyncua.crypto.permission_rules", "opcua", RamsightError)
        ua = self._asyncua.ua
        server = self._asyncua.Server(user_manager=_Readers(rules))
        await server.init()
        server.iserver.max_connections = MOST_CLIENTS
        server.iserver.max_pending_activation_seconds = _SESSION_WITHIN
        server.set_endpoint(self._what.endpoint)
        server.set_server_name("ramsight encoder")
        server.set_security_policy([ua.SecurityPolicyType.NoSecurity], permission_ruleset=rules.SimpleRoleRuleset())
        server.set_identity_tokens([ua.AnonymousIdentityToken])
        return server

    async def _offered(self, server: Any) -> dict[str, Any]:
        """The object with its variables, by the names of what is said."""
        ua = self._asyncua.ua
        space = await server.register_namespace(NAMESPACE)
        place = await server.nodes.objects.add_object(space, self._what.name)
        found = {}
        none = None, ua.VariantType.Null  # any type may be written over it
        for name, attribute, (code, shown), text in _NUMBERS:
            node = await place.add_variable(space, name, *none, datatype=ua.NodeId(ua.ObjectIds.Double))
            unit = ua.EUInformation(
                _UNECE, int.from_bytes(code.encode(), "big"), ua.LocalizedText(shown), ua.LocalizedText(shown)
            )
            await node.add_property(0, "EngineeringUnits", unit)
            found[attribute] = (node, text)
        for name, attribute, kind, text in _WORDS:
            number = ua.NodeId(getattr(ua.ObjectIds, kind))
            found[attribute] = (await place.add_variable(space, name, *none, datatype=number), text)
        for attribute, (node, text) in found.items():
            await node.write_value(self._value(attribute))
            await node.write_attribute(ua.AttributeIds.Description, ua.DataValue(ua.LocalizedText(text)))
        return {attribute: node for attribute, (node, _) in found.items()}

    def _value(self, attribute: str) -> Any:
        """A value with its quality and time; never good if the encoder has not spoken lately."""
        ua = self._asyncua.ua
        kinds = {attribute: getattr(ua.VariantType, kind) for _, attribute, kind, _ in _WORDS}
        kind = kinds.get(attribute, ua.VariantType.Double)
        if self._said is None:
            nothing = _NOTHING.get(attribute, float("nan"))
            return ua.DataValue(ua.Variant(nothing, kind), ua.StatusCode(getattr(ua.StatusCodes, self._what.waiting)))
        at, when, said = self._said
        quality = "Good" if attribute in kinds else said["quality"]
        if time.monotonic() - at > self._what.old:
            quality = self._what.stale
        value = ua.Variant(said[attribute], kind)
        return ua.DataValue(value, ua.StatusCode(getattr(ua.StatusCodes, quality)), SourceTimestamp=when)


class _Readers:
    """Every client is a user, and no administrator, whatever it calls itself."""

    def __init__(self, rules: Any) -> None:
        self._rules = rules

    def get_user(
        self, iserver: Any, username: str | None = None, password: str | None = None, certificate: Any = None
    ) -> Any:
        """Give every client the rights of a plain user."""
        return self._rules.User(role=self._rules.UserRole.User)
