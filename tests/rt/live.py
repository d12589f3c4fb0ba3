"""Whole programs with the guard preloaded: no real-time section of the station allocates, locks,
prints or blocks."""
import json
import os
import subprocess
import time

import pytest

import conftest
# the fixtures of tests/system
from conftest import recording, sim_config, stage, start  # noqa: F401
from fake_chip import IR, Chip
from fake_cameras import cameras, v4l2_config  # noqa: F401

GUARD = os.environ["RT_GUARD"]


@pytest.fixture
def guarded(tmp_path):
    return {"LD_PRELOAD": GUARD, "RT_GUARD_REPORT": str(tmp_path / "report")}


def calls_from_sections(tmp_path, of="staged"):
    """How many allowed calls staged made inside of sections: a proof that there were any."""
    for line in (tmp_path / "report").read_text().splitlines():
        program, count = line.split()
        if program == of:
            return int(count)
    raise AssertionError("staged never reported: it was not guarded, or did not end by itself")


def run_demo(tmp_path, guarded, *options):
    done = subprocess.run([os.environ["STAGE_DEMO"], "--json", "--keep", str(tmp_path / "kept"),
                           *options], env={**os.environ, **guarded}, capture_output=True,
                          text=True, timeout=100, check=False)
    said = (tmp_path / "kept" / "station.log").read_text()
    assert "rt guard" not in said, said
    return json.loads(done.stdout)["shots"]["received"]


def test_a_whole_demonstration_keeps_the_rules(tmp_path, guarded):
    assert run_demo(tmp_path, guarded, "--sim", "--seconds", "10") > 1000
    # each of 8 cameras and the trigger sleeps and wakes the solver 120 times a second
    assert calls_from_sections(tmp_path) > 10000


def test_gige_vision_cameras_keep_the_rules(tmp_path, guarded):
    assert run_demo(tmp_path, guarded, "--seconds", "4") > 200
    assert calls_from_sections(tmp_path) > 500


def test_previews_keep_the_rules(start, sim_config, tmp_path, guarded):
    station = start(sim_config, environment=guarded).wait_running()
    for camera in ["ir0", "ir1", "ir2", "ir3"]:
        assert station.ctl("camera", "preview", camera, "--output", tmp_path / "p.png").returncode == 0
    assert station.ctl("stream", "tap", "--count", "60").returncode == 0
    code, said, _ = station.stop()
    assert (code, "rt guard" in said) == (0, False), said
    assert calls_from_sections(tmp_path) > 500


def test_recordings_leave_the_section_to_read_the_disk(start, stage, tmp_path, guarded):
    station = start(stage / "stage.yaml", environment=guarded).wait_running()
    code, said, _ = station.stop()
    assert (code, "rt guard" in said) == (0, False), said
    assert calls_from_sections(tmp_path) > 20


def test_v4l2_cameras_keep_the_rules(start, cameras, v4l2_config, tmp_path, guarded):
    cameras.environment["LD_PRELOAD"] += ":" + GUARD
    station = start(v4l2_config, environment={**guarded, **cameras.environment}).wait_running()
    cameras.unplug(0)
    time.sleep(2)
    code, said, _ = station.stop()
    assert (code, "rt guard" in said) == (0, False), said
    assert calls_from_sections(tmp_path) > 100  # the fakes stand before the guard


def test_gpio_lines_keep_the_rules(start, sim_config, recording, tmp_path, guarded, monkeypatch):
    monkeypatch.setattr(conftest, "STAGED", os.environ["STAGED_GPIO"])
    (tmp_path / "chips").mkdir()
    chip = Chip(tmp_path / "chips" / "gpiochip0")
    text = sim_config.read_text().replace("rig: rig", f"rig: {recording}/rig")
    text = text.replace("layout: layout.yaml", f"layout: {recording}/layout.yaml")
    lines = "ir=IR_TRIG,strobe=STROBE,hd=HD_TRIG,exposure=EXPOSURE"
    config = tmp_path / "gpio.yaml"
    config.write_text(text.replace("trigger: sim\n", f"trigger: 'gpio:gpiochip0,{lines}'\n"))
    station = start(config, environment={**guarded, "FAKE_GPIO_DIR": str(tmp_path / "chips")})
    chip.wait_lit(IR)
    station.wait_running()
    time.sleep(1)
    code, said, _ = station.stop()
    assert (code, "rt guard" in said) == (0, False), said
    assert calls_from_sections(tmp_path, "staged_fake_gpio") > 100
