"""What a machine's first start compiles: once, by whoever has time, whatever becomes of the others."""

import os
import subprocess
import sys
import threading
import time
from contextlib import closing

import pytest

from ramsight import machine
from ramsight.errors import SimulationError
from ramsight.studio import first_start
from ramsight.studio.first_start import Piece, is_made, make, pieces
from ramsight.studio.session import Session
from ramsight.studio.spawned import Spawned
from ramsight.system import lock

from .waiting import wait_for

pytest.importorskip("nicegui", reason="needs the extra studio")

PRESS = machine.load_machine("press")


@pytest.fixture(autouse=True)
def empty(monkeypatch, tmp_path):
    """An empty cache, which others may not write into."""
    monkeypatch.setenv("RAMSIGHT_CACHE", str(tmp_path / "cache"))


class Counted:
    """Pieces that take a moment; who made which."""

    def __init__(self, monkeypatch, takes=0.02):
        self.made, self.takes = [], takes
        names = ("first", "second", "third", "fourth")
        found = [Piece(name, f"the {name}", lambda name=name: self.make(name)) for name in names]
        monkeypatch.setattr(first_start, "pieces", lambda machine: found)

    def make(self, name):
        time.sleep(self.takes)
        self.made.append(name)


def path(name):
    (found,) = (piece for piece in first_start.pieces(PRESS) if piece.name == name)
    return first_start.cache_directory() / f"{first_start._key(found, PRESS)}.lock"


def hold(place):
    """Have a lock for as long as the process lives."""
    held = lock(place)
    place.with_suffix(".held").touch()
    time.sleep(600.0)
    held.release()


def test_each_piece_is_made_once_whoever_makes_it_and_who_waits_ends_when_all_are_there(monkeypatch):
    counted = Counted(monkeypatch)
    assert not is_made(PRESS)
    others = [threading.Thread(target=make, args=(PRESS,)) for _ in range(3)]
    for one in others:
        one.start()
    make(PRESS)
    assert sorted(counted.made) == ["first", "fourth", "second", "third"]
    assert is_made(PRESS)
    for one in others:
        one.join()
    make(PRESS)
    assert len(counted.made) == 4, "a second start makes nothing"


def test_what_is_made_is_said_by_name_and_how_far_it_is(monkeypatch):
    Counted(monkeypatch)
    said = []
    make(PRESS, said.append)
    assert [text.split(";")[0] for text in said] == [
        "first start: compiling the first, 0 of 4 are ready", "first start: compiling the second, 1 of 4 are ready",
        "first start: compiling the third, 2 of 4 are ready", "first start: compiling the fourth, 3 of 4 are ready",
    ]  # fmt: skip


@pytest.mark.posix
def test_what_a_killed_process_was_making_is_made_by_another(monkeypatch):
    counted = Counted(monkeypatch)
    place = path("second")
    process = Spawned(hold, place, name="holder")
    wait_for(place.with_suffix(".held").exists)
    make(PRESS, waits=False)
    assert counted.made == ["first", "third", "fourth"], "who does not wait leaves what another has"
    said = []
    waiting = threading.Thread(target=make, args=(PRESS, said.append))
    waiting.start()
    wait_for(lambda: len(said) > 2)
    assert "the second, 3 of 4" in said[-1]
    assert "second" not in counted.made
    process.end()
    waiting.join(30.0)
    assert counted.made[3:] == ["second"]


def test_without_a_folder_that_can_be_locked_a_process_makes_all_itself(monkeypatch):
    counted = Counted(monkeypatch)

    def refused(place):
        raise OSError("no locks there")

    monkeypatch.setattr(first_start, "lock", refused)
    monkeypatch.setattr(first_start, "keep", lambda key, found: None)
    make(PRESS)
    assert counted.made == ["first", "second", "third", "fourth"]


def test_an_error_reaches_who_needs_the_piece_and_leaves_no_lock(monkeypatch):
    counted = Counted(monkeypatch)
    monkeypatch.setattr(counted, "make", lambda name: (_ for _ in ()).throw(SimulationError("dry")))
    with pytest.raises(SimulationError, match="dry"):
        make(PRESS)
    first_start.help_making(PRESS)  # who only helps says nothing
    lock(path("first")).release()


def test_a_piece_that_was_made_with_less_optimization_is_not_made(monkeypatch):
    Counted(monkeypatch)
    make(PRESS)
    assert is_made(PRESS)
    monkeypatch.setenv("RAMSIGHT_OPTIMIZE", "yes" if os.environ.get("RAMSIGHT_OPTIMIZE") == "no" else "no")
    assert not is_made(PRESS)


def test_a_machine_that_cannot_be_kept_is_left_to_its_own_process(monkeypatch):
    counted = Counted(monkeypatch)
    monkeypatch.setattr(first_start, "key_of", lambda *described: None)
    make(PRESS)
    assert not counted.made
    assert is_made(PRESS), "no process helps with it"


@pytest.mark.parametrize("name", ["press", "mining-loader"])
def test_pieces_have_words_and_the_longest_come_first(name):
    found = pieces(machine.load_machine(name))
    assert len({piece.name for piece in found}) == len({piece.words for piece in found}) == len(found)
    assert found[0].name.startswith("kalman")


_RUN = """
import os, sys
from ramsight import machine
from ramsight.engine.private_folder import cache_directory
from ramsight.studio.first_start import make
from ramsight.studio.rig import Rig

def there():
    return {name for name in os.listdir(cache_directory()) if not name.startswith("made_")}

if __name__ == "__main__":
    described = machine.load_machine("press")
    if sys.argv[1] == "make":
        make(described)
    before = there()
    rig = Rig(described)
    rig.step()
    print(sorted(there() - before), len(before))
"""


def said(how):
    done = subprocess.run([sys.executable, "-c", _RUN, how], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_pieces_are_all_that_the_first_sample_needs():
    assert said("make").startswith("[] "), "a piece is missing in first_start.pieces"


@pytest.mark.slow
def test_a_session_says_what_is_compiled_and_its_helpers_end():
    with closing(Session(PRESS)) as session:
        assert session._helpers or first_start.helpers() == 0
        wait_for(lambda: session.making or session.ended)
        assert "compiling" in session.making
        wait_for(lambda: session.about is not None or session.ended)
        assert session.about is not None, session.ended
        assert not any(one.alive for one in session._helpers)
    with closing(Session(PRESS)) as session:
        assert not session._helpers, "nothing is left to be compiled"


@pytest.mark.slow
def test_a_machine_that_waits_stands_until_somebody_looks():
    from ramsight.studio import web_server

    first = [Session("press", waits=True)]
    wait_for(lambda: first[0].about is not None or first[0].ended)
    assert first[0].about is not None, first[0].ended
    time.sleep(0.3)
    assert not first[0].frames()
    with closing(web_server._waiting(first)) as session:
        session.go_on()
        wait_for(session.frames)
    assert web_server._waiting(first) is None


@pytest.mark.slow
def test_a_waiting_machine_whose_process_was_killed_is_not_handed_out():
    from ramsight.studio import web_server

    session = Session("press", waits=True)
    wait_for(lambda: session.about is not None or session.ended)
    session._process.end()
    assert web_server._waiting([session]) is None
