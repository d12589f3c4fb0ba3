"""Pictures that a verb wrote: whether they are sound."""
import struct
import zlib


def read_png(path):
    """Width and height of a sound RGB image."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, pixels, header = 8, b"", None
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + size]
        assert struct.unpack(">I", data[at + 8 + size:at + 12 + size])[0] == zlib.crc32(kind + body)
        if kind == b"IHDR":
            header = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            pixels += body
        at += 12 + size
    width, height, depth, colour = header[:4]
    assert (depth, colour) == (8, 2)  # RGB
    assert len(zlib.decompress(pixels)) == height * (1 + 3 * width)
    return width, height
