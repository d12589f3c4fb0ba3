"""The programs under test, stages for them to look at, and stations that never outlive a test."""
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import time

import pytest

STAGED = os.environ.get("STAGED")
STAGECTL = os.environ.get("STAGECTL")


def ctl(*arguments, timeout=30):
    return subprocess.run([STAGECTL, *map(str, arguments)], capture_output=True, text=True,
                          timeout=timeout, check=False)


class Station:
    """A running staged and its sockets."""

    def __init__(self, config, socket_dir, environment=None):
        self.socket_dir = pathlib.Path(socket_dir)
        self.process = subprocess.Popen(
            [STAGED, "--config", str(config), "--socket-dir", str(socket_dir)],
            stderr=subprocess.PIPE, text=True, env={**os.environ, **(environment or {})})

    def wait_running(self, seconds=5):
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            if self.process.poll() is not None:
                raise AssertionError(f"staged ended: {self.process.stderr.read()}")
            answer = self.ctl("status", "--json")
            if answer.returncode == 0 and json.loads(answer.stdout)["shots"]["solved"] > 0:
                return self
            time.sleep(0.05)
        raise AssertionError("no shot was solved")

    def ctl(self, *arguments, **options):
        return ctl(*arguments, "--socket-dir", self.socket_dir, **options)

    def status(self):
        return json.loads(self.ctl("status", "--json").stdout)

    def connect(self, name):
        client = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        client.settimeout(10)
        client.connect(str(self.socket_dir / name))
        return client

    def stop(self, how=signal.SIGTERM):
        """Exit code, what it said, and how long it took."""
        begin = time.monotonic()
        self.process.send_signal(how)
        _, said = self.process.communicate(timeout=10)
        return self.process.returncode, said, time.monotonic() - begin

    def end(self):
        if self.process.poll() is None:
            self.process.kill()
            self.process.communicate()


@pytest.fixture(scope="session")
def recording(tmp_path_factory):
    """Half a second of a talking face by four cameras, never to be changed."""
    place = tmp_path_factory.mktemp("recording")
    done = ctl("sim", "record", place / "stage", "--seconds", "0.4", "--cameras", "4", "--seed", "5")
    assert done.returncode == 0, done.stderr
    return place / "stage"


def link_images(source, target):
    (os.link if source.endswith(".pgm") else shutil.copy)(source, target)


@pytest.fixture
def stage(recording, tmp_path):
    """The recording again, to be spoiled; its images are links: replace them, do not write them."""
    return pathlib.Path(shutil.copytree(recording, tmp_path / "stage", copy_function=link_images))


def truncate(image):
    """Leaves the first 1000 bytes of an image of `stage`."""
    begin = image.read_bytes()[:1000]
    image.unlink()
    image.write_bytes(begin)


@pytest.fixture(scope="session")
def sim_config(recording):
    """The same cameras live."""
    text = (recording / "stage.yaml").read_text().replace("files:", "sim:")
    text = text.replace("trigger: free", "trigger: sim").replace("rate_hz: 120", "rate_hz: 60")
    path = recording / "sim.yaml"
    path.write_text(text + "sim: {scene: talking, seed: 5}\n")
    return path


@pytest.fixture
def start(tmp_path):
    """start(config) -> a Station, ended with the test. Its sockets are in tmp_path / "sockets"."""
    stations = []

    def start_one(config, socket_dir=tmp_path / "sockets", environment=None):
        stations.append(Station(config, socket_dir, environment))
        return stations[-1]

    yield start_one
    for station in stations:
        station.end()


@pytest.fixture
def station(start, sim_config):
    """One of the test's own, to be mistreated."""
    return start(sim_config).wait_running()


@pytest.fixture(scope="module")
def shared_station(sim_config, tmp_path_factory):
    """One for all tests that only look."""
    station = Station(sim_config, tmp_path_factory.mktemp("shared") / "sockets").wait_running()
    yield station
    station.end()
