"""stagectl calibrate cameras before a running station: a board is waved, in real time."""
import json
import re
import shutil
import signal
import subprocess
import time

import pytest

from conftest import STAGECTL, ctl, simulated

BOARD = "board: {squares_x: 12, squares_y: 9, square_m: 0.035}"


@pytest.fixture(scope="module")
def four_cameras(tmp_path_factory):
    """A simulated stage: its config, layout and true rig."""
    place = tmp_path_factory.mktemp("live") / "stage"
    done = ctl("sim", "record", place, "--seconds", "0.02", "--cameras", "4", "--seed", "5")
    assert done.returncode == 0, done.stderr
    (place / "stage.yaml").write_text(
        simulated(place) + f"calibration: {{rate_hz: 4, poses_min: 20, {BOARD}}}\n")
    return place


@pytest.fixture
def live(four_cameras, tmp_path):
    place = tmp_path / "stage"
    place.mkdir()
    for name in ("stage.yaml", "layout.yaml"):
        shutil.copy(four_cameras / name, place)
    shutil.copytree(four_cameras / "rig", place / "rig")
    return place


@pytest.fixture
def station(start, live):
    return start_idle(start, live)


def start_idle(start, live):
    station = start(live / "stage.yaml", options=("--idle",))
    deadline = time.monotonic() + 10
    while not (station.socket_dir / "control.sock").exists():
        assert station.process.poll() is None, station.process.stderr.read()
        assert time.monotonic() < deadline
        time.sleep(0.02)
    return station


def begin(station, *arguments):
    return subprocess.Popen(
        [STAGECTL, "calibrate", "cameras", "--socket-dir", station.socket_dir, *arguments],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True)


def wait_for_line(stream, pattern):
    for line in stream:
        if re.search(pattern, line):
            return line
    raise AssertionError(f"no line with {pattern}")


def test_station_without_rig_gets_one_and_tracks_with_it(start, live):
    shutil.rmtree(live / "rig")
    station = start_idle(start, live)
    refused = station.ctl("start")
    assert refused.returncode == 3 and "there is no rig yet" in refused.stderr
    output, said = begin(station, "--json", "--seconds", "25").communicate(timeout=120)
    events = [json.loads(line) for line in output.splitlines()]
    result = events.pop()
    assert result["event"] == "result" and result["passed"], said
    assert result["worst_mm"] < 0.1 and result["wave_next"]["cameras"], said
    assert {event["event"] for event in events} == {"progress"}
    assert events[0]["progress"] < events[-1]["progress"] <= 1
    assert events[0]["next"] and len(events[0]["cameras"]) == 4
    assert station.status()["state"] == "configured"
    assert station.status()["rig_revision"] != "none"
    assert station.ctl("start").returncode == 0
    tap = station.ctl("stream", "tap", "--json", "--count", "60")
    last = json.loads(tap.stdout.splitlines()[-1])
    assert sum(marker["label"] is not None for marker in last["markers"]) > 60


def test_ctrl_c_keeps_what_was_found_and_the_rig_from_before(station, live):
    before = station.status()["rig_revision"]
    verb = begin(station)
    wait_for_line(verb.stderr, r"\b[5-9] poses")
    verb.send_signal(signal.SIGINT)
    output, said = verb.communicate(timeout=30)
    assert verb.returncode == 6, said
    assert "--from it goes on" in said and "views" in output
    assert station.status()["state"] == "configured"
    assert station.status()["rig_revision"] == before
    assert not (live / "rig").is_symlink()
    kept = (live / "rig.d" / "corners.vnl").read_text()
    assert len(set(re.findall(r"^ir\d-(\d+)", kept, flags=re.M))) >= 5
    again = ctl("calibrate", "cameras", "--from", live / "rig.d" / "corners.vnl", "--out",
                live / "other", timeout=60)
    assert "usable views" in again.stderr or again.returncode == 0, again.stderr
    verb = begin(station)
    wait_for_state(station, "calibrating")
    verb.send_signal(signal.SIGINT)
    assert "corners.before.vnl" in verb.communicate(timeout=30)[1]
    assert (live / "rig.d" / "corners.before.vnl").read_text() == kept


def test_running_station_is_left_alone(station):
    assert station.ctl("start").returncode == 0
    output, said = begin(station).communicate(timeout=20)
    assert output == "" and "the station is running" in said and "stagectl stop" in said
    assert station.status()["state"] == "running"


def test_station_that_dies_is_told_and_the_corners_stay(station, live):
    verb = begin(station)
    wait_for_line(verb.stderr, r"\b[2-9] poses")
    station.process.kill()
    _, said = verb.communicate(timeout=30)
    assert verb.returncode == 5, said
    assert "-0000" in (live / "rig.d" / "corners.vnl").read_text()
    assert "no longer calibrates" in said and str(live / "rig.d" / "corners.vnl") in said


def wait_for_state(station, state, seconds=5):
    deadline = time.monotonic() + seconds
    while station.status()["state"] != state:
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_station_does_not_calibrate_for_a_program_that_was_killed(station):
    verb = begin(station)
    wait_for_state(station, "calibrating")
    verb.kill()
    verb.communicate()
    wait_for_state(station, "configured")
    assert station.ctl("start").returncode == 0


def test_second_operator_is_refused_and_does_not_disturb_the_first(station, tmp_path):
    first = begin(station)
    wait_for_state(station, "calibrating")
    output, said = begin(station).communicate(timeout=20)
    assert output == "" and "another program calibrates this rig" in said
    output, said = begin(station, "--out", tmp_path / "other").communicate(timeout=20)
    assert output == "" and "wait for who calibrates" in said
    wait_for_line(first.stderr, r"\b[1-9] poses")
    first.send_signal(signal.SIGINT)
    assert first.communicate(timeout=30) and first.returncode == 6
    wait_for_state(station, "configured")


def test_another_board_is_told(station, tmp_path):
    board = tmp_path / "board.yaml"
    board.write_text("squares_x: 8\nsquares_y: 9\nsquare_m: 0.035\n")
    _, said = begin(station, "--seconds", "4", "--board", board).communicate(timeout=60)
    assert "show another board than 8 x 9" in said
    assert station.status()["state"] == "configured"


def test_no_board_in_the_config_is_told_before_anything_is_switched(station, live):
    config = live / "stage.yaml"
    config.write_text(config.read_text().replace(f", {BOARD}", ""))
    verb = begin(station)
    _, said = verb.communicate(timeout=20)
    assert verb.returncode == 3 and "calibration.board: missing" in said
    assert station.status()["run"] == 0


def test_without_a_station_it_says_so(tmp_path):
    done = ctl("calibrate", "cameras", "--socket-dir", tmp_path)
    assert done.returncode == 5 and "no station answers" in done.stderr
