"""MCAP files: the messages of the wanted topics, every chunk unpacked within limits.

The library reads the records; chunks are unpacked here, because it believes what they say about their size.
"""

import io
from collections.abc import Container, Iterator
from typing import Any

from bumblebee.errors import BadInput
from bumblebee.io.limits import Limits
from bumblebee.measured.importers.extras import library
from bumblebee.measured.importers.ros.recording import Message, Recording, Topic, require_small

CUT_OFF = "the recording ends in the middle of a record"


def read_mcap(where: str, content: bytes, wanted: Container[str], limits: Limits) -> Recording:
    """The wanted topics of an MCAP file; one whose end is missing, as after a crash, is read as far as it goes."""
    found = _Found(where, wanted, limits)
    reader = library("rosbag", "mcap.stream_reader")
    library("rosbag", "mcap_ros2.decoder")
    cut_off = library("rosbag", "mcap.exceptions").EndOfFile
    try:
        stream = reader.StreamReader(io.BytesIO(content), emit_chunks=True, record_size_limit=len(content))
        for record in stream.records:
            for one in _records(where, record, reader, found):
                found.take(one)
    except BadInput:
        raise
    except Exception as error:  # struct.error, UnicodeDecodeError, McapError and what the decompressors raise
        if not found.topics or not isinstance(error, cut_off):
            raise BadInput(where, "an MCAP file", f"{type(error).__name__}: {error}"[:200]) from None
        found.notes = (CUT_OFF,)
    return Recording(found.topics, found.others, found.notes)


class _Found:
    """Schemas, channels and messages met so far."""

    def __init__(self, where: str, wanted: Container[str], limits: Limits) -> None:
        self.where, self.wanted, self.limits = where, wanted, limits
        self.schemas: dict[int, Any] = {}
        self.channels: dict[int, Any] = {}
        self.topics: dict[str, Topic] = {}
        self.others: dict[str, str] = {}
        self.notes: tuple[str, ...] = ()
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
                self.topics[topic].messages.append(Message(record.log_time, record.publish_time, record.data))

    def _open(self, channel: Any) -> None:
        schema = self.schemas.get(channel.schema_id)
        kind = schema.name if schema else ""
        if channel.topic not in self.wanted:
            if len(self.others) < self.limits.members:
                self.others[channel.topic] = kind
            return
        encodings = (channel.message_encoding, schema.encoding if schema else "none")
        if encodings != ("cdr", "ros2msg"):
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


def _unpacked(where: str, chunk: Any, limits: Limits) -> bytes:
    """The bytes of a chunk, no more than it says, than may be, and than its packed size explains."""
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
    if len(data) != size:
        raise BadInput(where, f"a chunk of {size:,} bytes, as it says", f"{len(data):,}")
    return data
