"""Places of visitors, and processes that are spawned for them."""

import asyncio
import os
import threading
import time

from ramsight.studio.session import Place, Visitors
from ramsight.studio.spawned import Spawned


class Slow:
    """A session whose process takes a while to end."""

    def __init__(self, room):
        self.room, self.there = room, []

    def close(self):
        time.sleep(0.05)
        self.there.append(self.room.there)


def test_a_place_is_free_once_the_machine_of_who_had_it_has_ended():
    async def visit():
        room = Visitors(1)
        assert room.come()
        place = Place(room)
        async with place.changing:
            leaving = asyncio.create_task(place.leave())  # he goes while his machine is being started
            await asyncio.sleep(0)
            place.session = Slow(room)
        assert not room.come(), "the process is still there"
        await leaving
        return place.session.there, room.come()

    assert asyncio.run(visit()) == ([1], True)


def test_who_goes_before_he_has_a_machine_leaves_his_place():
    async def visit():
        room = Visitors(1)
        assert room.come()
        await Place(room).leave()
        return room.come()

    assert asyncio.run(visit())


def descriptors():
    return len(os.listdir("/proc/self/fd"))


def test_a_process_that_is_ended_leaves_nothing_and_may_be_asked_afterwards():
    Spawned(time.sleep, 0.0, name="first").end()  # what is made once is made
    before = descriptors()
    process = Spawned(time.sleep, 600.0, name="sleeper")
    assert process.alive
    process.end()
    process.end()
    assert not process.alive
    assert process.code() == -15
    assert descriptors() == before


def test_a_process_can_be_ended_while_somebody_waits_for_its_code():
    process, found = Spawned(time.sleep, 30.0, name="sleeper"), []
    waiting = threading.Thread(target=lambda: found.append(process.code()), daemon=True)
    waiting.start()
    time.sleep(0.1)
    begun = time.monotonic()
    process.end()
    waiting.join(10.0)
    assert time.monotonic() - begun < 10.0
    assert found == [-15]
