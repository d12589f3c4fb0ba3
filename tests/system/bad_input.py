"""Wrong input: the message names file and field, the exit code is of the table, nothing runs on."""
import json
import re
import subprocess

import pytest

from conftest import STAGECTL, STAGED, ctl


def replace(path, pattern, replacement):
    text = path.read_text()
    changed = re.sub(pattern, replacement, text, count=1, flags=re.M)
    assert changed != text
    path.write_text(changed)


def missing_camera(stage):
    replace(stage / "stage.yaml", "files:ir2", "files:ir9")
    return "ir9"


def missing_table(stage):
    (stage / "ir1" / "frames.csv").unlink()
    return "ir1/frames.csv"


def bad_table(stage):
    replace(stage / "ir1" / "frames.csv", r"^1,\d+,", "1,soon,")
    return "ir1/frames.csv:3"


def rig_of_another_size(stage):
    replace(stage / "rig" / "ir0.cameramodel", r"1280", "640")
    return "ir0"


def missing_model(stage):
    (stage / "rig" / "ir3.cameramodel").unlink()
    return "ir3.cameramodel"


def malformed_model(stage):
    replace(stage / "rig" / "ir1.cameramodel", r"'?lensmodel'?", "'lens'")
    return "ir1.cameramodel"


def doubled_marker(stage):
    text = (stage / "layout.yaml").read_text()
    names = re.findall(r"name: *\"?(\w+)", text)
    replace(stage / "layout.yaml", rf"\b{names[1]}\b", names[0])
    return "layout.yaml:"


def doubled_camera(stage):
    replace(stage / "stage.yaml", "name: ir1", "name: ir0")
    return "stage.yaml:"


def unknown_field(stage):
    replace(stage / "stage.yaml", "rate_hz", "rate_hertz")
    return "rate_hertz"


def broken_yaml(stage):
    (stage / "stage.yaml").write_text("rig: [\n")
    return "stage.yaml:"


def unknown_driver(stage):
    replace(stage / "stage.yaml", "files:ir2", "film:ir2")
    return "film"


def no_config(stage):
    (stage / "stage.yaml").unlink()
    return "stage.yaml"


SPOILERS = [missing_camera, missing_table, bad_table, rig_of_another_size, missing_model,
            malformed_model, doubled_marker, doubled_camera, unknown_field, broken_yaml,
            unknown_driver, no_config]


@pytest.mark.parametrize("spoil", SPOILERS, ids=lambda spoil: spoil.__name__)
def test_bad_input(spoil, stage, tmp_path):
    named = spoil(stage)
    config, output = stage / "stage.yaml", tmp_path / "out.jsonl"
    sockets = tmp_path / "sockets"
    station = subprocess.run([STAGED, "--config", config, "--socket-dir", sockets], text=True,
                             capture_output=True, timeout=10, check=False)
    assert named in station.stderr
    assert station.returncode == 3
    assert not sockets.exists()

    processed = ctl("process", config, "--output", output)
    assert (processed.returncode, processed.stdout) == (3, "")
    assert named in processed.stderr
    assert not list(tmp_path.glob("out*"))

    checked = ctl("config", "check", config)
    assert checked.returncode == 3 and named in checked.stderr


def test_nothing_to_track_is_told(stage, tmp_path):
    config, output = stage / "stage.yaml", tmp_path / "out.jsonl"
    config.write_text(config.read_text().replace("role: ir", "role: hd"))
    done = ctl("process", config, "--output", output)
    assert done.returncode == 3 and not output.exists()
    assert "stage.yaml" in done.stderr and "role" in done.stderr


def test_all_errors_are_told_in_one_run(stage):
    named = [doubled_marker(stage), missing_model(stage), malformed_model(stage)]
    checked = ctl("config", "check", stage / "stage.yaml")
    assert checked.returncode == 3
    assert all(name in checked.stderr for name in named)


def test_good_config_is_summed_up(recording):
    checked = ctl("config", "check", recording / "stage.yaml")
    assert checked.returncode == 0, checked.stderr
    assert "ir3" in checked.stdout and "74 markers" in checked.stdout
    assert "warning" not in checked.stdout


