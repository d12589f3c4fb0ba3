"""stagectl calibrate: from a recording of the board to a rig in force, and what it says when not."""
import fcntl
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import time

import numpy
import pytest

from conftest import STAGECTL, ctl, link_images

CAMERAS = ("ir0", "ir1", "ir2", "ir3")


@pytest.fixture(scope="module")
def waved(tmp_path_factory):
    """A board before the cameras of the fixture `recording`; its rig is the truth."""
    place = tmp_path_factory.mktemp("waved") / "stage"
    done = ctl("sim", "record", place, "--scene", "board", "--seconds", "20", "--rate", "1",
               "--seed", "5", "--cameras", "4", timeout=120)
    assert done.returncode == 0, done.stderr
    return place


@pytest.fixture(scope="module")
def calibrated(waved, tmp_path_factory):
    """What the verb says of it, and the rig that it made."""
    rig = tmp_path_factory.mktemp("calibrated") / "rig"
    done = ctl("calibrate", "cameras", "--from", waved, "--out", rig, "--json", timeout=150)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), rig


@pytest.fixture
def short(waved, tmp_path):
    """Its first three poses, to be spoiled."""
    stage = pathlib.Path(shutil.copytree(waved, tmp_path / "stage", copy_function=link_images))
    for camera in CAMERAS:
        table = stage / camera / "frames.csv"
        table.write_text("\n".join(table.read_text().splitlines()[:4]) + "\n")
    return stage


@pytest.fixture
def corners(calibrated, tmp_path):
    """The corners that were kept, to be spoiled."""
    return pathlib.Path(shutil.copy(calibrated[1] / "corners.vnl", tmp_path / "corners.vnl"))


def refused(*arguments):
    done = ctl("calibrate", "cameras", *arguments, timeout=120)
    assert done.returncode == 3, done.stdout + done.stderr
    return done.stderr


def distance_rms_mm(shots, truths):
    """Of all named markers, rigidly aligned."""
    found, true = [], []
    for shot, truth in zip(shots, truths):
        where = {marker["name"]: marker["p_m"] for marker in truth["markers"]}
        for marker in shot["markers"]:
            if marker["label"] and marker["p_m"]:
                found.append(marker["p_m"])
                true.append(where[marker["label"]])
    assert len(found) > 1000
    a, b = (numpy.array(points) - numpy.mean(points, axis=0) for points in (found, true))
    u, _, vt = numpy.linalg.svd(a.T @ b)
    turn = u @ numpy.diag([1, 1, numpy.sign(numpy.linalg.det(u @ vt))]) @ vt
    return 1e3 * numpy.sqrt(((a @ turn - b) ** 2).sum(axis=1).mean())


def test_markers_are_in_place_with_a_rig_made_from_pictures(recording, calibrated):
    config = recording / "calibrated.yaml"
    config.write_text(re.sub(r"^rig: .*", f"rig: {calibrated[1]}",
                             (recording / "stage.yaml").read_text(), flags=re.M))
    done = ctl("process", config)
    assert done.returncode == 0, done.stderr
    shots = [json.loads(line) for line in done.stdout.splitlines()]
    truths = [json.loads(line) for line in (recording / "truth.jsonl").read_text().splitlines()]
    assert distance_rms_mm(shots, truths) <= 0.15


def test_result_says_what_it_is_worth(calibrated):
    result, rig = calibrated
    assert result["passed"] and result["number"] == 1
    assert result["rms_px"] < 0.1 and result["worst_mm"] < 0.1
    assert [camera["name"] for camera in result["cameras"]] == list(CAMERAS)
    assert all(camera["linked"] == 3 for camera in result["cameras"])
    report = (rig / "report.html").read_text()
    assert "passed" in report and "<svg" in report
    assert "http" not in report and "nan" not in report.lower().replace("name", "")


def test_same_corners_give_the_same_bytes(calibrated, corners, tmp_path):
    done = ctl("calibrate", "cameras", "--from", corners, "--out", tmp_path / "rig", timeout=120)
    assert done.returncode == 0, done.stderr
    for file in calibrated[1].iterdir():
        assert file.read_bytes() == (tmp_path / "rig" / file.name).read_bytes(), file.name


MRCAL_LOOKS = """
import mrcal, numpy, sys
model = mrcal.cameramodel(sys.argv[1])
inputs = model.optimization_inputs()
left = mrcal.optimizer_callback(**inputs, no_jacobian=True, no_factorization=True)[1]
seen = inputs["observations_board"][..., 2].ravel() > 0
left = left[:2 * seen.size].reshape(-1, 2)[seen]
print(numpy.sqrt((left ** 2).sum() / seen.sum()))
print(abs(model.intrinsics()[1] - inputs["intrinsics"][model.icam_intrinsics()]).max())
"""


