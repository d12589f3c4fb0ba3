"""A station on simulated GigE Vision cameras: what its status says of them, and one that goes away
while nothing runs."""
import os
import signal
import subprocess
import time

import pytest

SIM_GIGE = os.environ.get("SIM_GIGE")


class Cameras:
    """stage-sim-gige on loopback addresses of this process's own."""

    def __init__(self, *options):
        pid = os.getpid() & 0xffff
        self.network = f"127.{96 + (pid >> 14)}.{(pid >> 6) & 255}.{4 * (pid & 63)}"
        self.process = subprocess.Popen(
            [SIM_GIGE, "--first-address", self.address(0), "--cameras", "4", "--seed", "5",
             "--rate", "30", *options], stdout=subprocess.PIPE, text=True)
        assert self.process.stdout.readline().startswith("ready ")

    def address(self, index):
        head, last = self.network.rsplit(".", 1)
        return f"{head}.{int(last) + index}"

    def end(self):
        self.process.kill()
        self.process.communicate()


@pytest.fixture
def gige_start(start, recording, tmp_path):
    """gige_start(options of the simulator, keys of each camera) -> cameras and a station."""
    playing = []

    def start_both(options, keys=""):
        playing.append(Cameras(*options))
        lines = "".join(f"- {{name: ir{i}, address: 'aravis:{playing[0].address(i)}'{keys}}}\n"
                        for i in range(4))
        config = tmp_path / "gige.yaml"
        config.write_text(f"rig: {recording}/rig\nlayout: {recording}/layout.yaml\nrate_hz: 30\n"
                          f"trigger: free\ncameras:\n{lines}")
        return playing[0], start(config)

    yield start_both
    for cameras in playing:
        cameras.end()


def camera_of(station, name):
    return next(c for c in station.status()["cameras"] if c["name"] == name)


def test_clock_and_lost_packets_are_told(gige_start):
    _, station = gige_start(["--ptp", "0", "--resend", "--lost-packets", "0.005"], ", clock: ptp")
    station.wait_running(20)
    deadline = time.monotonic() + 10
    while camera_of(station, "ir1")["device"].get("resent_packets", 0) < 5:
        assert time.monotonic() < deadline
        time.sleep(0.2)
    camera = camera_of(station, "ir1")
    assert camera["facts"]["clock"].startswith("PTP Slave"), camera["facts"]
    assert camera["facts"]["receive"] == "from a plain socket"
    assert camera["facts"]["resend"] == "on"
    assert camera["facts_short"] == []
    assert station.stop()[0] == 0


def test_damaged_frames_are_counted_and_named_where_no_packet_comes_again(gige_start):
    _, station = gige_start(["--lost-packets", "0.005"])
    station.wait_running(20)
    deadline = time.monotonic() + 20
    while (camera := camera_of(station, "ir3"))["losses"]["damaged"] < 5 or (
            camera["ledger"]["events"]["dropped"] < 5):
        assert time.monotonic() < deadline, camera
        time.sleep(0.2)
    assert camera["device"]["missing_packets"] >= 5
    assert camera["device"]["resent_packets"] == 0
    assert camera["facts"]["resend"].startswith("off")
    assert station.stop()[0] == 0


def test_what_falls_short_of_the_config_stands_in_the_plain_status(gige_start):
    _, station = gige_start([], ", clock: ptp")
    station.wait_running(20)
    assert "clock: its own, mapped: the camera has no PTP" in station.ctl("status").stdout
    assert camera_of(station, "ir0")["facts_short"] == ["clock"]
    assert station.stop()[0] == 0


def test_cameras_that_went_away_while_stopped_are_lost_and_not_the_end(gige_start):
    cameras, station = gige_start([])
    station.wait_running(20)
    assert station.ctl("stop").returncode == 0
    cameras.process.send_signal(signal.SIGSTOP)
    assert station.ctl("start", timeout=60).returncode == 0
    assert camera_of(station, "ir2")["state"] == "lost"
    assert "it does not answer" in camera_of(station, "ir2")["lost"]["why"]
    cameras.process.send_signal(signal.SIGCONT)
    deadline = time.monotonic() + 30
    while camera_of(station, "ir2")["state"] != "running":
        assert time.monotonic() < deadline
        time.sleep(0.2)
    assert station.stop()[0] == 0
