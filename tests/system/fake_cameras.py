"""V4L2 cameras that are files (tests/contract/fake_v4l2.c), and a stage of them."""
import base64
import os
import shutil

import pytest

MODEL = """{{
    'lensmodel': 'LENSMODEL_PINHOLE',
    'intrinsics': [ 200, 200, 79.5, 59.5 ],
    'extrinsics': [ 0, 0, 0, {x}, 0, 2 ],
    'imagersize': [ 160, 120 ],
}}
"""
# 64x48: red on the left, blue on the right
JPEG = base64.b64decode("""
/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDABQODxIPDRQSEBIXFRQYHjIhHhwcHj0sLiQySUBMS0dA
RkVQWnNiUFVtVkVGZIhlbXd7gYKBTmCNl4x9lnN+gXz/2wBDARUXFx4aHjshITt8U0ZTfHx8fHx8
fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHz/wAARCAAwAEADASIA
AhEBAxEB/8QAFQABAQAAAAAAAAAAAAAAAAAAAAT/xAAUEAEAAAAAAAAAAAAAAAAAAAAA/8QAFwEB
AQEBAAAAAAAAAAAAAAAAAAYEBf/EABQRAQAAAAAAAAAAAAAAAAAAAAD/2gAMAwEAAhEDEQA/AJAG
J2wAE4CpSwACgBLKkABOAqUsAAoASypAATgKlLAAP//Z
""")


class FakeCameras:
    def __init__(self, root):
        self.root = root
        self.environment = {"FAKE_V4L2": str(root), "LD_PRELOAD": os.environ["FAKE_V4L2_MODULE"]}
        (root / "dev").mkdir(parents=True)
        (root / "sys/class/video4linux").mkdir(parents=True)
        (root / "picture.jpg").write_bytes(JPEG)

    def plug(self, number, serial, **settings):
        usb = self.root / f"sys/devices/usb{number}"
        (usb / "interface").mkdir(parents=True)
        (usb / "serial").write_text(serial + "\n")
        node = self.root / f"sys/class/video4linux/video{number}"
        node.mkdir()
        (node / "device").symlink_to(usb / "interface")
        whole = self.root / "made"
        whole.write_text("".join(f"{key} {value}\n" for key, value in settings.items()))
        whole.rename(self.root / f"dev/video{number}")

    def unplug(self, number):
        (self.root / f"dev/video{number}").unlink()
        shutil.rmtree(self.root / f"sys/class/video4linux/video{number}")
        shutil.rmtree(self.root / f"sys/devices/usb{number}")


@pytest.fixture
def cameras(tmp_path):
    return FakeCameras(tmp_path / "fake")


@pytest.fixture
def v4l2_config(cameras, recording, tmp_path):
    """Two IR cameras and an HD camera, plugged in."""
    rig = tmp_path / "rig"
    rig.mkdir()
    for i in range(2):
        (rig / f"ir{i}.cameramodel").write_text(MODEL.format(x=i))
    cameras.plug(0, "A1", card="Left", formats="YUYV,GREY")
    cameras.plug(1, "B2", card="Right", formats="YUYV,Y10", stamps="eof")
    cameras.plug(2, "C3", card="Colour", formats="MJPG", width=64, height=48, period_us=40000,
                 jpeg=cameras.root / "picture.jpg")
    config = tmp_path / "stage.yaml"
    config.write_text(f"""rig: rig
layout: {recording}/layout.yaml
rate_hz: 100
cameras:
- {{name: ir0, address: "v4l2:serial=A1", controls: {{gain: 80}}}}
- {{name: ir1, address: "v4l2:card=Right", exposure_us: 1000, readout_us: 4000, format: grey16}}
- {{name: hd0, address: "v4l2:serial=C3", role: hd, format: mjpeg}}
""")
    return config
