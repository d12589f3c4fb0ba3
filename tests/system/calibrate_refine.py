"""stagectl calibrate refine and origin: a bumped camera is named and put right; the stage frame is set anew."""
import json
import math
import re
import shutil
import time

import pytest

from conftest import ctl, simulated

TURN_RAD = 0.4e-3


def turn_camera(model, turn_rad):
    """The model's camera looks elsewhere than the camera does, about its x axis."""
    text = model.read_text()
    found = re.search(r"('extrinsics': \[)([^\]]*)", text)
    rt = [float(x) for x in found.group(2).split(",") if x.strip()]
    r, t = matrix(rt[:3]), rt[3:]
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    by = [[1, 0, 0], [0, c, -s], [0, s, c]]
    r = [[sum(by[i][k] * r[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
    t = [sum(by[i][k] * t[k] for k in range(3)) for i in range(3)]
    model.write_text(text.replace(found.group(0), found.group(1) +
                                  ", ".join(map(repr, vector(r) + t)) + ", "))


def matrix(v):
    """Rodrigues' formula."""
    angle = math.sqrt(sum(x * x for x in v)) or 1e-30
    x, y, z = (a / angle for a in v)
    c, s = math.cos(angle), math.sin(angle)
    d = 1 - c
    return [[c + d * x * x, d * x * y - s * z, d * x * z + s * y],
            [d * x * y + s * z, c + d * y * y, d * y * z - s * x],
            [d * x * z - s * y, d * y * z + s * x, c + d * z * z]]


def vector(r):
    """Its inverse, for angles well below half a turn."""
    axis = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]]
    length = math.sqrt(sum(a * a for a in axis))
    angle = math.atan2(length, r[0][0] + r[1][1] + r[2][2] - 1)
    return [a / length * angle for a in axis]


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Long enough to refine from."""
    place = tmp_path_factory.mktemp("recording") / "stage"
    done = ctl("sim", "record", place, "--seconds", "0.8", "--rate", "60", "--cameras", "4", "--seed",
               "5", timeout=60)
    assert done.returncode == 0, done.stderr
    return place


@pytest.fixture
def own(recording, tmp_path):
    """A stage of the test's own, whose pictures are the recording's."""
    stage = tmp_path / "stage"
    shutil.copytree(recording / "rig", stage / "rig")
    shutil.copy(recording / "layout.yaml", stage)
    for camera in recording.glob("ir*"):
        (stage / camera.name).symlink_to(camera)
    shutil.copy(recording / "stage.yaml", stage)
    return stage


@pytest.fixture
def live(own):
    """The same rig before simulated cameras, one of which is bumped."""
    config = own / "stage.yaml"
    config.write_text(simulated(own, "seed: 5, faults: [{camera: ir2, kind: bump, at_s: 4, angle_mrad: 0.5}]"))
    return config


def refined(*arguments):
    done = ctl("calibrate", "refine", "--json", *arguments, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads(done.stdout)


def test_a_recording_puts_a_bumped_camera_right(own):
    model = own / "rig" / "ir1.cameramodel"
    before = model.read_bytes()
    turn_camera(model, TURN_RAD)
    said = refined("--from", own)
    ir1 = said["cameras"][1]
    assert [camera["moved"] for camera in said["cameras"]] == [False, True, False, False]
    assert abs(ir1["turned_mrad"] - 0.4) < 0.1 and ir1["rms_after_px"] < 0.1
    assert said["number"] == 2 and (own / "rig").is_symlink()
    assert (own / "rig" / "ir0.cameramodel").read_bytes() == (
        own / "rig.d" / "0001" / "ir0.cameramodel").read_bytes()
    assert before != model.read_bytes()
    again = refined("--from", own)
    assert again["moved_count"] == 0 and again["number"] is None
    listed = ctl("calibrate", "list", own / "stage.yaml").stdout
    assert "refine of 0001" in listed


def test_a_short_recording_is_refused(own):
    for camera in own.glob("ir*"):
        table = (camera / "frames.csv").read_text().splitlines()
        real = camera.resolve()
        camera.unlink()
        camera.mkdir()
        for picture in real.glob("*.p*"):
            (camera / picture.name).symlink_to(picture)
        (camera / "frames.csv").write_text("\n".join(table[:20]) + "\n")
    done = ctl("calibrate", "refine", "--from", own)
    assert done.returncode == 3 and "too few" in done.stderr
    assert not (own / "rig.d").exists()


def test_a_running_station_is_told_who_moved_and_goes_on(start, live):
    station = start(live)
    station.wait_running(3)
    deadline = time.monotonic() + 20
    while not station.status()["cameras"][2]["ledger"]["moved"] and time.monotonic() < deadline:
        time.sleep(0.1)
    ledger = station.status()["cameras"][2]["ledger"]
    assert ledger["moved"] and ledger["moved_mrad"] > 0.1
    assert "stagectl calibrate refine" in station.ctl("status").stdout
    said = json.loads(station.ctl("calibrate", "refine", "--json", "--seconds", "3").stdout)
    assert [camera["moved"] for camera in said["cameras"]] == [False, False, True, False]
    status = station.status()
    assert status["rig_revision"] == said["revision"] and status["rig_serial"] == 2
    assert status["rig_number"] == said["number"]
    assert status["shots"]["lost"] == 0
    time.sleep(3)
    assert not station.status()["cameras"][2]["ledger"]["moved"]


def test_a_board_at_rest_sets_the_stage_frame(tmp_path):
    place = tmp_path / "board"
    done = ctl("sim", "record", place, "--scene", "board", "--seconds", "1", "--rate", "1", "--seed",
               "5", "--cameras", "6", timeout=60)
    assert done.returncode == 0, done.stderr
    first = json.loads(ctl("calibrate", "origin", "--from", place, "--json").stdout)
    assert first["number"] == 2 and first["off_mm"] < 0.5 and first["points"] > 30
    again = json.loads(ctl("calibrate", "origin", "--from", place, "--json").stdout)
    assert all(abs(x) < 1e-6 for x in again["origin_before_m"])  # it is there already


def test_an_l_frame_that_is_not_there_is_said_so(own):
    done = ctl("calibrate", "origin", "--from", own, "--long-arm-mm", "400", "--short-arm-mm", "250")
    assert done.returncode == 3 and "measure the arms" in done.stderr
    assert ctl("calibrate", "origin", "--long-arm-mm", "400").returncode == 2
