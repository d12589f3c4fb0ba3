"""stagectl doctor on the machine that runs the tests, whatever that is like."""
import json
import os

import pytest

from conftest import ctl

TOPICS = ["system", "permissions", "real time", "clock", "network", "disk"]


def examine(*arguments):
    done = ctl("doctor", *arguments, "--json")
    assert done.returncode in (0, 4), done.stderr
    told = json.loads(done.stdout)
    assert done.returncode == (4 if told["problems"] else 0)
    assert len(told["findings"]) == told["problems"] + told["notes"] + told["ok"]
    return told["findings"]


def of(findings, what):
    found = [finding for finding in findings if finding["what"].startswith(what)]
    assert len(found) == 1, found
    return found[0]


@pytest.fixture(scope="module")
def findings(recording):
    return examine(recording / "stage.yaml", "--directory", recording)


def test_every_finding_is_measured_and_has_a_remedy_unless_all_is_well(findings):
    for finding in findings:
        assert finding["measured"] and finding["what"]
        assert bool(finding["remedy"]) == (finding["level"] != "ok"), finding


def test_findings_are_grouped(findings):
    topics = list(dict.fromkeys(finding["topic"] for finding in findings))
    assert [topic for topic in topics if topic in TOPICS] == TOPICS


def test_the_table_is_a_line_per_finding_and_a_sum(recording):
    done = ctl("doctor", recording / "stage.yaml", "--directory", recording)
    lines = done.stdout.splitlines()
    told = [line for line in lines if line.startswith("  ")]
    assert all(line.split()[0] in ("ok", "note", "problem") for line in told)
    assert lines[-1].split()[1::2] == ["problems,", "notes,", "ok"]
    assert sum(int(word) for word in lines[-1].split()[::2]) == len(told)


def test_the_probe_of_the_disk_leaves_nothing_behind(tmp_path):
    findings = examine("--directory", tmp_path)
    assert of(findings, f"writing to {tmp_path}")["measured"].endswith("MB/s")
    assert not os.listdir(tmp_path)


def test_the_directory_of_the_config_is_probed_unless_another_is_named(recording, tmp_path):
    takes = recording / "takes"
    takes.mkdir()
    config = recording / "takes.yaml"
    config.write_text((recording / "stage.yaml").read_text() + "recordings_dir: takes\n")
    assert of(examine(config, "--no-light"), f"writing to {takes}")["measured"].endswith("MB/s")
    assert of(examine(config, "--no-light", "--directory", tmp_path), f"writing to {tmp_path}")
    config.unlink()
    takes.rmdir()


def test_a_directory_that_is_not_there_is_a_problem(tmp_path):
    finding = of(examine("--directory", tmp_path / "none"), "writing to")
    assert finding["level"] == "problem" and "No such file" in finding["measured"]


def test_a_config_that_is_not_there_is_named(tmp_path):
    done = ctl("doctor", tmp_path / "none.yaml")
    assert (done.returncode, done.stdout) == (3, "") and "none.yaml" in done.stderr


def test_a_bad_config_is_named_by_its_line(stage):
    config = stage / "stage.yaml"
    config.write_text(config.read_text().replace("rate_hz", "rate_hertz"))
    done = ctl("doctor", config)
    assert done.returncode == 3 and "rate_hertz" in done.stderr


def test_a_bad_rig_is_a_problem_among_others(stage):
    (stage / "rig" / "ir1.cameramodel").unlink()
    finding = of(examine(stage / "stage.yaml"), "what the config names")
    assert finding["level"] == "problem" and "ir1.cameramodel" in finding["measured"]


def test_a_stage_without_a_rig_is_noted(stage):
    (stage / "rig").rename(stage / "elsewhere")
    assert of(examine(stage / "stage.yaml"), "rig")["level"] == "note"


def test_a_camera_out_of_reach_is_a_problem(stage):
    config = stage / "stage.yaml"
    config.write_text(config.read_text().replace("files:ir2", "v4l2:/dev/video97"))
    findings = examine(config)
    assert of(findings, "cameras /dev/video*")["level"] == "problem" or \
        os.path.exists("/dev/video0")


SCENE = """title: lamps
seconds: 10
cameras: 4
hd_cameras: 2
placement: room
{more}
actors:
- {{name: sim, face_markers: 70, performance: talking, neutral_start_s: 0.1}}
"""


def simulate(recording, place, scene="", sim=""):
    """What doctor says of the light of a simulated stage in a room."""
    (place / "scene.yaml").write_text(SCENE.format(more=scene))
    cameras = [f'- {{name: ir{i}, address: "sim:ir{i}"}}' for i in range(4)]
    cameras += [f'- {{name: hd{i}, address: "sim:hd{i}", role: hd}}' for i in range(2)]
    config = place / "sim.yaml"
    config.write_text(f"rig: none\nlayout: {recording}/layout.yaml\nrate_hz: 120\ntrigger: sim\n"
                      f"socket_dir: {place}\nsim: {{scene: {place}/scene.yaml{sim}}}\ncameras:\n"
                      + "\n".join(cameras) + "\n")
    return {finding["what"].split()[-1]: finding["level"]
            for finding in examine(config) if finding["topic"] == "light"}


def test_a_good_stage_has_no_stray_light(recording, tmp_path):
    light = simulate(recording, tmp_path, "cross_strobes: true")
    assert list(light) == ["ir0", "ir1", "ir2", "ir3", "hd0", "hd1"]
    assert set(light.values()) == {"ok"}


def test_strobes_that_an_hd_camera_sees_are_a_problem(recording, tmp_path):
    light = simulate(recording, tmp_path, sim=", faults: [{camera: hd1, kind: strobe_leak}]")
    assert [camera for camera, level in light.items() if level == "problem"] == ["hd1"]


def test_ring_lights_that_ir_cameras_see_are_a_problem(recording, tmp_path):
    light = simulate(recording, tmp_path, "ring_lights: true")
    seeing = {camera for camera, level in light.items() if level == "problem"}
    assert seeing and seeing < {"ir0", "ir1", "ir2", "ir3"}


def test_cameras_are_left_alone_when_that_is_wished(recording, tmp_path):
    simulate(recording, tmp_path)
    findings = examine(tmp_path / "sim.yaml", "--no-light")
    assert all(finding["topic"] != "light" for finding in findings)


def test_cameras_of_a_running_station_are_left_alone(recording, start, sim_config):
    station = start(sim_config).wait_running()
    config = station.socket_dir / "stage.yaml"
    text = sim_config.read_text().replace("rig: rig", f"rig: {recording}/rig")
    text = text.replace("layout: layout.yaml", f"layout: {recording}/layout.yaml")
    config.write_text(f"socket_dir: {station.socket_dir}\n{text}")
    finding = of(examine(config), "cross-light")
    assert finding["level"] == "note" and "a station has the cameras" in finding["measured"]
