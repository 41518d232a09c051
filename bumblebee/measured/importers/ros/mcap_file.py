"""MCAP files: the messages of the wanted topics, every chunk unpacked within limits.

The library reads the records; chunks are unpacked here, because it believes what they say about their size. Where a
recording was cut off is found here, too: the library raises one of several errors there, and its `make_reader` reads
such a file as an empty one.
"""

import io
import struct
from collections.abc import Container, Iterator
from typing import Any

from bumblebee.errors import BadInput
from bumblebee.io.limits import Limits
from bumblebee.measured.importers.extras import library
from bumblebee.measured.importers.ros.recording import Message, Recording, Topic, require_small

_MAGIC = b"\x89MCAP0\r\n"
_HEAD = 9  # bytes before a record's content: its kind and, in eight of them, its length
_CHUNK = 6  # the kind of a chunk


def read_mcap(where: str, content: bytes, wanted: Container[str], limits: Limits) -> Recording:
    """The wanted topics of an MCAP file.

    A file without an end, as after a crash, is read up to its last whole message, those in an unfinished chunk
    included; a note says how far that is.
    """
    if not content.startswith(_MAGIC):
        raise BadInput(where, "an MCAP file", f"{len(content):,} bytes that are none")
    found = _Found(where, wanted, limits)
    reader = library("rosbag", "mcap.stream_reader")
    library("rosbag", "mcap_ros2.decoder")
    finished = content.endswith(_MAGIC) and len(content) > len(_MAGIC)
    end = len(content) if finished else _whole_records(content, len(_MAGIC))
    ended = library("rosbag", "mcap.exceptions").EndOfFile
    try:
        stream = reader.StreamReader(io.BytesIO(content[:end]), emit_chunks=True, record_size_limit=len(content))
        try:
            for record in stream.records:
                for one in _records(where, record, reader, found):
                    found.take(one)
        except ended:
            if finished:
                raise
        if not finished:
            for one in _unfinished(where, content[end:], reader, found):
                found.take(one)
    except BadInput:
        raise
    except Exception as error:  # struct.error, UnicodeDecodeError, McapError and what the decompressors raise
        raise BadInput(where, "an MCAP file", f"{type(error).__name__}: {error}"[:200]) from None
    if not finished:
        found.notes = (_how_far(found, end, len(content)),)
    return Recording(found.topics, found.others, found.notes)


def _whole_records(content: bytes, start: int) -> int:
    """Where the last record ends that lies in `content` as a whole, of those from `start` on."""
    while start + _HEAD <= len(content):
        end = start + _HEAD + int.from_bytes(content[start + 1 : start + _HEAD], "little")
        if end > len(content):
            break
        start = end
    return start


def _unfinished(where: str, rest: bytes, reader: Any, found: "_Found") -> Iterator[Any]:
    """The whole records in the last chunk of a file that ends before this chunk does."""
    if not rest or rest[0] != _CHUNK:
        return
    ended = library("rosbag", "mcap.exceptions").EndOfFile
    streams = library("rosbag", "mcap.data_stream")
    try:
        chunk = reader.Chunk.read(streams.ReadDataStream(io.BytesIO(rest[_HEAD:])))
    except (ended, struct.error, UnicodeDecodeError):
        return  # cut off before the chunk's data
    data = _unpacked(where, chunk, found.limits, whole=False)
    chunk.data, chunk.compression = data[: _whole_records(data, 0)], ""
    yield from reader.breakup_chunk(chunk)


def _how_far(found: "_Found", end: int, size: int) -> str:
    """The note on a file that was cut off."""
    stamps = [one.logged for topic in found.topics.values() for one in topic.messages]
    span = f"{(max(stamps) - min(stamps)) * 1e-9:.3f} s of messages" if stamps else "no message"
    return f"the recording has no end: read as far as it goes, up to byte {end:,} of {size:,}, {span}"


class _Found:
    """Schemas, channels and messages met so far."""

    def __init__(self, where: str, wanted: Container[str], limits: Limits) -> None:
        self.where, self.wanted, self.limits = where, wanted, limits
        self.schemas: dict[int, Any] = {}
        self.channels: dict[int, Any] = {}
        self.topics: dict[str, Topic] = {}
        self.others: dict[str, str] = {}
        self.notes: tuple[str, ...] = ()
        self.met = 0
        self.unpacked = 0
        self.held = 0

    def take(self, record: Any) -> None:
        """Remember a schema or channel, keep a message of a wanted topic, leave the rest."""
        kind = type(record).__name__
        if kind == "Schema":
            self.schemas[record.id] = record
        elif kind == "Channel":
            self.channels[record.id] = record
            self._open(record)
        elif kind == "Message" and record.channel_id in self.channels:
            topic = self.channels[record.channel_id].topic
            if topic in self.topics:
                self.held += len(record.data)
                require_small(self.where, topic, len(record.data), self.limits, self.held)
                one = Message(record.log_time, record.publish_time, record.data, self.met)
                self.topics[topic].messages.append(one)
                self.met += 1

    def _open(self, channel: Any) -> None:
        schema = self.schemas.get(channel.schema_id)
        kind = schema.name if schema else ""
        if channel.topic not in self.wanted:
            if len(self.others) < self.limits.members:
                self.others[channel.topic] = kind
            return
        encodings = (channel.message_encoding, schema.encoding if schema else "none")
        if schema is None or encodings != ("cdr", "ros2msg"):
            came = f"{encodings[0]} by {encodings[1]}"[:80]
            raise BadInput(f"{self.where}: {channel.topic}", "ROS 2 messages (cdr by ros2msg)", came)
        self.topics.setdefault(channel.topic, Topic(kind, schema.data.decode()))


def _records(where: str, record: Any, reader: Any, found: _Found) -> Iterator[Any]:
    """The record itself, or what a chunk holds."""
    if type(record).__name__ != "Chunk":
        yield record
        return
    data = _unpacked(where, record, found.limits)
    found.unpacked += len(data)
    if found.unpacked > found.limits.unpacked_bytes:
        raise BadInput(where, f"at most {found.limits.unpacked_bytes:,} bytes unpacked", "more")
    record.data, record.compression = data, ""
    yield from reader.breakup_chunk(record)


def _unpacked(where: str, chunk: Any, limits: Limits, whole: bool = True) -> bytes:
    """The bytes of a chunk, no more than it says, than may be, and than its packed size explains.

    With `whole` as many as it says; without, as many as can be unpacked of a chunk that was cut off.
    """
    size, packed = chunk.uncompressed_size, max(len(chunk.data), 1)
    if size > limits.unpacked_bytes or (size > limits.free_bytes and size > limits.ratio * packed):
        raise BadInput(
            where, f"chunks of at most {limits.unpacked_bytes:,} bytes, {limits.ratio:g} times packed", f"{size:,}"
        )
    if chunk.compression == "zstd":
        packer = library("rosbag", "zstandard").ZstdDecompressor(max_window_size=1 << 27)
        data = packer.stream_reader(io.BytesIO(chunk.data)).read(size + 1)
    elif chunk.compression == "lz4":
        data = library("rosbag", "lz4.frame").LZ4FrameDecompressor().decompress(chunk.data, max_length=size + 1)
    elif chunk.compression == "":
        data = chunk.data
    else:
        raise BadInput(where, "chunks packed by zstd or lz4", repr(chunk.compression)[:60])
    if len(data) > size or (whole and len(data) < size):
        raise BadInput(where, f"a chunk of {size:,} bytes, as it says", f"{len(data):,}")
    return data
