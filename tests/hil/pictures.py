"""What emulated cameras show: pictures.py BUILD makes BUILD/hil-pictures, a recording of the
simulator cut down to the face, as sensors with a region of interest deliver it."""
import pathlib
import re
import subprocess
import sys

X_PX, Y_PX, WIDTH_PX, HEIGHT_PX = 480, 336, 320, 320


def cut_picture(path):
    header, size, depth, pixels = path.read_bytes().split(b"\n", 3)
    width = int(size.split()[0])
    rows = [pixels[width * y + X_PX:width * y + X_PX + WIDTH_PX] for y in range(Y_PX, Y_PX + HEIGHT_PX)]
    path.write_bytes(b"\n".join([header, b"%d %d" % (WIDTH_PX, HEIGHT_PX), depth, b"".join(rows)]))


def cut_model(path):
    """The third and fourth number of a lens model are where its axis meets the picture."""
    text = path.read_text()
    numbers = re.search(r"'intrinsics': \[([^]]*)\]", text).group(1).split(",")
    numbers[2] = f" {float(numbers[2]) - X_PX:.10f}"
    numbers[3] = f" {float(numbers[3]) - Y_PX:.10f}"
    text = re.sub(r"('intrinsics': \[)[^]]*", lambda m: m.group(1) + ",".join(numbers), text)
    path.write_text(re.sub(r"('imagersize': \[)[^]]*", rf"\g<1> {WIDTH_PX}, {HEIGHT_PX} ", text))


def main(build):
    recording = build / "hil-pictures"
    subprocess.run([build / "ctl/stagectl", "sim", "record", recording, "--scene", "rest",
                    "--seconds", "0.4", "--rate", "10"], stdout=subprocess.DEVNULL, check=True)
    for path in recording.glob("ir*/*.pgm"):
        cut_picture(path)
    for path in recording.glob("rig/*.cameramodel"):
        cut_model(path)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
