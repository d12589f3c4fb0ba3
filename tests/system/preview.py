"""Contact sheets: a person sees what the cameras see. What they must show is told beside them."""
import json
import re

import pytest

from conftest import Station, ctl
from hd import read_png


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
