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

    def __init__(self, config, socket_dir, environment=None, options=()):
        self.socket_dir = pathlib.Path(socket_dir)
        self.process = subprocess.Popen(
            [STAGED, "--config", str(config), "--socket-dir", str(socket_dir), *options],
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


def simulated(place, sim="seed: 5", rate_hz=120):
    """A recording's config with its cameras live; `sim` says more of the simulator."""
    text = (place / "stage.yaml").read_text().replace("files:", "sim:")
    text = text.replace("trigger: free", "trigger: sim").replace("rate_hz: 120", f"rate_hz: {rate_hz}")
    return f"{text}sim: {{scene: talking, {sim}}}\n"


@pytest.fixture(scope="session")
def sim_config(recording):
    """The same cameras live."""
    path = recording / "sim.yaml"
    path.write_text(simulated(recording, rate_hz=60))
    return path


@pytest.fixture
def fired_config(sim_config, recording, tmp_path):
    """fired_config(trigger, more YAML) -> a config of them at 60 Hz that another trigger fires."""

    def write(trigger, more=""):
        text = sim_config.read_text().replace("rig: rig", f"rig: {recording}/rig")
        text = text.replace("layout: layout.yaml", f"layout: {recording}/layout.yaml")
        text = text.replace("trigger: sim\n", f"trigger: '{trigger}'\n")
        config = tmp_path / "fired.yaml"
        config.write_text(text + more)
        return config

    return write


def wait_for(what, seconds):
    """What `what()` returns, once that is something."""
    deadline = time.monotonic() + seconds
    while not (found := what()):
        assert time.monotonic() < deadline
        time.sleep(0.02)
    return found


@pytest.fixture
def start(tmp_path):
    """start(config) -> a Station, ended with the test. Its sockets are in tmp_path / "sockets"."""
    stations = []

    def start_one(config, socket_dir=tmp_path / "sockets", environment=None, options=()):
        stations.append(Station(config, socket_dir, environment, options))
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


class SteppedStation(Station):
    """A station in virtual time: nothing happens but in run_for()."""

    def __init__(self, config, socket_dir):
        super().__init__(config, socket_dir)
        self.control = self.connect_when_it_listens("control.sock")
        self.control.settimeout(60)
        self.status()  # the first answer comes when all its sockets stand

    def connect_when_it_listens(self, name):
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline:
            assert self.process.poll() is None, self.process.stderr.read()
            try:
                return self.connect(name)
            except (FileNotFoundError, ConnectionRefusedError):
                time.sleep(0.01)
        raise AssertionError("the station does not listen")

    def ask(self, method, **parameters):
        request = {"method": f"org.stage.Control.{method}", "parameters": parameters}
        self.control.sendall(json.dumps(request).encode() + b"\0")
        reply = b""
        while not reply.endswith(b"\0"):
            more = self.control.recv(1 << 16)
            assert more, "cut off"
            reply += more
        return json.loads(reply[:-1])

    def status(self):
        return self.ask("GetStatus")["parameters"]["status"]

    def run_for(self, seconds, **options):
        """However long that takes."""
        time_told = self.ask("Advance", seconds=seconds, **options)["parameters"]
        while not time_told["arrived"]:
            time.sleep(0.005)
            time_told = self.ask("Advance", seconds=0, **options)["parameters"]
        assert time_told["now_ns"] == time_told["until_ns"]

    def subscribe(self, count):
        """A tap that ends after `count` sets and is there before time goes on; then its output.

        That is a file, because a tap that waits for the test to read would stop the time.
        """
        before = len(self.status()["stream"]["subscribers"])
        output = self.socket_dir / f"tap{before}.jsonl"
        with output.open("w") as file:
            tap = subprocess.Popen([STAGECTL, "stream", "tap", "--count", str(count), "--json",
                                    "--seconds", "100000", "--socket-dir", self.socket_dir],
                                   stdout=file)
        while len(self.status()["stream"]["subscribers"]) == before:
            assert tap.poll() is None
            time.sleep(0.01)
        return tap, output


@pytest.fixture
def start_stepped(recording, tmp_path):
    """start_stepped(more YAML of `sim`) -> a SteppedStation, ended with the test."""
    stations = []

    def start_one(sim=""):
        name = f"stepped{len(stations)}"
        config = tmp_path / f"{name}.yaml"
        text = simulated(recording, f"seed: 5, clock: stepped{sim}").replace("rig: rig", f"rig: {recording}/rig")
        config.write_text(text.replace("layout: layout.yaml", f"layout: {recording}/layout.yaml"))
        stations.append(SteppedStation(config, tmp_path / name))
        return stations[-1]

    yield start_one
    for station in stations:
        station.end()
