"""stagectl calibrate actor: the script in virtual time, kept through interrupts, and what it refuses."""
import json
import math
import signal
import subprocess
import time

import pytest

from conftest import STAGECTL, ctl

SCENE = "range-of-motion"


def calibrate(out, *options, name="anna", sim=SCENE):
    return ctl("calibrate", "actor", name, "--sim", sim, "--out", out, "--json", *options,
               timeout=90)


def events(text):
    return [json.loads(line) for line in text.splitlines()]


def markers(path):
    """Name and neutral of every marker of an actor's file."""
    found, name = {}, None
    for line in path.read_text().splitlines():
        if line.startswith("- name: "):
            name = line.split()[2]
        if line.startswith("  neutral_m: "):
            found[name] = json.loads(line.split(": ", 1)[1])
    return found


def layout_of(scene, place):
    done = ctl("sim", "record", place, "--scene", scene, "--seconds", "0.02")
    assert done.returncode == 0, done.stderr
    return place / "layout.yaml"


@pytest.fixture(scope="module")
def actor(tmp_path_factory):
    """An actor whose capture was interrupted once and then went on."""
    out = tmp_path_factory.mktemp("actors")
    first = subprocess.Popen([STAGECTL, "calibrate", "actor", "anna", "--sim", SCENE, "--out",
                              str(out), "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                             text=True)
    seen = [json.loads(first.stdout.readline()) for _ in range(9)]
    first.send_signal(signal.SIGINT)
    rest, said = first.communicate(timeout=20)
    return out, seen + events(rest), first.returncode, said


def test_an_interrupt_loses_nothing_that_was_captured(actor):
    out, seen, code, said = actor
    assert code == 6 and "kept in" in said and "--fresh" in said
    kept = [event["pose"] for event in seen if event["event"] == "captured"]
    assert 2 <= len(kept) < 64 and not (out / "anna.yaml").exists()
    done = calibrate(out)
    assert done.returncode == 0, done.stderr
    told = events(done.stdout)
    assert [event["open"] for event in told if event["event"] == "resumed"] == [64 - len(kept)]
    asked = [event["pose"] for event in told if event["event"] == "pose"]
    assert len(asked) == 64 - len(kept) and not set(asked) & set(kept)
    assert told[-1]["event"] == "done" and told[-1]["captured"] == 64
    assert told[-1]["learned"] == 70 and told[-1]["mpeg4"] > 25
    assert [path.name for path in out.iterdir()] == ["anna.yaml"]


def test_the_neutral_is_the_truths_and_the_tracker_takes_the_file(actor, tmp_path):
    out = actor[0]
    recorded = layout_of(SCENE, tmp_path / "stage")
    wanted = {}
    for line in recorded.read_text().splitlines():
        if line.startswith("- {name: "):
            wanted[line.split()[2].rstrip(",")] = json.loads(
                line[line.index("neutral_m: ") + 11:].rstrip("}"))
    found = markers(out / "anna.yaml")
    assert set(found) == set(wanted)
    assert max(math.dist(found[name], wanted[name]) for name in wanted) < 5e-5
    played = ctl("sim", "play", SCENE, "--seconds", "4", "--layout", out / "anna.yaml", "--json")
    assert played.returncode == 0, played.stderr
    assert json.loads(played.stdout)["wrong"] == 0


def test_another_persons_layout_is_said(tmp_path):
    layout = layout_of(SCENE, tmp_path / "stage")
    text = layout.read_text().splitlines()
    moved = 0
    for index, line in enumerate(text):
        if "rigid: false" in line and moved < 40:
            start = line.index("neutral_m: [") + 12
            x, y, z = (float(part) for part in line[start:].rstrip("]}").split(","))
            text[index] = f"{line[:start]}{x}, {y + 0.012 + 0.0003 * moved}, {z}]}}"
            moved += 1
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text("\n".join(text) + "\n")
    done = calibrate(tmp_path / "out", "--layout", wrong)
    assert done.returncode in (3, 6)
    assert "is this anna?" in done.stderr or "other markers than the layout" in done.stderr
    assert not list((tmp_path / "out").iterdir())


def test_a_full_disk_is_no_bad_input(tmp_path):
    (tmp_path / "anna.capture").symlink_to("/dev/full")
    done = calibrate(tmp_path, "--fresh")
    assert done.returncode == 1 and "anna.capture: cannot be written" in done.stderr, done


def test_what_cannot_be_is_refused_with_a_remedy(tmp_path):
    refused = calibrate(tmp_path, name="../anna")
    assert refused.returncode == 2 and "letters" in refused.stderr
    refused = calibrate(tmp_path, name="bob")
    assert refused.returncode == 3 and "anna" in refused.stderr and "--actor" in refused.stderr
    refused = ctl("calibrate", "actor", "anna", "--socket-dir", tmp_path, "--out", tmp_path)
    assert refused.returncode == 5 and "is staged running" in refused.stderr
    layout = layout_of(SCENE, tmp_path / "stage")
    layout.write_text(layout.read_text().replace("rigid: true", "rigid: false"))
    refused = calibrate(tmp_path, "--layout", layout)
    assert refused.returncode == 3 and "head band" in refused.stderr
    layout.write_text("markers: [{nam: a}]\n")
    refused = calibrate(tmp_path, "--layout", layout)
    assert refused.returncode == 3 and "layout.yaml:1:" in refused.stderr


def test_an_actor_who_never_rests_is_told_so(tmp_path):
    done = calibrate(tmp_path, name="jonas", sim="10-no-neutral")
    assert done.returncode == 6 and "hold still" in done.stderr
    assert not list(tmp_path.iterdir())


def test_an_actor_who_is_hidden_is_waited_for(tmp_path):
    scene = tmp_path / "empty.yaml"
    scene.write_text("title: somebody else\nseconds: 60\ncameras: 4\nactors:\n"
                     "- {name: anna, face_markers: 35, performance: still}\n")
    layout = layout_of(SCENE, tmp_path / "stage")
    done = calibrate(tmp_path / "out", "--layout", layout, sim=scene)
    assert done.returncode in (3, 6)
    assert "layout" in done.stderr


def test_a_recordings_clean_neutrals_are_named(recording):
    done = ctl("process", recording / "stage.yaml")
    assert done.returncode == 0
    assert "clean neutral of" in done.stderr


def test_the_running_station_is_looked_at(shared_station, tmp_path):
    begin = time.monotonic()
    told = subprocess.Popen([STAGECTL, "calibrate", "actor", "nobody", "--socket-dir",
                             str(shared_station.socket_dir), "--out", str(tmp_path)],
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    _, said = told.communicate(timeout=20)
    assert told.returncode == 3 and "has no actor 'nobody'" in said
    assert time.monotonic() - begin < 10
