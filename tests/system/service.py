"""The station as a service: what it tells systemd, how fast it starts and stops, and that strobes
are dark at the end whatever the end was."""
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import tempfile
import time

import pytest
import stageclient
from conftest import STAGECTL, STAGED


class Manager:
    """The end of the notify socket that systemd holds."""

    def __init__(self, path):
        self.path = path
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(path))

    def hear(self, wanted, seconds):
        """The seconds until `wanted` came, or None."""
        begin = time.monotonic()
        while (left := begin + seconds - time.monotonic()) > 0:
            self.socket.settimeout(left)
            try:
                message = self.socket.recv(4096).decode()
            except TimeoutError:
                break
            if wanted in message.splitlines():
                return time.monotonic() - begin
        return None

    def forget(self):
        """What has come so far."""
        self.socket.setblocking(False)
        try:
            while self.socket.recv(4096):
                pass
        except BlockingIOError:
            pass


WATCHDOG_S = 2


@pytest.fixture
def manager(tmp_path):
    return Manager(tmp_path / "notify")


@pytest.fixture
def served(start, sim_config, manager, tmp_path):
    """A station with a manager; served(thread) lets that thread hang once tmp_path / "hang" is there."""
    def start_served(hanging="nobody"):
        return start(sim_config, environment={
            "NOTIFY_SOCKET": str(manager.path), "WATCHDOG_USEC": str(WATCHDOG_S * 1000000),
            "LD_PRELOAD": os.environ["HANG"], "HANG_THREAD": hanging,
            "HANG_FILE": str(tmp_path / "hang")})
    return start_served


@pytest.fixture
def strobes():
    """The line of the simulated strobes; a trigger's address must be short."""
    place = pathlib.Path(tempfile.mkdtemp(prefix="strobes"))
    yield place / "line"
    shutil.rmtree(place)


@pytest.fixture
def lit_config(sim_config, strobes, tmp_path):
    text = sim_config.read_text().replace("trigger: sim\n", f'trigger: "sim:{strobes}"\n')
    path = sim_config.parent / f"{strobes.parent.name}.yaml"
    path.write_text(text)
    yield path
    path.unlink()


def darken(config, environment=None):
    return subprocess.run([STAGED, "--darken", "--config", config], capture_output=True, text=True,
                          timeout=5, check=False, env=environment)


def test_the_manager_hears_of_start_life_and_end(served, manager):
    station = served()
    assert manager.hear("READY=1", 5) is not None
    for _ in range(3):
        assert manager.hear("WATCHDOG=1", WATCHDOG_S) is not None
    code, _, _ = station.stop()
    assert code == 0
    assert manager.hear("STOPPING=1", 1) is not None


def stalls_in_the_stream(station):
    with stageclient.connect(str(station.socket_dir / "stream.sock"), timeout_s=10) as client:
        return next(event for event in client
                    if isinstance(event, stageclient.Statistics)).stalled


@pytest.mark.parametrize("thread", ["ir2", "trigger"])
def test_a_thread_that_hangs_is_named_and_keeps_the_watchdog_from_being_kicked(
        served, manager, tmp_path, thread):
    station = served(thread).wait_running()
    assert manager.hear("WATCHDOG=1", WATCHDOG_S) is not None
    (tmp_path / "hang").touch()
    time.sleep(WATCHDOG_S / 4 + 0.2)  # the look under way may still see it moving
    manager.forget()
    assert manager.hear("WATCHDOG=1", 1.5 * WATCHDOG_S) is None
    [stalled] = station.status()["stalled"]
    assert stalled.startswith(f"{thread}: no heartbeat for ")
    assert f"{thread}: no heartbeat for" in station.ctl("status").stdout
    [stall] = stalls_in_the_stream(station)
    assert stall.thread == thread and stall.still_ns > 1e9


def test_hung_threads_share_the_half_second_that_a_stop_gives_them(served, tmp_path):
    station = served("ir").wait_running()  # all four of them
    (tmp_path / "hang").touch()
    time.sleep(0.2)
    code, said, seconds = station.stop()
    assert code == 4, said
    assert seconds <= 1


def test_a_terminal_that_goes_ends_the_station_in_order(start, lit_config, strobes):
    station = start(lit_config).wait_running()
    assert strobes.read_text() == "1\n"
    code, said, _ = station.stop(signal.SIGHUP)
    assert (code, strobes.read_text()) == (0, "0\n"), said
    assert not list(station.socket_dir.glob("*.sock"))


def test_under_nohup_a_terminal_may_go(start, lit_config):
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        station = start(lit_config).wait_running()
    finally:
        signal.signal(signal.SIGHUP, before)
    station.process.send_signal(signal.SIGHUP)
    time.sleep(0.3)
    assert station.status()["state"] == "running"