def test_lips_in_one_group_are_warned_of(stage):
    layout = stage / "layout.yaml"
    layout.write_text(re.sub(r"(upper|lower)", "part", layout.read_text()))
    checked = ctl("config", "check", stage / "stage.yaml")
    assert checked.returncode == 0, checked.stderr
    assert "warning" in checked.stdout and "lip_upper" in checked.stdout


@pytest.mark.parametrize("spoil", [lambda text: text.replace("rigid: true", "rigid: false"),
                                   lambda text: keep_rigid(text, 2)])
def test_a_head_whose_turn_cannot_be_seen_is_warned_of(stage, spoil):
    layout = stage / "layout.yaml"
    layout.write_text(spoil(layout.read_text()))
    checked = ctl("config", "check", stage / "stage.yaml")
    assert checked.returncode == 0, checked.stderr
    assert "warning" in checked.stdout and "on one line" in checked.stdout


def keep_rigid(text, count):
    parts = text.split("rigid: true")
    return "rigid: true".join(parts[:count + 1]) + "".join("rigid: false" + part
                                                           for part in parts[count + 1:])


def test_every_error_of_a_config_is_told_with_its_place_also_by_doctor(stage):
    config = stage / "stage.yaml"
    text = re.sub(r"^trigger:.*\n", "", config.read_text(), flags=re.M)
    config.write_text("trigger: laser\nlayoutt: x\n" + text.replace("files:ir1", "foo:ir1"))
    checked = ctl("config", "check", config)
    assert checked.returncode == 3
    for named in ["stage.yaml:2:1: layoutt", "stage.yaml:1:10: trigger: trigger laser",
                  "cameras[1].address: camera address foo:ir1: no such driver"]:
        assert named in checked.stderr
    looked = ctl("doctor", "--no-light", "--json", config)
    assert looked.returncode == 3 and looked.stdout.count("\n") == 1
    assert "layoutt" in json.loads(looked.stdout)["findings"][0]["measured"]


@pytest.mark.parametrize("line, named", [("trigger: 'free:xyz'", "takes no device"),
                                         ("trigger: foo", "trigger foo"),
                                         ("trigger: 'gpio:gpiochip0'", "no line to fire"),
                                         ("trigger: 'gpio:gpiochip0,laser=A'", "none of ir, strobe"),
                                         ("trigger: 'gpio:gpiochip0,ir=A,hd=A'", "two things"),
                                         ("sim: {scene: nonsense}", "nonsense")])
def test_triggers_and_scenes_that_there_are_not_are_no_good_config(stage, line, named):
    config = stage / "stage.yaml"
    text = re.sub(r"^trigger:.*\n", "", config.read_text(), flags=re.M)
    config.write_text(f"{line}\n{text}")
    checked = ctl("config", "check", config)
    assert checked.returncode == 3 and named in checked.stderr


@pytest.mark.parametrize("family", ["calibrate", "camera", "sim"])
def test_the_first_word_of_several_verbs_tells_the_others(family):
    alone, helped, wrong = ctl(family), ctl(family, "--help"), ctl(family, "nonsense")
    assert (alone.returncode, alone.stdout) == (2, "") and "no such verb" not in alone.stderr
    assert (helped.returncode, helped.stderr) == (0, "") and helped.stdout == alone.stderr
    assert wrong.returncode == 2 and f"no such verb: {family} nonsense" in wrong.stderr
    assert all(line.split()[0] == family for line in alone.stderr.splitlines()[1:])


def test_an_unknown_verb_is_named_and_all_are_told():
    done = ctl("nonsense")
    assert done.returncode == 2 and "no such verb: nonsense" in done.stderr
    assert "calibrate board" in done.stderr


@pytest.mark.parametrize("arguments", [["sim", "list", "--json"], ["sim", "list"], ["--help"],
                                       ["camera", "list", "--json"]])
def test_a_full_disk_is_no_success(arguments):
    with open("/dev/full", "w") as full:
        done = subprocess.run([STAGECTL, *arguments], stdout=full, stderr=subprocess.PIPE, text=True,
                              timeout=30, check=False)
    assert done.returncode == 1 and "No space left" in done.stderr
