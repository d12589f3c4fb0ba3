"""The station in virtual time: what happens does not depend on the machine that it happens on."""
import json
import os
import signal
import subprocess
import sys
import time

import pytest

from conftest import STAGED, ctl


def play(station, seconds, sets):
    """What a subscriber sees of the first `seconds` of the scene."""
    tap, output = station.subscribe(sets)
    station.run_for(seconds)
    tap.wait(timeout=60)
    return [json.loads(line) for line in output.read_text().splitlines()]


@pytest.fixture
def hogs():
    """Four programs that take all the time of the machine that they can get."""
    programs = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(4)]
    yield
    for program in programs:
        program.kill()
        program.wait()


def test_time_stands_still_until_it_is_asked_to_go_on(start_stepped):
    station = start_stepped()
    time.sleep(0.3)
    assert station.status()["shots"]["edges"] == 0
    station.run_for(0.5)
    shots = station.status()["shots"]
    time.sleep(0.3)
    assert station.status()["shots"] == shots
    assert shots["edges"] == 48  # the scene begins after a tenth of a second


def test_same_scene_gives_the_same_sets_shot_for_shot(start_stepped):
    first, second = (play(start_stepped(), 2.2, 250) for _ in range(2))
    assert len(first) == 250
    assert first == second


def test_busy_machine_changes_nothing(start_stepped, hogs):
    station = start_stepped()
    sets = play(station, 1.2, 130)
    status = station.status()
    assert [s["shot"] for s in sets] == list(range(130))
    assert status["shots"]["lost"] == 0 and status["shots"]["incomplete"] == 0
    assert status["sim_late"] == 0
    assert status["stream"]["sets_lost"] == 0


def test_time_waits_for_a_subscriber_that_reads_nothing(start_stepped):
    station = start_stepped()
    idle = station.connect("stream.sock")
    time_told = station.ask("Advance", seconds=20)["parameters"]
    time.sleep(1)
    before = station.ask("Advance", seconds=0)["parameters"]
    time.sleep(0.2)
    assert station.ask("Advance", seconds=0)["parameters"] == before
    assert not before["arrived"] and before["now_ns"] < time_told["until_ns"]
    assert station.status()["stream"]["sets_lost"] == 0
    idle.close()
    station.run_for(0)


def test_outrun_subscriber_loses_sets_and_is_named(start_stepped):
    station = start_stepped()
    idle = station.connect("stream.sock")
    station.run_for(12, outrun_subscribers=True)
    stream = station.status()["stream"]
    assert stream["subscribers"][0]["pid"] == os.getpid()
    assert stream["subscribers"][0]["sets_lost"] == stream["sets_lost"] > 100
    assert stream["sets_published"] == station.status()["shots"]["solved"]
    idle.close()


def test_rates_are_exact(start_stepped):
    station = start_stepped()
    station.run_for(2.5)
    status = station.status()
    assert abs(status["shots"]["per_s"] - 120) < 1.5
    for camera in status["cameras"]:
        assert abs(camera["frames_per_s"] - 120) < 1.5
        assert sum(camera["losses"].values()) - camera["losses"]["timeouts"] == 0


def test_stop_does_not_wait_for_time(start_stepped):
    station = start_stepped()
    station.run_for(0.3)
    code, said, seconds = station.stop()
    assert code == 0, said
    assert seconds < 5


def test_killed_at_any_time_leaves_no_process(start_stepped):
    station = start_stepped()
    station.ask("Advance", seconds=100)
    code, _, _ = station.stop(signal.SIGKILL)
    assert code == -signal.SIGKILL


def test_steps_are_refused_in_real_time_and_when_they_are_no_time(station, start_stepped):
    done = station.ctl("status")
    assert done.returncode == 0
    stepped = start_stepped()
    for seconds in (-1, 1e9, "soon", None):
        reply = stepped.ask("Advance", seconds=seconds)
        assert reply["error"].endswith("InvalidParameter"), seconds


def test_virtual_time_is_refused_for_real_devices(recording, tmp_path):
    text = (recording / "stage.yaml").read_text()
    config = tmp_path / "stage.yaml"
    config.write_text(text + "sim: {clock: virtual}\n")
    line = len(text.splitlines()) + 1
    checked = ctl("config", "check", config)
    assert checked.returncode == 3
    assert f"stage.yaml:{line}:" in checked.stderr
    assert "sim.clock" in checked.stderr and "ir0" in checked.stderr and "trigger" in checked.stderr
    done = subprocess.run([STAGED, "--config", config], capture_output=True, text=True, timeout=10,
                          check=False)
    assert done.returncode == 3
