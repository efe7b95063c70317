"""Logs in MCAP files (``.mcap``): messages in JSON, CDR or protobuf, each topic with times of its own."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.errors import DescriptionError, LogError, warn_of_log
from ramsight.logs.align import Block, Samples
from ramsight.logs.arrival import arrivals
from ramsight.logs.clock_watch import ClockWatch, warn_of_clocks, warn_of_watched
from ramsight.logs.lines import Advance, first_line
from ramsight.logs.mapped import ChannelMap, Timed
from ramsight.logs.mcap_content import DAMAGED, MOST_LISTED, Contents, Decoder, unpacked_chunk
from ramsight.logs.packed import opened
from ramsight.logs.row_clock import rising, whole_clock
from ramsight.logs.source import Offered, Source, needs, unit_in_name
from ramsight.units.algebra import NANOSECONDS

_AT_ONCE = 1 << 14  # messages
_LARGEST = 1 << 28  # bytes of a record; a recorder's chunk has a few million
_LISTED = 6  # topics in a message
_FIRST_MESSAGES = 20  # of a topic, that are looked into where no schema says what it has
_DEEPEST = 8  # objects in objects
UNITS = {"JointState": {"position": "rad", "velocity": "rad/s", "effort": "N m"}}
"""Units of messages of ROS, as the definition of sensor_msgs/JointState states them for joints that turn."""
_IN_LIST = re.compile(r"(.*)\[([0-9]{1,3})\]")
_SECONDS = (("sec", "nanosec"), ("secs", "nsecs"), ("seconds", "nanos"), ("sec", "nsec"))
"""Fields of a time stamp in messages of ROS 2, ROS 1 and protobuf."""
_NUMBERS = {"number", "integer", "boolean"}


class McapSource(Source):
    """An MCAP file with messages in JSON, CDR (ROS 2) or protobuf.

    A channel is a field (``OBJECT.FIELD`` in objects), ``TOPIC/FIELD`` where several topics have it.
    A field that the schema has and a message has not is missing there. Messages came in the order of the file, those of
    one time stamp together.
    """

    has_clock_watched = True

    def __init__(self, path: str | Path, file_map: ChannelMap | None = None, advance: Advance | None = None) -> None:
        super().__init__(path, advance)
        self._mcap: Any = needs("mcap.stream_reader", "logs", self.file)
        self._known: Any = needs("mcap.records", "logs", self.file)
        packing: Any = needs("zstandard", "logs", self.file)
        errors: Any = needs("mcap.exceptions", "logs", self.file)
        self._cut = errors.EndOfFile
        self._damage = (errors.McapError, packing.ZstdError, struct.error, OSError, ValueError, KeyError, MemoryError,
                        RuntimeError, AssertionError, OverflowError)  # fmt: skip
        self._contents = Contents()
        self._others: dict[str, str] = {}
        self._lists: set[str] = set()
        self._units: dict[str, Mapping[str, str]] = {}
        self.time = None if file_map is None else file_map.time
        self._topics = self._find()
        self._look_into_messages()
        self._places = _named(self._topics)
        if not self._places:
            raise LogError(self._why_nothing(), file=self.file)

    def offered(self) -> list[Offered]:
        """The fields of all topics that schemas declare as numbers."""
        return [
            Offered(name, unit or unit_in_name(field), topic)
            for name, (topic, field) in self._places.items()
            for unit in [self._topics[topic][field]]
        ] + [Offered(topic, note=f"not read: in {encoding}") for topic, encoding in self._others.items()]

    def notes(self, names: Sequence[str]) -> dict[str, str]:
        """Why topics are not read, for those whose messages are not in JSON."""
        return {name: f"not read: its messages are in {self._others[name]}" for name in names if name in self._others}

    def _why_nothing(self) -> str:
        if not self._others:
            return "has no messages with numbers"
        listed = ", ".join(list(self._others)[:_LISTED])
        encodings = ", ".join(sorted(set(self._others.values())))
        more = f" and {len(self._others) - _LISTED} more" if len(self._others) > _LISTED else ""
        return (
            f"its topics {listed}{more} are in {encodings}, and messages in JSON are read, and with"
            ' mcap-ros2-support and mcap-protobuf-support (pip install "ramsight[logs]") those of ROS 2 and protobuf:'
            " write them so, or the signals as CSV or Parquet"
        )

    def blocks(self, channels: Sequence[str]) -> Iterator[Block]:
        """16 384 messages at a time, and those of the same time."""
        self.check(channels)
        wanted: dict[str, list[tuple[str, str]]] = {}
        for channel in channels:
            if channel in self._others:
                raise LogError(
                    f"is in {self._others[channel]}; messages in JSON, CDR and protobuf are read",
                    file=self.file,
                    column=channel,
                )
            topic, field = self._places[channel]
            wanted.setdefault(topic, []).append((channel, field))
        rows: dict[str, list[list[float]]] = {topic: [] for topic in wanted}
        if self.time is not None:
            yield self._stamped(wanted, self.time)
            return
        last, place, count = -1, 0, 0
        clocks = {topic: ClockWatch() for topic in wanted}
        for topic, stamp, message in self._messages(wanted):
            clocks[topic].take(stamp / NANOSECONDS)
            if count >= _AT_ONCE and stamp != last:
                yield _block(rows, wanted)
                rows, count = {topic: [] for topic in wanted}, 0
            place += stamp != last  # messages of one time came together
            last, count = stamp, count + 1
            values = [_number(_field(message, field)) for _, field in wanted[topic]]
            rows[topic].append([place, stamp / NANOSECONDS, *values])
        warn_of_watched(self.file, clocks.values())
        yield _block(rows, wanted)
        if self.advance is not None:
            self.advance(1.0)

    def _stamped(self, wanted: Mapping[str, list[tuple[str, str]]], timed: Timed) -> Block:
        """All samples over the times that stand in the messages; those of topics without one have that of the log."""
        rows: dict[str, list[list[float]]] = {topic: [] for topic in wanted}
        without, is_number = set[str](), True
        clocks: dict[str, list[float]] = {topic: [] for topic in wanted}
        for topic, stamp, message in self._messages(wanted):
            found = _field(message, timed.channel)
            said = _seconds(found)
            is_number &= not isinstance(found, Mapping)
            if said is None:
                without.add(topic)
            clocks[topic].append(stamp / NANOSECONDS if said is None else said)
            rows[topic].append([_number(_field(message, field)) for _, field in wanted[topic]])
        if without == {topic for topic, found in rows.items() if found}:
            raise DescriptionError(
                "is in no message", file=self.file, key="time.channel", value=timed.channel,
                allowed='a number, or a stamp such as "header.stamp"',
            )  # fmt: skip
        said_unit = "" if is_number else "s"
        topics = [topic for topic, found in rows.items() if found]
        times = {
            number: np.array(clocks[topic])
            if topic in without
            else rising(self.file, whole_clock(self.file, timed, said_unit, np.array(clocks[topic])), timed.channel)
            for number, topic in enumerate(topics)
        }
        came = arrivals(times)
        warn_of_clocks(self.file, times, came, dict(enumerate(topics)))
        return {
            channel: Samples(came[number].order, times[number], np.array(rows[topic])[:, place])
            for number, topic in enumerate(topics)
            for place, (channel, _) in enumerate(wanted[topic])
        }

    def _messages(self, wanted: Mapping[str, object]) -> Iterator[tuple[str, int, dict[str, Any]]]:
        """Topic, time [ns] and content of the messages of some topics, as they stand in the file."""
        topics: dict[int, tuple[str, Decoder]] = {}
        schemas: dict[int, Any] = {}
        for record in self._records():
            if isinstance(record, self._known.Schema):
                schemas[record.id] = record
            elif isinstance(record, self._known.Channel) and record.topic in wanted:
                decoder = self._contents.decoder(record.message_encoding, schemas.get(record.schema_id))
                if decoder is not None:
                    topics[record.id] = record.topic, decoder
            elif isinstance(record, self._known.Message) and record.channel_id in topics:
                topic, decoder = topics[record.channel_id]
                try:
                    content = decoder(record.data)
                except DAMAGED as error:
                    reason = "nested too deeply" if isinstance(error, RecursionError) else first_line(error)
                    text = f"a message at {record.log_time / NANOSECONDS:g} s: {reason}"
                    raise LogError(text, file=self.file, column=topic) from None
                yield topic, record.log_time, content

    def _records(self) -> Iterator[Any]:
        """All records in their order; a file that breaks off ends with a warning."""
        found = False
        with opened(self.path) as file:
            reader = self._mcap.StreamReader(file, emit_chunks=True, validate_crcs=True, record_size_limit=_LARGEST)
            try:
                for record in self._unpacked(reader.records):
                    found = found or isinstance(record, self._known.Message)
                    yield record
            except self._cut:
                if not found:
                    raise LogError("is no MCAP file, or a damaged one: it breaks off", file=self.file) from None
                warn_of_log("the file breaks off; what is whole was read", file=self.file)
            except self._damage as error:
                raise LogError(f"is no MCAP file, or a damaged one: {first_line(error)}", file=self.file) from None

    def _unpacked(self, records: Iterator[Any]) -> Iterator[Any]:
        """The records, and those in chunks, which say how much they hold and hold no more."""
        for record in records:
            if not isinstance(record, self._known.Chunk):
                yield record
                continue
            data = unpacked_chunk(record.data, record.compression, record.uncompressed_size, _LARGEST)
            plain = replace(record, compression="", data=data)
            yield from self._mcap.breakup_chunk(plain, validate_crc=True)

    def _find(self) -> dict[str, dict[str, str]]:
        """Fields with their units, by topic."""
        schemas: dict[int, Any] = {}
        topics: dict[str, dict[str, str]] = {}
        for record in self._declared():
            if isinstance(record, self._known.Schema):
                schemas[record.id] = record
            elif isinstance(record, self._known.Channel):
                schema = schemas.get(record.schema_id)
                if self._contents.decoder(record.message_encoding, schema) is None:
                    self._others[record.topic] = record.message_encoding or "no encoding that is stated"
                    continue
                fields = topics.setdefault(record.topic, {})
                self._units[record.topic] = {} if schema is None else UNITS.get(schema.name.rpartition("/")[2], {})
                if schema is not None and schema.encoding == "jsonschema":
                    fields.update(self._fields(schema.data))
                    if b'"array"' in schema.data:
                        self._lists.add(record.topic)
        return topics

    def _look_into_messages(self) -> None:
        """The fields of topics of which no schema says any, by their first messages."""
        open_topics = {topic: 0 for topic, fields in self._topics.items() if not fields or topic in self._lists}
        if not open_topics:
            return
        for topic, _, message in self._messages(open_topics):
            for name in _numbers_in(message):
                self._topics[topic].setdefault(name, self._units.get(topic, {}).get(name.partition("[")[0], ""))
            open_topics[topic] += 1
            if min(open_topics.values()) >= _FIRST_MESSAGES:
                return

    def _declared(self) -> Iterator[Any]:
        """Schemas and channels: of the summary at the file's end, or of the whole file where it has none."""
        reader: Any = needs("mcap.reader", "logs", self.file)
        with opened(self.path) as file:
            try:
                summary = reader.SeekingReader(file, record_size_limit=_LARGEST).get_summary()
            except self._damage:
                summary = None
        if summary is None or not summary.channels:
            yield from self._records()
        else:
            yield from (*summary.schemas.values(), *summary.channels.values())

    def _fields(self, data: bytes) -> dict[str, str]:
        try:
            return dict(_declared_numbers(json.loads(data)))
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            return {}


