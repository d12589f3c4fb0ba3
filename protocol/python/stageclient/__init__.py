"""Subscribe to a capture station's stream of labelled 3D markers.

    import stageclient
    for event in stageclient.connect("/run/stage/stream.sock"):
        if isinstance(event, stageclient.MarkerSet):
            for marker in event.markers:
                ...

Events are the messages of stage.proto: a Description first, then one MarkerSet per shot, and once a
second Statistics; a Notice is for a person to read. Metres, right-handed; times are nanoseconds of the station's
CLOCK_MONOTONIC.
"""
import socket
import struct

from .stage_pb2 import Description, Marker, MarkerSet, Message, Notice, Statistics

__all__ = ["connect", "Client", "ProtocolError", "Description", "Marker", "MarkerSet", "Notice",
           "Statistics", "interpolate", "MISSING", "PREDICTED", "TWO_CAMERA", "MEASURED"]

MISSING = Marker.MISSING
PREDICTED = Marker.PREDICTED
TWO_CAMERA = Marker.TWO_CAMERA
MEASURED = Marker.MEASURED

MESSAGE_BYTES_MAX = 16 << 20


class ProtocolError(Exception):
    """What came is not a valid stream."""


class Client:
    """An iterator over events; ends when the station ends the stream. Also a context manager."""

    def __init__(self, path, timeout_s=None):
        self.description = None  # the latest
        self.labels = []         # names by label index
        self.sets_lost = 0       # marker sets that this subscriber lost by reading too slowly
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
            connection.settimeout(timeout_s)
            connection.connect(path)
            self._file = connection.makefile("rb")  # keeps the connection open

    def fileno(self):
        return self._file.fileno()

    def close(self):
        self._file.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __iter__(self):
        return self

    def __next__(self):
        while True:
            message = self._read_message()
            kind = message.WhichOneof("body")
            if kind is not None:  # a newer station may send what this module does not know
                return self._check(kind, getattr(message, kind), message.sets_lost)

    def _read_message(self):
        header = self._file.read(4)
        if len(header) < 4:
            raise StopIteration
        size_bytes, = struct.unpack("<I", header)
        if size_bytes > MESSAGE_BYTES_MAX:
            raise ProtocolError(f"a message of {size_bytes} bytes: at most {MESSAGE_BYTES_MAX}")
        data = self._file.read(size_bytes)
        if len(data) < size_bytes:
            raise StopIteration
        try:
            return Message.FromString(data)
        except Exception as error:  # the protobuf back ends raise different types
            raise ProtocolError(f"a message cannot be decoded: {error}") from error

    def _check(self, kind, event, sets_lost):
        if kind == "description":
            self.description = event
            self.labels = [m.name for actor in event.actors for m in actor.markers]
        elif kind == "markers":
            if self.description is None:
                raise ProtocolError("a marker set came before the description")
            if any(not -1 <= m.label < len(self.labels) for m in event.markers):
                raise ProtocolError("a marker has a label that the description does not know")
            self.sets_lost = sets_lost
        return event


def connect(path, timeout_s=None):
    """A Client of the stream socket at `path`; with a timeout, waiting longer raises TimeoutError."""
    return Client(path, timeout_s)


def interpolate(times_ns, places_m, at_ns):
    """Where something was at `at_ns`, by four marker sets in a row: on the cubic through them (Lagrange).

    `times_ns` are the sets' mid_exposure_ns, `places_m` four (x, y, z). For HD pictures `at_ns` is
    hd.mid_exposure_ns of the second set. ValueError when `at_ns` is outside of them.
    """
    if len(times_ns) != 4 or len(places_m) != 4 or not times_ns[0] <= at_ns <= times_ns[3]:
        raise ValueError("it takes four times and places around the one asked for")
    out = [0.0, 0.0, 0.0]
    for i, (time_ns, place_m) in enumerate(zip(times_ns, places_m)):
        weight = 1.0
        for k, other_ns in enumerate(times_ns):
            if k != i:
                weight *= (at_ns - other_ns) / (time_ns - other_ns)
        out = [sum_m + weight * x for sum_m, x in zip(out, place_m)]
    return tuple(out)
