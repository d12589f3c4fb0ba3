"""The demonstration on both kinds of cameras, and that it leaves nothing behind however it ends.

Run by meson, which sets STAGE_DEMO to the program.
"""
import json
import os
import pathlib
import re
import signal
import subprocess
import time

import pytest

START_S = 60  # of a busy machine; what hangs is ended all the same

@pytest.fixture
def start(tmp_path):
    """Starts the demonstration with these arguments, in a directory of its own."""
    def start_demo(*args):
        return subprocess.Popen([os.environ["STAGE_DEMO"], *args], text=True,
                                env={**os.environ, "TMPDIR": str(tmp_path)},
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    return start_demo


def wait_for_first_set(demo):
    for line in demo.stderr:
        if "the first marker set" in line:
            return
    pytest.fail("no marker set came")


def children_of(pid):
    return [int(p) for p in pathlib.Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def has_ended(pid):
    """Within a second; a zombie has ended."""
    for _ in range(100):
        try:
            if re.search(r"^State:\s+Z", pathlib.Path(f"/proc/{pid}/status").read_text(), re.M):
                return True
        except (FileNotFoundError, ProcessLookupError):
            return True
        time.sleep(0.01)
    return False


def test_demo_on_in_process_cameras_passes(start, tmp_path):
    with start("--sim", "--seconds", "4", "--json") as demo:
        output, messages = demo.communicate(timeout=START_S + 40)
    results = json.loads(output)
    assert demo.returncode == 0, output + messages
    assert results["passed"] and results["shots"]["received"] > 400
    assert results["error_mm"]["median"] < 0.1
    assert results["simulator"]["frames_late"] >= 0
    assert not list(tmp_path.iterdir())


def test_demo_counts_the_frames_of_its_hd_cameras(start):
    with start("--sim", "--hd", "2", "--seconds", "3", "--json") as demo:
        output, messages = demo.communicate(timeout=START_S + 40)
    hd = json.loads(output)["hd"]
    assert hd["shots"] > 80, output + messages
    assert [camera["name"] for camera in hd["cameras"]] == ["hd0", "hd1"]
    assert all(c["frames"] > 80 and c["phase"] == 0 and c["off_phase"] == 0 for c in hd["cameras"])


def test_station_under_fire_mispairs_nothing_and_names_every_fault(start, tmp_path):
    with start("--stress", "--seconds", "15", "--hd", "0", "--json") as demo:
        output, messages = demo.communicate(timeout=START_S + 60)
    results = json.loads(output)
    assert not results["ended_early"], messages
    assert all(results["stress"]["criteria"].values()), output
    assert not list(tmp_path.iterdir())


def test_demo_on_gige_cameras_streams_true_markers(start, tmp_path):
    with start("--seconds", "4", "--json") as demo:
        output, messages = demo.communicate(timeout=START_S + 40)
    results = json.loads(output)
    assert results["cameras"] == 4 and results["shots"]["received"] > 200, output + messages
    assert results["error_mm"]["median"] < 0.1
    assert results["simulator"]["frames_sent"] > 800
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("args, programs", [
    pytest.param(["--sim"], 1, id="sim"),
    pytest.param([], 2, id="gige"),
])
def test_interrupted_demo_leaves_nothing_behind(start, tmp_path, args, programs):
    with start(*args, "--seconds", "60") as demo:
        wait_for_first_set(demo)
        children = children_of(demo.pid)
        demo.send_signal(signal.SIGINT)
        demo.communicate(timeout=20)
    assert demo.returncode == 130
    assert len(children) == programs and all(has_ended(pid) for pid in children)
    assert not list(tmp_path.iterdir())


def test_demo_interrupted_while_it_calibrates_leaves_nothing_behind(start, tmp_path):
    with start("--calibrate") as demo:
        for line in demo.stderr:
            if "poses" in line:
                break
        children = children_of(demo.pid)
        demo.send_signal(signal.SIGINT)
        demo.communicate(timeout=20)
    assert demo.returncode == 130
    assert len(children) == 2 and all(has_ended(pid) for pid in children)
    assert not list(tmp_path.iterdir())


def test_killed_demo_leaves_no_process_behind(start):
    with start("--sim", "--seconds", "60") as demo:
        wait_for_first_set(demo)
        children = children_of(demo.pid)
        demo.kill()
        demo.communicate(timeout=20)
    assert len(children) == 1 and all(has_ended(pid) for pid in children)


def test_death_of_the_station_fails_the_demo(start, tmp_path):
    with start("--sim", "--seconds", "60") as demo:
        wait_for_first_set(demo)
        os.kill(children_of(demo.pid)[0], signal.SIGKILL)
        output, messages = demo.communicate(timeout=20)
    assert demo.returncode == 1
    assert "station has ended" in messages and "the stream ended early" in output
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("args", [
    pytest.param(["--seconds", "0"], id="seconds"),
    pytest.param(["--stress", "--seconds", "5"], id="stress"),
    pytest.param(["--calibrate", "--stress"], id="calibrate_under_fire"),
    pytest.param(["--seed", "x"], id="seed"),
    pytest.param(["--nonsense"], id="option"),
    pytest.param(["extra"], id="argument"),
    pytest.param(["--hd", "1"], id="hd_without_sim"),
    pytest.param(["--sim", "--hd", "4"], id="hd"),
])
def test_wrong_usage_starts_nothing(start, tmp_path, args):
    with start(*args) as demo:
        _, messages = demo.communicate(timeout=20)
    assert demo.returncode == 2 and messages
    assert not list(tmp_path.iterdir())


def test_unknown_scene_starts_nothing(start, tmp_path):
    with start("--sim", "--scene", "nowhere") as demo:
        _, messages = demo.communicate(timeout=20)
    assert demo.returncode == 3 and "nowhere" in messages
    assert not list(tmp_path.iterdir())