@pytest.mark.parametrize("modes", [("--check", "--idle"), ("--check", "--darken")])
def test_one_mode_at_a_time(lit_config, modes):
    done = subprocess.run([STAGED, "--config", lit_config, *modes], capture_output=True, text=True,
                          timeout=5, check=False)
    assert done.returncode == 2 and "usage" in done.stderr


def test_a_thread_that_hangs_does_not_hold_up_the_stop(start, lit_config, strobes, tmp_path):
    station = start(lit_config, environment={
        "LD_PRELOAD": os.environ["HANG"], "HANG_THREAD": "trigger",
        "HANG_FILE": str(tmp_path / "hang")}).wait_running()
    assert strobes.read_text() == "1\n"
    (tmp_path / "hang").touch()
    time.sleep(0.2)
    code, said, seconds = station.stop()
    assert (code, strobes.read_text()) == (4, "0\n"), said
    assert seconds <= 1


def test_a_labelled_marker_within_two_seconds_and_an_end_within_one(start, sim_config, tmp_path):
    """The best of three: what else the machine does is not the station's."""
    firsts, stops = [], []
    while len(firsts) < 3 and not (firsts and min(firsts) <= 2 and min(stops) <= 1):
        begin = time.monotonic()
        station = start(sim_config)
        while not (station.socket_dir / "stream.sock").exists():
            assert station.process.poll() is None and time.monotonic() < begin + 10
            time.sleep(0.005)
        tap = subprocess.Popen([STAGECTL, "stream", "tap", "--json", "--socket-dir",
                                station.socket_dir], stdout=subprocess.PIPE, text=True)
        for line in tap.stdout:
            if any(marker["label"] for marker in json.loads(line)["markers"]):
                break
        firsts.append(time.monotonic() - begin)
        tap.kill()
        tap.wait()
        code, said, seconds = station.stop()
        assert code == 0, said
        stops.append(seconds)
    print(f"first labelled marker after {min(firsts):.2f} s, stopped within {min(stops):.2f} s")
    assert min(firsts) <= 2
    assert min(stops) <= 1


def test_strobes_are_dark_after_an_end_that_was_asked_for(start, lit_config, strobes):
    station = start(lit_config).wait_running()
    assert strobes.read_text() == "1\n"
    station.stop()
    assert strobes.read_text() == "0\n"


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGABRT, signal.SIGSEGV])
def test_strobes_that_a_killed_station_left_burning_go_dark(start, lit_config, strobes, how):
    station = start(lit_config).wait_running()
    code, _, _ = station.stop(how)
    assert (code, strobes.read_text()) == (-how, "1\n")
    done = darken(lit_config)
    assert (done.returncode, done.stderr, strobes.read_text()) == (0, "", "0\n")


def test_strobes_are_dark_when_the_station_could_not_start(start, lit_config, strobes, tmp_path):
    (tmp_path / "file").write_text("")
    station = start(lit_config, socket_dir=tmp_path / "file")
    assert station.process.wait(timeout=5) == 5
    assert not strobes.exists() or strobes.read_text() in ("", "0\n")


def test_the_end_of_a_refused_station_leaves_the_other_ones_strobes(start, lit_config, strobes):
    start(lit_config).wait_running()
    second = start(lit_config)
    second.process.communicate(timeout=10)
    for status, line in [(second.process.returncode, "1\n"), ("KILL", "0\n")]:
        done = darken(lit_config, {**os.environ, "EXIT_STATUS": str(status)})
        assert (done.returncode, strobes.read_text()) == (0, line)


def test_where_there_is_nothing_to_darken_nothing_is_wrong(recording, sim_config):
    assert darken(recording / "stage.yaml").returncode == 0  # trigger: free
    assert darken(sim_config).returncode == 0


def test_darken_does_not_need_rig_layout_or_cameras(lit_config, strobes, tmp_path):
    text = lit_config.read_text().replace("rig: rig", "rig: nowhere").replace("sim:ir1", "sim:none")
    (tmp_path / "stage.yaml").write_text(text)
    strobes.write_text("1\n")
    done = darken(tmp_path / "stage.yaml")
    assert (done.returncode, strobes.read_text()) == (0, "0\n"), done.stderr


def test_darken_says_why_it_cannot(tmp_path):
    done = darken(tmp_path / "missing.yaml")
    assert done.returncode == 3 and "missing.yaml" in done.stderr


def page_faults(pid):
    """Of each thread, by name: faults that needed a new page so far."""
    faults = {}
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        name, rest = (task / "stat").read_text().split(" (", 1)[1].rsplit(") ", 1)
        faults[name] = int(rest.split()[7])
    return faults


def test_real_time_threads_find_their_memory_in_place(station):
    time.sleep(1)
    before = page_faults(station.process.pid)
    time.sleep(1)
    after = page_faults(station.process.pid)
    for thread in ["trigger", "solver", "ir0", "ir1", "ir2", "ir3"]:
        assert after[thread] - before[thread] <= 2, f"{thread}: {before} {after}"