def test_mrcal_opens_the_models_with_what_they_were_made_from(calibrated):
    result, rig = calibrated
    if subprocess.run(["/usr/bin/python3", "-c", "import mrcal"], capture_output=True,
                      check=False).returncode:
        pytest.skip("python3-mrcal is not installed")
    for camera in CAMERAS:
        model = rig / f"{camera}.cameramodel"
        looked = subprocess.run(["/usr/bin/python3", "-c", MRCAL_LOOKS, model], text=True,
                                capture_output=True, check=True).stdout.split()
        assert float(looked[0]) == pytest.approx(result["rms_px"], rel=1e-9)
        assert float(looked[1]) == 0
    shown = subprocess.run(["/usr/bin/python3", "/usr/bin/mrcal-show-residuals", "--magnitudes",
                            "--hardcopy", rig.parent / "shown.png", model], check=False,
                           capture_output=True, text=True) if pathlib.Path(
                               "/usr/bin/mrcal-show-residuals").exists() else None
    assert shown is None or shown.returncode == 0, shown.stderr


def numbers_of(model):
    return {line.split(":")[0]: line for line in model.read_text().splitlines()
            if re.match(r" *'(lensmodel|intrinsics|extrinsics|imagersize)'", line)}


def test_no_python_is_needed_and_makes_the_same_rig(calibrated, corners, tmp_path, monkeypatch):
    (tmp_path / "mrcal.py").write_text("raise ImportError('as if it were not installed')\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    done = ctl("calibrate", "cameras", "--from", corners, "--out", tmp_path / "rig", timeout=120)
    assert done.returncode == 0, done.stderr
    assert "python3-mrcal is not installed" in done.stderr
    assert sorted(p.name for p in (tmp_path / "rig.d").iterdir()) == ["0001"]
    for file in calibrated[1].iterdir():
        mine = tmp_path / "rig" / file.name
        if file.suffix == ".cameramodel":
            assert "optimization_inputs" not in mine.read_text()
            assert len(numbers_of(mine)) == 4 and numbers_of(mine) == numbers_of(file)
        else:
            assert mine.read_bytes() == file.read_bytes(), file.name


def test_rig_from_before_keeps_its_frame_and_can_come_back(waved, corners, tmp_path):
    config = tmp_path / "stage.yaml"
    config.write_text((waved / "stage.yaml").read_text())
    shutil.copytree(waved / "rig", tmp_path / "rig")
    done = ctl("calibrate", "cameras", "--from", corners, "--config", config, timeout=120)
    assert done.returncode == 0, done.stderr
    revisions = json.loads(ctl("calibrate", "list", config, "--json").stdout)
    assert [(r["number"], r["in_force"]) for r in revisions] == [(1, False), (2, True)]
    assert "moved since before" in (tmp_path / "rig" / "report.html").read_text()
    assert "passed: true" in ctl("calibrate", "show", config).stdout
    assert ctl("calibrate", "rollback", config).returncode == 0
    assert sorted(p.name for p in (tmp_path / "rig").iterdir()) == [
        f"{camera}.cameramodel" for camera in CAMERAS]
    assert ctl("calibrate", "rollback", config).returncode == 3
    assert ctl("calibrate", "rollback", config, "--revision", "2").returncode == 0
    assert (tmp_path / "rig" / "rig.yaml").exists()


def test_spoilt_rig_yaml_is_told_by_its_place(calibrated, tmp_path):
    store = pathlib.Path(shutil.copytree(calibrated[1].parent / "rig.d", tmp_path / "rig.d"))
    (tmp_path / "rig").symlink_to("rig.d/0001")
    facts = store / "0001" / "rig.yaml"
    said = json.loads(ctl("calibrate", "show", tmp_path / "rig", "--json").stdout)
    assert said["rms_px"] == pytest.approx(calibrated[0]["rms_px"], abs=1e-4)
    assert said["revision"] == calibrated[0]["revision"] and said["passed"]
    facts.write_text(re.sub(r"^rms_px: .*", "rms_px: none", facts.read_text(), flags=re.M))
    for verb in ("show", "list"):
        done = ctl("calibrate", verb, tmp_path / "rig")
        assert done.returncode == 3
        assert re.search(r"rig\.yaml:\d+:9: rms_px: ", done.stderr), done.stderr


def test_a_rig_or_revision_that_is_not_there_is_told(calibrated, recording, tmp_path):
    done = ctl("calibrate", "show", recording / "stage.yaml")
    assert done.returncode == 3 and "calibrate cameras makes one" in done.stderr
    shutil.copytree(calibrated[1].parent / "rig.d", tmp_path / "rig.d")
    (tmp_path / "rig").symlink_to("rig.d/0001")
    for verb in ("show", "rollback"):
        done = ctl("calibrate", verb, tmp_path / "rig", "--json", "--revision", "77")
        assert (done.returncode, done.stdout) == (3, "") and "no revision 0077" in done.stderr
    for verb in ("list", "show", "rollback"):
        done = ctl("calibrate", verb, tmp_path / "none")
        assert done.returncode == 3 and f"{tmp_path}/none" in done.stderr
        assert not (tmp_path / "none.d").exists()


def test_while_a_rig_is_calibrated_nothing_else_comes_into_force(calibrated, tmp_path):
    shutil.copytree(calibrated[1].parent / "rig.d", tmp_path / "rig.d")
    (tmp_path / "rig").symlink_to("rig.d/0001")
    holder = os.open(tmp_path / "rig.d", os.O_RDONLY)
    fcntl.flock(holder, fcntl.LOCK_EX)
    done = ctl("calibrate", "rollback", tmp_path / "rig", "--revision", "1")
    os.close(holder)
    assert done.returncode == 7 and "another program calibrates" in done.stderr
    assert ctl("calibrate", "rollback", tmp_path / "rig", "--revision", "1").returncode == 0


def test_corners_that_cannot_be_kept_are_no_bad_input(corners, tmp_path):
    (tmp_path / "rig.d" / "corners.vnl").mkdir(parents=True)
    done = ctl("calibrate", "cameras", "--from", corners, "--out", tmp_path / "rig")
    assert done.returncode == 1 and "rig.d/corners.vnl" in done.stderr


def test_a_file_or_link_of_the_users_is_not_taken_for_a_rig(tmp_path):
    """Told before the corners are looked for, which are not there."""
    (tmp_path / "precious.yaml").write_text("mine")
    (tmp_path / "rig").symlink_to("srv/monday")
    for name in ("precious.yaml", "rig"):
        told = refused("--from", tmp_path / "corners.vnl", "--out", tmp_path / name)
        assert name in told and "corners" not in told
    assert (tmp_path / "precious.yaml").read_text() == "mine"
    assert os.readlink(tmp_path / "rig") == "srv/monday"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["precious.yaml", "rig"]


def test_a_lens_that_cannot_be_is_told_before_anything_else():
    done = ctl("calibrate", "cameras", "--lens", "LENSMODEL_BOTTLE")
    assert done.returncode == 2 and "LENSMODEL_BOTTLE" in done.stderr


def test_rig_that_fails_its_limits_does_not_come_into_force(waved, corners, tmp_path):
    config = tmp_path / "stage.yaml"
    config.write_text((waved / "stage.yaml").read_text().replace(
        "calibration:\n", "calibration:\n  limits: {rms_px: 0.001}\n"))
    shutil.copytree(waved / "rig", tmp_path / "rig")
    done = ctl("calibrate", "cameras", "--from", corners, "--config", config, timeout=120)
    assert done.returncode == 3
    assert "FAILED" in done.stdout and "NOT in force" in done.stdout
    assert not (tmp_path / "rig").is_symlink()
    assert not (tmp_path / "rig" / "rig.yaml").exists()
    done = ctl("calibrate", "rollback", config, "--revision", "2")
    assert done.returncode == 3 and "failed its limits" in done.stderr


def test_board_of_another_size_shows_beside_the_rig_before(waved, corners, tmp_path):
    text = corners.read_text()
    corners.write_text(re.sub(r"(# stage-board \d+ \d+) \S+", r"\1 0.0354", text))
    assert text != corners.read_text()
    shutil.copytree(waved / "rig", tmp_path / "rig")
    said = refused("--from", corners, "--out", tmp_path / "rig")
    assert "all distances between cameras" in said and "--accept-scale" in said
    assert not (tmp_path / "rig").is_symlink()


def test_camera_without_link_is_named(corners, tmp_path):
    corners.write_text(re.sub(r"^ir3-00", "ir3-01", corners.read_text(), flags=re.M))
    said = refused("--from", corners, "--out", tmp_path / "rig")
    assert "camera ir3: no link" in said


def test_rig_without_a_camera_of_the_config_does_not_replace_it(waved, corners, tmp_path):
    config = tmp_path / "stage.yaml"
    config.write_text((waved / "stage.yaml").read_text())
    shutil.copytree(waved / "rig", tmp_path / "rig")
    text = corners.read_text().splitlines(keepends=True)
    corners.write_text("".join(line for line in text if "ir2" not in line))
    assert "camera ir2: in" in refused("--from", corners, "--config", config)
    assert not (tmp_path / "rig").is_symlink()


def test_two_operators_do_not_calibrate_one_rig_at_once(waved, tmp_path):
    command = ["calibrate", "cameras", "--from", waved, "--out", tmp_path / "rig"]
    with subprocess.Popen([STAGECTL, *command], stdout=subprocess.DEVNULL,
                          stderr=subprocess.DEVNULL) as first:
        time.sleep(0.5)
        second = ctl(*command)
        first.kill()
    assert second.returncode == 7 and "another program calibrates" in second.stderr
    first = subprocess.run([STAGECTL, *command], capture_output=True, timeout=120, check=False)
    assert first.returncode == 0, first.stderr


def test_one_device_under_two_names_is_named(corners, tmp_path):
    lines = [line for line in corners.read_text().splitlines() if not line.startswith("ir1-")]
    lines += [line.replace("ir0-", "ir1-") for line in lines if line.startswith("ir0-")]
    corners.write_text("\n".join(lines) + "\n")
    said = refused("--from", corners, "--out", tmp_path / "rig")
    assert "ir0 and ir1" in said and "one device" in said


def test_too_few_views_are_counted(short):
    said = refused("--from", short)
    assert "camera ir1: 3 usable views" in said and "wave" in said
    assert not (short / "rig").is_symlink()
    assert (short / "rig.d" / "corners.vnl").exists()


def test_another_board_is_told(short, tmp_path):
    board = tmp_path / "board.yaml"
    board.write_text("squares_x: 8\nsquares_y: 9\nsquare_m: 0.035\n")
    said = refused("--from", short, "--board", board)
    assert "show another board than 8 x 9" in said


def rewrite(short, camera, change):
    for image in (short / camera).glob("*.pgm"):
        pixels = image.read_bytes()[len(b"P5\n1280 1024\n255\n"):]
        rows = change([pixels[i:i + 1280] for i in range(0, len(pixels), 1280)])
        image.unlink()
        image.write_bytes(b"P5\n1280 %d\n255\n" % len(rows) + b"".join(rows))


def test_mirrored_camera_is_told(short):
    rewrite(short, "ir2", lambda rows: [row[::-1] for row in rows])
    assert "camera ir2: its pictures are mirrored" in refused("--from", short)


def test_camera_at_another_resolution_is_told(short):
    rewrite(short, "ir0", lambda rows: rows[:960])
    said = refused("--from", short)
    assert "camera ir0: its pictures are 1280x960" in said and "1280x1024" in said


def test_no_board_in_the_config_is_told(short):
    config = short / "stage.yaml"
    config.write_text(re.sub(r"calibration:\n.*\n", "", config.read_text()))
    assert "calibration.board: missing" in refused("--from", short)


def test_ctrl_c_keeps_what_was_found(waved, tmp_path):
    rig = tmp_path / "rig"
    verb = subprocess.Popen([STAGECTL, "calibrate", "cameras", "--from", waved, "--out", rig],
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    time.sleep(0.5)
    verb.send_signal(signal.SIGINT)
    _, said = verb.communicate(timeout=30)
    assert verb.returncode == 6, said
    assert "--from" in said and not rig.exists()
    assert "ir0-0000" in (tmp_path / "rig.d" / "corners.vnl").read_text()


def test_board_is_printed_for_the_cameras_that_see_it(tmp_path):
    done = ctl("calibrate", "board", "--print", tmp_path / "board.pdf", "--distance-m", "4",
               "--focal-px", "900", "--save", tmp_path / "board.yaml", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["square_m"] == pytest.approx(0.127, abs=1e-6)
    assert (tmp_path / "board.pdf").read_bytes().startswith(b"%PDF")
    assert "square_m: 0.127" in (tmp_path / "board.yaml").read_text()
    assert ctl("calibrate", "board", "--print", tmp_path / "b.pdf", "--distance-m",
               "4").returncode == 2
    assert ctl("calibrate", "board").returncode == 2
