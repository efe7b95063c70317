"""A small OPC UA server beside the encoder: position, what it is worth, and nothing that can be written."""

from __future__ import annotations

import asyncio
import threading
import time
from datetime import UTC, datetime
from types import TracebackType
from typing import Any, Self

from ramsight.deploy.encoder.encoder import Encoder
from ramsight.deploy.encoder.quality import STALE, WAITING, Said, said_by
from ramsight.errors import DescriptionError, RamsightError
from ramsight.logs.source import needs

NAMESPACE = "urn:ramsight:encoder"
PERIOD = 0.1
"""Between two updates [s]."""
_OLD = 1.0  # s without a word of the encoder, after which nothing is good any more
_START = 30.0  # s
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


class OpcuaError(RamsightError):
    """A server that cannot be started."""


def address_of(words: str) -> tuple[str, int]:
    """Host and port as an option has them.

    Raises:
        DescriptionError: they cannot be read.

    Example:
        >>> address_of("127.0.0.1:4840"), address_of("4840")
        (('127.0.0.1', 4840), ('127.0.0.1', 4840))
    """
    host, _, port = words.strip().rpartition(":")
    if not (port.isascii() and port.isdigit() and len(port) <= 5) or not 0 < int(port) < 1 << 16:
        raise DescriptionError("is no address", key="--opcua", value=words, allowed="a port, or '127.0.0.1:4840'")
    return host or "127.0.0.1", int(port)


class OpcuaServer:
    """Offers what an encoder reports, in a thread of its own, so that no client delays a frame.

    Anybody who reaches the address may read and nobody may write; there is no encryption, so it stays on this machine
    (127.0.0.1) unless another address is asked for.

    Args:
        encoder: whose position it is.
        name: of its object, the unit's.
        host, port: where it is found.

    Raises:
        OpcuaError: it cannot be started there.
        LogError: asyncua is not installed.
    """

    def __init__(self, encoder: Encoder, name: str, host: str = "127.0.0.1", port: int = 4840) -> None:
        self.endpoint = f"opc.tcp://{host}:{port}/ramsight"
        self._asyncua: Any = needs("asyncua", "opcua", self.endpoint)
        self._encoder, self._name = encoder, name
        self._said: tuple[float, datetime, Said] | None = None
        self._next = -1.0
        self._stop, self._ready = threading.Event(), threading.Event()
        self._failure: Exception | None = None
        self._thread = threading.Thread(target=self._run, name="opcua", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        if not self._ready.wait(_START) or self._failure is not None:
            self._stop.set()
            text = " ".join(str(self._failure or "it does not start").split())
            raise OpcuaError(f"{self.endpoint}: cannot be served: {text}")
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self._stop.set()
        self._thread.join()

    def take(self) -> None:
        """Take over what the encoder reports, if it is time to; called by the thread that runs the encoder."""
        now = time.monotonic()
        if now >= self._next:
            self._next = now + PERIOD
            self._said = now, datetime.now(UTC), said_by(self._encoder)

    def _run(self) -> None:
        try:
            asyncio.run(self._serve())
        except Exception as error:  # whatever it is, the encoder goes on
            self._failure = error
        finally:
            self._ready.set()

    async def _serve(self) -> None:
        server = await self._made()
        async with server:
            values = await self._offered(server)
            self._ready.set()
            while not self._stop.is_set():
                for attribute, node in values.items():
                    await node.write_value(self._value(attribute))
                await asyncio.sleep(PERIOD)

    async def _made(self) -> Any:
        """A server that anybody may read and nobody may change."""
        rules: Any = needs("asyncua.crypto.permission_rules", "opcua", self.endpoint)
        ua = self._asyncua.ua
        server = self._asyncua.Server(user_manager=_Readers(rules))
        await server.init()
        server.set_endpoint(self.endpoint)
        server.set_server_name("ramsight encoder")
        server.set_security_policy([ua.SecurityPolicyType.NoSecurity], permission_ruleset=rules.SimpleRoleRuleset())
        server.set_identity_tokens([ua.AnonymousIdentityToken])
        return server

    async def _offered(self, server: Any) -> dict[str, Any]:
        """The object with its variables, by the attributes of `Said`."""
        ua = self._asyncua.ua
        space = await server.register_namespace(NAMESPACE)
        place = await server.nodes.objects.add_object(space, self._name)
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
            nothing: Any = {"status": 255, "text": "", "referenced": False}.get(attribute, float("nan"))
            return ua.DataValue(ua.Variant(nothing, kind), ua.StatusCode(getattr(ua.StatusCodes, WAITING)))
        at, when, said = self._said
        quality = "Good" if attribute in kinds else said.quality
        if time.monotonic() - at > _OLD:
            quality = STALE
        value = ua.Variant(getattr(said, attribute), kind)
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
