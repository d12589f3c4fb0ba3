"""A station on V4L2 cameras: fake ones, between the programs and the kernel."""
import json
import os
import subprocess
import time

from conftest import recording, start  # noqa: F401
from fake_cameras import cameras, v4l2_config  # noqa: F401
from png_file import read_png


def ctl(cameras, *arguments):
    return subprocess.run([os.environ["STAGECTL"], *map(str, arguments)], capture_output=True,
                          text=True, timeout=30, check=False,
                          env={**os.environ, **cameras.environment})


def camera_of(station, name):
    return next(c for c in station.status()["cameras"] if c["name"] == name)


def wait_for(station, name, state, seconds=8):
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        camera = camera_of(station, name)
        if camera["state"] == state:
            return camera
        time.sleep(0.1)
    raise AssertionError(f"{name} is {camera}, not {state}")


def test_v4l2_cameras_stream(start, cameras, v4l2_config):
    station = start(v4l2_config, environment=cameras.environment).wait_running()
    time.sleep(1.5)
    for name in ("ir0", "ir1"):
        camera = camera_of(station, name)
        assert camera["state"] == "running"
        assert (camera["width_px"], camera["height_px"]) == (160, 120)
        assert camera["frames_per_s"] > 50
        assert camera["blobs_per_frame"] >= 1
        assert camera["granted"]["rate_hz"] == 100
    assert camera["granted"] == {"format": "grey16", "bits": 10, "rate_hz": 100, "exposure_us": 1000}
    assert wait_for(station, "hd0", "running")["frames_per_s"] > 10
    assert station.stop()[0] == 0


def test_a_pulled_plug_is_a_state_and_the_camera_comes_back_elsewhere(start, cameras, v4l2_config):
    station = start(v4l2_config, environment=cameras.environment).wait_running()
    cameras.unplug(0)
    wait_for(station, "ir0", "lost")
    time.sleep(2.2)  # it is looked for, once a second
    assert "serial=A1: no such device" in json.dumps(camera_of(station, "ir0")["lost"])
    assert camera_of(station, "ir1")["state"] == "running"
    cameras.plug(5, "A1", card="Left", formats="GREY")
    wait_for(station, "ir0", "running")
    assert station.stop()[0] == 0


def test_pictures_of_bytes_words_and_jpeg_can_be_looked_at(start, cameras, v4l2_config, tmp_path):
    station = start(v4l2_config, environment=cameras.environment).wait_running()
    for name, size in (("ir0", (160, 120)), ("ir1", (160, 120)), ("hd0", (64, 48))):
        done = station.ctl("camera", "preview", name, "--output", tmp_path / "p.png")
        assert done.returncode == 0, done.stderr
        assert read_png(tmp_path / "p.png") == size


def test_cameras_are_listed_and_shown(cameras, v4l2_config):
    listed = json.loads(ctl(cameras, "camera", "list", "--json").stdout)["cameras"]
    ours = [c for c in listed if c["address"].startswith("v4l2:")]
    assert [c["address"] for c in ours] == [f"v4l2:serial={s}" for s in ("A1", "B2", "C3")]
    assert ours[0]["model"] == "Left (video0)"
    shown = json.loads(ctl(cameras, "camera", "show", "v4l2:serial=C3", "--json").stdout)
    assert (shown["format"], shown["rate_hz"]) == ("mjpeg", 25)


def refused(cameras, config, words, code):
    done = subprocess.run([os.environ["STAGED"], "--config", config, "--socket-dir",
                           config.parent / "sockets"], capture_output=True, text=True, timeout=20,
                          check=False, env={**os.environ, **cameras.environment})
    assert done.returncode == code, done.stderr
    for word in words:
        assert word in done.stderr, done.stderr


def test_what_cannot_be_is_refused_in_a_line(cameras, v4l2_config):
    text = v4l2_config.read_text()
    for old, new, code, words in (
            ("gain: 80", "gian: 80", 3, ("serial=A1", "no gian", "it has gain")),
            ("serial=A1", "serial=Z9", 4, ("serial=Z9", "no such device", "/dev/video0 (Left")),
            ("exposure_us: 1000", "gain_db: 6", 4, ("card=Right", "controls: {gain: N}")),
            ("format: mjpeg", "format: rgb", 4, ("serial=C3", "offers MJPG"))):
        v4l2_config.write_text(text.replace(old, new))
        refused(cameras, v4l2_config, words, code)


def test_a_camera_that_another_program_has_is_busy(start, cameras, v4l2_config):
    start(v4l2_config, environment=cameras.environment).wait_running()
    # the fakes of two programs know nothing of each other: the kernel's answer is in the file
    cameras.unplug(1)
    cameras.plug(1, "B2", card="Right", formats="GREY", busy=1)
    done = ctl(cameras, "camera", "show", "v4l2:serial=B2")
    assert done.returncode == 4
    assert "busy" in done.stderr and "another program" in done.stderr


def test_watching_the_list_names_arrivals_and_departures(cameras, v4l2_config):
    assert v4l2_config.exists()
    with subprocess.Popen([os.environ["STAGECTL"], "camera", "list", "--watch", "--json",
                           "--seconds", "30"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          text=True, env={**os.environ, **cameras.environment}) as watch:
        def await_event(event, address):
            for line in watch.stdout:
                told = json.loads(line)
                if (told["event"], told["address"]) == (event, address):
                    return
            raise AssertionError(f"{address}: {event} was not told")

        await_event("present", "v4l2:serial=B2")
        cameras.unplug(0)
        await_event("departed", "v4l2:serial=A1")
        cameras.plug(5, "A1", card="Left", formats="GREY")
        await_event("arrived", "v4l2:serial=A1")
        watch.terminate()
        assert watch.wait(5) == 0
        assert os.path.exists("/run/udev/control") or "no udev" in watch.stderr.read()
