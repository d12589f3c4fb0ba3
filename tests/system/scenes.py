"""Scenes are listed, played and recorded by name or by file; mistakes in them are told by line."""
import json
import re

from conftest import ctl

OWN = """title: a face of my own
seconds: 3
cameras: 4
actors:
- {name: anna, face_markers: 35}
faults:
- {camera: ir1, kind: drop, at_s: 0.05, for_s: 0.05}
"""


def play(*arguments):
    done = ctl("sim", "play", *arguments, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def own_scene(tmp_path, text=OWN):
    path = tmp_path / "own.yaml"
    path.write_text(text)
    return path


def test_eleven_scenes_and_more_are_listed():
    scenes = {one["name"]: one for one in json.loads(ctl("sim", "list", "--json").stdout)["scenes"]}
    assert len([name for name in scenes if re.match(r"\d\d-", name)]) == 11
    assert {"rest", "talking", "turning"} <= set(scenes)
    assert scenes["07-seventeen-minutes"]["seconds"] == 1020
    assert scenes["11-body-and-face"]["markers"] == 92
    assert scenes["08-faults"]["faults"] > 10 and scenes["01-lips-and-lids"]["events"] > 5
    table = ctl("sim", "list").stdout.splitlines()
    assert len(table) == len(scenes) + 1 and table[0].startswith("NAME")


def test_a_scene_is_played_and_scored():
    score = play("talking", "--seconds", "2", "--seed", "5")
    assert score["shots"] == 240 and score["level"] == "blob"
    assert score["right_share"] > 0.99 and score["wrong"] == 0
    assert 0 < score["rms_mm"] < 0.1
    assert set(score["cpu_us_per_shot"]) == {"truth", "blobs", "tracker"} and score["speed"] > 0
    again = play("talking", "--seconds", "2", "--seed", "5")
    for timed in ("speed", "cpu_us_per_shot"):
        del score[timed], again[timed]
    assert again == score
    assert play("talking", "--seconds", "2", "--seed", "6")["rms_mm"] != score["rms_mm"]


def test_a_scene_is_played_with_pictures():
    for optics in ("gaussian", "tailed"):
        score = play("rest", "--seconds", "0.1", "--level", "pixel", "--optics", optics)
        assert score["optics"] == optics and score["shots"] == 12
        assert score["right_share"] > 0.9 and score["wrong"] == 0


def test_the_table_says_how_it_went():
    said = ctl("sim", "play", "rest", "--seconds", "0.5").stdout
    for word in ("right", "unnamed", "wrong", "rms", "NEES", "lost", "x real time"):
        assert word in said


def test_own_files_are_played_and_recorded_with_their_faults(tmp_path):
    path = own_scene(tmp_path)
    assert play(path, "--seconds", "0.5")["scene"] == "own"
    done = ctl("sim", "record", tmp_path / "take", "--scene", path, "--seconds", "0.2")
    assert done.returncode == 0, done.stderr
    rows = {name: len((tmp_path / "take" / name / "frames.csv").read_text().splitlines()) - 1
            for name in ("ir0", "ir1")}
    assert rows == {"ir0": 24, "ir1": 18}
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine").write_text("x")
    assert ctl("sim", "record", tmp_path / "full", "--scene", path).returncode == 2
    assert (tmp_path / "full" / "mine").read_text() == "x"


def test_mistakes_are_told_by_line(tmp_path):
    path = own_scene(tmp_path, OWN.replace("ir1", "ir7").replace("35", "36"))
    done = ctl("sim", "play", path)
    assert done.returncode == 3 and done.stdout == ""
    assert f"{path}:5:30: actors[0].face_markers: there is no face of 36 markers" in done.stderr
    assert f"{path}:7:4: faults[0].camera: there is no camera 'ir7'" in done.stderr
    assert ctl("sim", "play", "singing").returncode == 3
    assert ctl("sim", "play", "rest", "--level", "voxel").returncode == 2
    assert ctl("sim", "play", "rest", "--optics", "x").returncode == 3
