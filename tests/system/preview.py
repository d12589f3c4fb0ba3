"""Contact sheets: a person sees what the cameras see. What they must show is told beside them."""
import json
import re
import resource
import signal
import subprocess

import pytest

from conftest import STAGECTL, Station, ctl, simulated
from png_file import read_png


@pytest.fixture(scope="module")
def sheet(tmp_path_factory):
    """The sheet of a scene and what was said of it."""
    image = tmp_path_factory.mktemp("sheet") / "talking.png"
    done = ctl("sim", "preview", "talking", "--hd", "2", "--at", "2", "--output", image)
    assert done.returncode == 0, done.stderr
    return image, done.stdout


def test_sheet_of_a_scene_has_all_its_cameras(sheet):
    image, said = sheet
    assert re.findall(r"^(\w+)  ", said, re.M) == ["ir0", "ir1", "ir2", "ir3", "hd0", "hd1"]
    width, height = read_png(image)
    assert width > 3 * 700 and height > 2 * 500


def test_spots_are_where_the_truth_has_markers(sheet):
    counts = re.findall(r"(\d+) of (\d+) markers in sight have one", sheet[1])
    assert len(counts) == 4
    found, seen = (sum(int(count[k]) for count in counts) for k in (0, 1))
    assert seen > 150 and found >= 0.95 * seen


def test_the_same_scene_seed_and_time_give_the_same_sheet(sheet, tmp_path):
    image = tmp_path / "again.png"
    ctl("sim", "preview", "talking", "--hd", "2", "--at", "2", "--output", image)
    assert image.read_bytes() == sheet[0].read_bytes()


def test_another_seed_gives_another_sheet(sheet, tmp_path):
    image = tmp_path / "other.png"
    ctl("sim", "preview", "talking", "--hd", "2", "--at", "2", "--seed", "2", "--output", image)
    assert image.read_bytes() != sheet[0].read_bytes()


def test_a_sheet_can_be_made_smaller(tmp_path):
    image = tmp_path / "small.png"
    done = ctl("sim", "preview", "rest", "--width", "900", "--output", image)
    assert done.returncode == 0, done.stderr
    assert read_png(image)[0] == 900


def test_sheet_of_the_board_counts_its_corners(tmp_path):
    done = ctl("sim", "preview", "board", "--at", "3", "--output", tmp_path / "board.png")
    assert done.returncode == 0, done.stderr
    corners = re.findall(r"(\d+) of 88 corners in sight", done.stdout)
    assert len(corners) == 4 and sum(map(int, corners)) > 200


def test_a_scene_that_is_not_there_is_named(tmp_path):
    done = ctl("sim", "preview", "no-such-scene", "--output", tmp_path / "no.png")
    assert done.returncode == 3 and "no-such-scene" in done.stderr
    assert not (tmp_path / "no.png").exists()


def test_a_sheet_that_cannot_be_written_is_named(tmp_path):
    path = tmp_path / "no-such-directory" / "a.png"
    done = ctl("sim", "preview", "rest", "--output", path)
    assert done.returncode == 1 and str(path) in done.stderr and "No such file" in done.stderr


@pytest.mark.parametrize("what", ["sim", "camera"])
def test_a_full_disk_leaves_the_picture_from_before(what, recording, tmp_path):
    """The limit of a file's size stands for the disk's."""
    picture = tmp_path / "p.png"
    picture.write_text("before")
    looked_at = "talking" if what == "sim" else f"files:{recording}/ir0"

    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
    done = subprocess.run([STAGECTL, what, "preview", looked_at, "--output", picture], capture_output=True, text=True,
                          preexec_fn=limit, timeout=60, check=False)
    assert done.returncode == 1 and "p.png: cannot write" in done.stderr, done
    assert picture.read_text() == "before"
    assert [p.name for p in tmp_path.iterdir()] == ["p.png"]


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    """A station on four IR cameras and one HD camera."""
    place = tmp_path_factory.mktemp("live") / "stage"
    done = ctl("sim", "record", place, "--seconds", "0.1", "--hd", "1", "--seed", "3")
    assert done.returncode == 0, done.stderr
    config = place / "sim.yaml"
    config.write_text(simulated(place, "seed: 3"))
    station = Station(config, place / "sockets").wait_running()
    station.config = config
    yield station
    station.end()


def test_sheet_of_a_station_has_all_its_cameras_and_names_its_markers(live, tmp_path):
    image = tmp_path / "all.png"
    done = live.ctl("camera", "preview", "all", "--output", image)
    assert done.returncode == 0 and not done.stderr, done.stderr
    read_png(image)
    rows = re.findall(r"^(ir\d)   shot \d+: \d+ spots; (\d+) of (\d+) markers", done.stdout, re.M)
    assert [row[0] for row in rows] == ["ir0", "ir1", "ir2", "ir3"]
    for _, found, markers in rows:
        assert int(markers) > 30 and int(found) >= 0.9 * int(markers)
    assert re.search(r"^hd0$", done.stdout, re.M)


def test_without_its_config_the_sheet_has_spots_alone(live, tmp_path):
    config = live.config
    moved = config.with_name("moved.yaml")
    config.rename(moved)
    done = live.ctl("camera", "preview", "all", "--output", tmp_path / "all.png", "--json")
    moved.rename(config)
    assert done.returncode == 0 and "no names" in done.stderr and config.name in done.stderr
    cameras = json.loads(done.stdout)["cameras"]
    assert len(cameras) == 5 and all(re.match(r"ir\d   \d+ spots$", one) for one in cameras[:4])


def test_sheet_of_a_station_that_is_not_there_is_refused(tmp_path):
    done = ctl("camera", "preview", "all", "--socket-dir", tmp_path, "--output", tmp_path / "a.png")
    assert done.returncode == 5 and not (tmp_path / "a.png").exists()
