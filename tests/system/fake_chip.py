"""GPIO chips that are files, as tests see them: tests/gpio/fake_gpio.h."""
import mmap
import struct
import time

NAMES = ["IR_TRIG", "STROBE", "HD_TRIG", "EXPOSURE", "SYNC_IN", ""]
IR, STROBE, HD = 1, 2, 4
GONE_AT, LEVELS_AT, COUNT_AT, CHANGES_AT = 416, 420, 424, 432
CHANGES = 65536
EDGES_AT = CHANGES_AT + 16 * CHANGES
SIZE = EDGES_AT + 8 + 8 * 4096 + 24


def pulses_of(changes, line):
    """(on, off) of each pulse of a line that is over, from (seconds, levels) of all changes."""
    begin, found = None, []
    for at, levels in changes:
        if levels & line and begin is None:
            begin = at
        elif not levels & line and begin is not None:
            found.append((begin, at))
            begin = None
    return found


class Chip:
    """The file that the station takes for a chip."""

    def __init__(self, path):
        path.write_bytes(b"fake".ljust(32, b"\0")
                         + b"".join(name.encode().ljust(64, b"\0") for name in NAMES)
                         + bytes(SIZE - 32 - 64 * len(NAMES)))
        with path.open("r+b") as file:
            self.memory = mmap.mmap(file.fileno(), SIZE)

    def number(self, at):
        return struct.unpack_from("<I", self.memory, at)[0]

    def levels(self):
        return self.number(LEVELS_AT)

    def add_edge(self):
        """One on the input, now."""
        count = self.number(EDGES_AT)
        struct.pack_into("<q", self.memory, EDGES_AT + 8 + 8 * (count % 4096), time.monotonic_ns())
        struct.pack_into("<I", self.memory, EDGES_AT, count + 1)

    def set_gone(self, gone):
        struct.pack_into("<I", self.memory, GONE_AT, gone)

    def changes(self, first=0):
        """(seconds, levels, pid) of each."""
        return [(time_ns / 1e9, levels, pid) for time_ns, levels, pid in
                (struct.unpack_from("<qII", self.memory, CHANGES_AT + 16 * (i % CHANGES))
                 for i in range(first, self.number(COUNT_AT)))]

    def pulses(self, line, first=0):
        """(on, off) of each that is over."""
        return pulses_of(((at, levels) for at, levels, _ in self.changes(first)), line)

    def wait_lit(self, line, seconds=20):
        deadline = time.monotonic() + seconds
        while not self.levels() & line:
            assert time.monotonic() < deadline, "it is never lit"

    def wait_dark(self, seconds, lines=IR | STROBE | HD):
        """The seconds until the lines are dark."""
        begin = time.monotonic()
        while self.levels() & lines:
            assert time.monotonic() < begin + seconds, (
                f"still lit: {self.levels():b} at {time.monotonic()}, asked at {begin}, "
                f"{self.changes()[-8:]}")
        return time.monotonic() - begin
