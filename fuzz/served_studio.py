"""A studio that serves, visitors without a browser, and what is measured of the server meanwhile."""

from __future__ import annotations

import contextlib
import ctypes
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import urllib.error
import urllib.request
import uuid
from pathlib import Path
from typing import Any, Self

import psutil
from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, connect

_PATIENCE = 60.0  # s, for one answer
_EVERY = 0.2  # s, from one look at the server to the next
_DIES_WITH_PARENT = 1  # PR_SET_PDEATHSIG


def _with_parent() -> None:
    ctypes.CDLL(None).prctl(_DIES_WITH_PARENT, signal.SIGTERM)


class ServedStudio:
    """A studio in a process of its own.

    Args:
        visitors: that are let in at a time.
        folder: for what the server says.

    Attributes:
        address: of its page, for a browser.
        server: its process.
    """

    def __init__(self, visitors: int, folder: Path) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.address, self._log = f"http://127.0.0.1:{self.port}/", folder / "studio.log"
        words = ["studio", "mining-loader", "--visitors", str(visitors), "--no-show", "--port", str(self.port)]
        # NiceGUI takes a process for a test of itself where it sees the variable of pytest.
        environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
        with self._log.open("w") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "ramsight", *words], stdout=log, stderr=log, env=environment,
                preexec_fn=_with_parent,
            )  # fmt: skip
        self.server = psutil.Process(self._process.pid)
        until = time.monotonic() + _PATIENCE
        while True:
            with contextlib.suppress(OSError):
                self.get()
                return
            if time.monotonic() > until or self._process.poll() is not None:
                raise RuntimeError(f"the studio does not serve: {self.said()}")
            time.sleep(_EVERY)

    def get(self, **headers: str) -> tuple[int, str]:
        """Status and text of the page, also of a refusal."""
        asked = urllib.request.Request(self.address, headers=headers)
        try:
            answer = urllib.request.urlopen(asked, timeout=_PATIENCE)
        except urllib.error.HTTPError as refused:
            answer = refused
        with answer:
            return answer.status, answer.read().decode(errors="replace")

    def machines(self) -> list[psutil.Process]:
        """Processes of machines."""
        found = []
        for one in self.server.children(recursive=True):
            with contextlib.suppress(psutil.NoSuchProcess):  # a zombie is one, too
                if "spawn_main" in " ".join(one.cmdline()):
                    found.append(one)
        return found

    def settled(self, seconds: float) -> int:
        """Wait until no machine runs; how many are left after so long."""
        until = time.monotonic() + seconds
        while self.machines() and time.monotonic() < until:
            time.sleep(_EVERY)
        return len(self.machines())

    def kept(self) -> tuple[float, int]:
        """What the server has: memory [MiB] and file descriptors."""
        return self.server.memory_info().rss / 2**20, self.server.num_fds()

    def said(self) -> str:
        """What the server has written so far."""
        return self._log.read_text(errors="replace")

    def end(self) -> None:
        """End it."""
        self._process.terminate()
        self._process.wait(_PATIENCE)


class Visitor:
    """One who opens the page and its socket as a browser does, and draws nothing.

    Args:
        studio: that he visits.
    """

    def __init__(self, studio: ServedStudio) -> None:
        _, page = studio.get()
        found = re.search(r"['\"]client_id['\"]:\s*['\"]([0-9a-f-]{36})", page)
        if found is None:
            raise RuntimeError("the page names no client")
        query = f"EIO=4&transport=websocket&client_id={found[1]}&tab_id={uuid.uuid4()}&document_id={uuid.uuid4()}"
        query += "&implicit_handshake=true&next_message_id=0"
        opened = connect(
            f"ws://127.0.0.1:{studio.port}/_nicegui_ws/socket.io/?{query}", origin=studio.address.rstrip("/"),
            open_timeout=_PATIENCE, close_timeout=1.0, max_size=None, proxy=None,
        )  # fmt: skip
        self.socket: ClientConnection = contextlib.ExitStack().enter_context(opened)
        self.socket.recv(_PATIENCE)
        self.socket.send("40")

    def sees(self, seconds: float) -> str:
        """What he gets: `machine`, `full`, or nothing within so long."""
        until, texts = time.monotonic() + seconds, ""
        with contextlib.suppress(TimeoutError, WebSocketException):
            while time.monotonic() < until:
                said = self.socket.recv(max(until - time.monotonic(), 0.0))
                if said == "2":
                    self.socket.send("3")
                texts += said if isinstance(said, str) else said.decode(errors="replace")
                if "--visitors" in texts:
                    return "full"
                if "the machine is being made ready" in texts:
                    return "machine"
        return ""

    def drop(self) -> None:
        """Break the connection off, as a computer does that loses its power: a reset, no word of the protocol."""
        raw = self.socket.socket
        with contextlib.suppress(OSError):  # the server may have closed it
            raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            raw.shutdown(socket.SHUT_RD)
        raw.close()


class Watched:
    """Looks at a studio while a block runs: how many machines there were, how long others waited for its page.

    Args:
        studio: that is looked at.

    Attributes:
        most: machines at a time.
        waited: the longest that somebody else waited for the page [s].
    """

    def __init__(self, studio: ServedStudio) -> None:
        self._studio, self._done = studio, threading.Event()
        self.most, self.waited = 0, 0.0
        self._threads = [threading.Thread(target=one, daemon=True) for one in (self._count, self._ask)]

    def __enter__(self) -> Self:
        """Begin to look."""
        for one in self._threads:
            one.start()
        return self

    def __exit__(self, *_: Any) -> None:
        """Look no more."""
        self._done.set()
        for one in self._threads:
            one.join()

    def _count(self) -> None:
        while not self._done.wait(_EVERY):
            self.most = max(self.most, len(self._studio.machines()))

    def _ask(self) -> None:
        while not self._done.wait(_EVERY):
            begun = time.monotonic()
            with contextlib.suppress(OSError):
                self._studio.get()
            self.waited = max(self.waited, time.monotonic() - begun)


def try_it() -> None:
    """Serve, visit, drop, and print what came of it."""
    with tempfile.TemporaryDirectory() as folder:
        studio = ServedStudio(2, Path(folder))
        print(studio.kept())
        with Watched(studio) as watched:
            visitors = [Visitor(studio) for _ in range(4)]
            print([one.sees(20.0) for one in visitors])
            time.sleep(3)
            print(len(studio.machines()))
            for one in visitors:
                one.drop()
            print(studio.settled(20.0))
        print(watched.most, watched.waited, studio.kept())
        print(studio.said())
        studio.end()


if __name__ == "__main__":
    try_it()
