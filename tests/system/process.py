"""stagectl process: the recording in, one JSON object per shot out."""
import json
import signal
import subprocess
import time

import pytest

from conftest import STAGECTL, ctl, truncate


def process(config, *options):
    done = ctl("process", config, *options)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_same_files_give_the_same_bytes(recording, tmp_path):
    config = recording / "stage.yaml"
    first = process(config, "--threads", "1")
    assert first == process(config, "--threads", "4")
    process(config, "--output", tmp_path / "out.jsonl")
    assert first == (tmp_path / "out.jsonl").read_text()
    assert [path.name for path in tmp_path.iterdir()] == ["out.jsonl"]


def test_every_shot_is_one_object_of_the_promised_shape(recording):
    shots = [json.loads(line) for line in process(recording / "stage.yaml").splitlines()]
    assert [shot["shot"] for shot in shots] == list(range(48))
    assert set(shots[0]) == {"shot", "mid_exposure_ns", "markers", "heads"}
    for marker in shots[-1]["markers"]:
        layers = {"confidence", "stabilised_m"}
        promised = {"label", "p_m", "cov_m2", "residual_px", "cameras", "status"}
        assert promised <= set(marker) <= promised | layers | {"normalised_m", "gone", "ghost"}
        if marker["label"] and marker["status"] == "measured":
            assert layers <= set(marker) and 0 < marker["confidence"] <= 1
        assert marker["status"] in ("measured", "two_camera", "predicted", "missing")
        if marker["status"] == "missing":
            assert marker["p_m"] is None and marker["cov_m2"] is None
        else:
            assert len(marker["p_m"]) == 3 and len(marker["cov_m2"]) == 6
        if marker["status"] == "measured":
            assert marker["cameras"] >= 3
    head = shots[-1]["heads"][0]
    assert set(head) == {"actor", "q", "t_m", "residual_m"}
    assert abs(sum(x * x for x in head["q"]) - 1) < 1e-6


