"""A USB adapter that is a file, as tests see it: tests/usb/fake_ft232h.h."""
import mmap
import struct

from fake_chip import pulses_of

IR, STROBE, HD = 1 << 5, 1 << 6, 1 << 7
GONE_AT, COUNT_AT, CHANGES_AT, CHANGE_BYTES = 0, 32, 40, 24
SIZE = CHANGES_AT + CHANGE_BYTES * 8192 + 8


class Adapter:
    """The file that the station takes for an adapter; it is plugged in."""

    def __init__(self, path):
        path.write_bytes(bytes(SIZE))
        with path.open("r+b") as file:
            self.memory = mmap.mmap(file.fileno(), SIZE)

    def set_gone(self, gone):
        struct.pack_into("<i", self.memory, GONE_AT, gone)

    def changes(self):
        """(seconds, levels) of each."""
        count, = struct.unpack_from("<i", self.memory, COUNT_AT)
        return [(time_ns / 1e9, levels) for time_ns, levels in
                (struct.unpack_from("<qB", self.memory, CHANGES_AT + CHANGE_BYTES * i + 8)
                 for i in range(count))]

    def pulses(self, line):
        """(on, off) of each that is over."""
        return pulses_of(self.changes(), line)

    def is_lit(self):
        return self.changes()[-1][1] != 0