def _declared_numbers(schema: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, str]]:
    """The numbers that a schema declares, with their units; those of objects in objects as ``OBJECT.FIELD``."""
    for name, one in schema["properties"].items():
        kinds = one.get("type", "object" if "properties" in one else "")
        if _NUMBERS & set(kinds if isinstance(kinds, list) else [kinds]):
            yield f"{before}{name}", str(one.get("unit", ""))
        elif "properties" in one:
            yield from _declared_numbers(one, f"{before}{name}.")


def _numbers_in(message: Mapping[str, Any], before: str = "", deep: int = 0) -> Iterator[str]:
    """The fields of a message that are numbers: of objects in objects as ``OBJECT.FIELD``, of lists as ``FIELD[0]``."""
    for name, one in message.items():
        if isinstance(one, (int, float)):
            yield f"{before}{name}"
        elif isinstance(one, list) and len(one) <= MOST_LISTED:
            yield from (f"{before}{name}[{k}]" for k, value in enumerate(one) if isinstance(value, (int, float)))
        elif isinstance(one, dict) and deep < _DEEPEST:
            yield from _numbers_in(one, f"{before}{name}.", deep + 1)


def _field(message: Mapping[str, Any], field: str) -> object:
    """What stands in a field, or in that of an object in the message; None if it is not there."""
    if field in message:
        return message[field]
    if (place := _IN_LIST.fullmatch(field)) is not None and "." not in place[2]:
        listed, number = _field(message, place[1]), int(place[2])
        return listed[number] if isinstance(listed, list) and number < len(listed) else None
    first, _, rest = field.partition(".")
    inner = message.get(first)
    return _field(inner, rest) if rest and isinstance(inner, dict) else None


