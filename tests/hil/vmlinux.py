"""Cuts the kernel out of a bzImage, which would unpack itself slowly: vmlinux.py BZIMAGE VMLINUX

The offsets are those of the kernel's x86 boot protocol. A payload that is not xz is left packed.
"""
import lzma
import struct
import sys


def payload_of(image):
    setup_sectors, = struct.unpack_from("B", image, 0x1F1)
    offset, length = struct.unpack_from("<II", image, 0x248)
    start = (setup_sectors + 1) * 512 + offset
    return image[start:start + length]


def main(bzimage, vmlinux):
    with open(bzimage, "rb") as file:
        image = file.read()
    payload = payload_of(image)
    if payload.startswith(b"\xfd7zXZ\0"):
        image = lzma.LZMADecompressor().decompress(payload)
    with open(vmlinux, "wb") as file:
        file.write(image)


if __name__ == "__main__":
    main(*sys.argv[1:])