def test_markers_are_where_the_truth_says(recording):
    shots = [json.loads(line) for line in process(recording / "stage.yaml").splitlines()]
    truths = [json.loads(line) for line in (recording / "truth.jsonl").read_text().splitlines()]
    errors = []
    for shot, truth in zip(shots, truths):
        where = {marker["name"]: marker["p_m"] for marker in truth["markers"]}
        for marker in shot["markers"]:
            if marker["status"] == "measured" and marker["label"]:
                errors.append(sum((a - b) ** 2 for a, b in
                                  zip(marker["p_m"], where[marker["label"]])) ** 0.5)
    errors.sort()
    assert len(errors) > 40 * 40
    assert errors[len(errors) // 2] < 1e-4


def test_truncated_image_costs_one_camera_of_one_shot_and_is_named(stage):
    image = stage / "ir1" / "000020.pgm"
    truncate(image)
    done = ctl("process", stage / "stage.yaml")
    assert done.returncode == 3
    assert "ir1/000020.pgm" in done.stderr
    shots = [json.loads(line) for line in done.stdout.splitlines()]
    assert [shot["shot"] for shot in shots] == list(range(48))
    assert max(marker["cameras"] for marker in shots[20]["markers"]) == 3
    assert max(marker["cameras"] for marker in shots[21]["markers"]) == 4


def test_frames_without_shot_numbers_are_joined_by_time(stage):
    with_numbers = process(stage / "stage.yaml")
    for camera in range(4):
        table = stage / f"ir{camera}" / "frames.csv"
        rows = [line.partition(",")[2] for line in table.read_text().splitlines()]
        table.write_text("\n".join(rows) + "\n")
    assert process(stage / "stage.yaml") == with_numbers


def test_camera_that_drops_frames_is_missing_from_those_shots_only(stage):
    table = stage / "ir2" / "frames.csv"
    rows = table.read_text().splitlines()
    table.write_text("\n".join(row for row in rows if not row.startswith(("7,", "8,"))) + "\n")
    shots = [json.loads(line) for line in process(stage / "stage.yaml").splitlines()]
    seen = [max(marker["cameras"] for marker in shot["markers"]) for shot in shots]
    assert seen[7] == seen[8] == 3
    assert seen[6] == seen[9] == 4


def test_hd_cameras_are_accepted_and_not_tracked(stage):
    config = stage / "stage.yaml"
    without = process(config)
    config.write_text(config.read_text() +
                      '- {name: hd0, address: "v4l2:/dev/video0", role: hd}\n')
    assert process(config) == without


def repeat_last_image(stage, count):
    for table in stage.glob("ir*/frames.csv"):
        shot, mid_exposure_ns, *rest = table.read_text().splitlines()[-1].split(",")
        with table.open("a") as file:
            for more in range(1, count):
                time_ns = int(mid_exposure_ns) + more * 8333333
                print(int(shot) + more, time_ns, *rest, sep=",", file=file)


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_interrupted_it_leaves_no_file(stage, tmp_path, how):
    repeat_last_image(stage, 10000)
    output = tmp_path / "out" / "shots.jsonl"
    output.parent.mkdir()
    done = subprocess.Popen([STAGECTL, "process", stage / "stage.yaml", "--output", output])
    deadline = time.monotonic() + 5
    while not list(output.parent.iterdir()) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert list(output.parent.iterdir()) and done.poll() is None
    done.send_signal(how)
    assert done.wait(timeout=5) == -how
    assert not list(output.parent.iterdir())


def turn_camera(model, by_rad=5e-4):
    """About the stage's origin."""
    head, _, rest = model.read_text().partition("'extrinsics': [")
    numbers, _, tail = rest.partition("]")
    values = [float(x) for x in numbers.split(",") if x.strip()]
    values[1] += by_rad
    model.write_text(head + "'extrinsics': [ " + ", ".join(map(repr, values)) + " ]" + tail)


def test_a_rig_of_another_day_names_the_camera(tmp_path):
    take = tmp_path / "take"
    assert ctl("sim", "record", take, "--scene", "talking", "--seconds", "1.5", "--rate", "30").returncode == 0
    good = ctl("process", take / "stage.yaml", "--json").stderr.splitlines()[-1]
    assert json.loads(good)["rig"]["moved"] == []
    assert all(0.5 < camera["residual_sigmas"] < 2 for camera in json.loads(good)["rig"]["cameras"])
    turn_camera(take / "rig" / "ir1.cameramodel", 1e-4)
    assert "camera ir1: its spots are off by" in ctl("process", take / "stage.yaml").stderr
    turn_camera(take / "rig" / "ir1.cameramodel", 4e-4)
    done = ctl("process", take / "stage.yaml", "--json")
    assert [camera["camera"] for camera in json.loads(done.stderr.splitlines()[-1])["rig"]["moved"]] == ["ir1"]
    assert "camera ir1: " in ctl("process", take / "stage.yaml").stderr


def test_a_take_without_names_says_so_and_what_it_comes_from(stage):
    config = stage / "stage.yaml"
    told = json.loads(ctl("process", config, "--json").stderr.splitlines()[-1])
    assert told["unnamed"] is None and 0 < told["rig"]["residual_px"] < 0.3
    config.write_text(config.read_text().replace("files:ir0", "files:was0")
                      .replace("files:ir1", "files:ir0").replace("files:was0", "files:ir1"))
    done = ctl("process", config, "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stderr.splitlines()[-1])
    assert told["rig"]["residual_px"] is None
    assert told["unnamed"]["spots"] > 30 and told["unnamed"]["named"] < 3
    assert "swapped" in told["unnamed"]["remedy"]
    assert "no names for" in ctl("process", config).stderr


def test_a_camera_whose_times_jump_is_named_and_has_no_say(stage):
    table = stage / "ir2" / "frames.csv"
    lines = table.read_text().splitlines()
    at = lines[0].split(",").index("mid_exposure_ns")
    for i in range(31, len(lines)):
        row = lines[i].split(",")
        row[at] = str(int(row[at]) + 10 ** 18)
        lines[i] = ",".join(row)
    good = [json.loads(line) for line in process(stage / "stage.yaml").splitlines()]
    table.write_text("\n".join(lines) + "\n")
    done = ctl("process", stage / "stage.yaml")
    assert done.returncode == 3
    assert "camera ir2: in 18 shots" in done.stderr and "ir2/frames.csv:32)" in done.stderr
    shots = [json.loads(line) for line in done.stdout.splitlines()]
    for shot, was in zip(shots, good):
        assert abs(shot["mid_exposure_ns"] - was["mid_exposure_ns"]) < 100_000


def test_a_missing_image_costs_one_picture_and_a_foreign_table_is_refused(stage):
    (stage / "ir1" / "000005.pgm").unlink()
    done = ctl("process", stage / "stage.yaml")
    assert done.returncode == 3 and "1 incomplete" in done.stderr
    assert "1 of 48 images" in done.stderr and "ir1/000005.pgm" in done.stderr
    assert len(done.stdout.splitlines()) == 48
    for image in sorted((stage / "ir1").glob("*.pgm"))[:30]:
        image.unlink()
    done = ctl("process", stage / "stage.yaml")
    assert done.returncode == 3 and not done.stdout
    assert "frames.csv:2: file: '000000.pgm' is not a file" in done.stderr