def _seconds(stamp: object) -> float | None:
    """The number of a field that is a time, or the seconds of a stamp of two fields; None where there is none."""
    if isinstance(stamp, (int, float)) and not isinstance(stamp, bool):
        return float(stamp)
    if not isinstance(stamp, Mapping):
        return None
    for whole, part in _SECONDS:
        if isinstance(stamp.get(whole), (int, float)) and isinstance(stamp.get(part), (int, float)):
            return float(stamp[whole]) + float(stamp[part]) / NANOSECONDS
    return None


def _named(topics: Mapping[str, Mapping[str, str]]) -> dict[str, tuple[str, str]]:
    """Channels by what a map calls them."""
    places: dict[str, list[tuple[str, str]]] = {}
    for topic, fields in topics.items():
        for field in fields:
            places.setdefault(field, []).append((topic, field))
    return {
        field if len(found) == 1 else f"{topic}/{field}": (topic, field)
        for field, found in places.items()
        for topic, _ in found
    }


def _number(value: object) -> float:
    try:
        number = float(value) if isinstance(value, (int, float)) else np.nan
    except OverflowError:
        return np.nan
    return number if np.isfinite(number) else np.nan


def _block(rows: Mapping[str, list[list[float]]], wanted: Mapping[str, list[tuple[str, str]]]) -> Block:
    block = {}
    for topic, found in rows.items():
        if found:
            table = np.array(found)
            for place, (channel, _) in enumerate(wanted[topic], 2):
                block[channel] = Samples(table[:, 0], table[:, 1], table[:, place])
    return block
