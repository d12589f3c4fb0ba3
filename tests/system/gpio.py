"""A station on GPIO lines, with files for chips (tests/gpio/fake_gpio.h): what the lines do while the
station is killed, stopped, starved of its chip or of its guard."""
import json
import os
import pathlib
import random
import re
import signal
import subprocess
import time

import pytest
from conftest import STAGED, wait_for
from fake_chip import HD, IR, STROBE, Chip, COUNT_AT

PERIOD_S = 1 / 60
PATIENCE_S = 0.1  # with a machine that has other things to do
RUN_ON_S = 3  # the other side of a reopening: looked for every second


@pytest.fixture
def chip(tmp_path):
    (tmp_path / "chips").mkdir()
    return Chip(tmp_path / "chips" / "gpiochip0")


@pytest.fixture
def gpio_config(fired_config):
    """gpio_config(more YAML, lines) -> a config at 60 Hz that fires on the chip's lines."""

    def write(more="", lines="ir=IR_TRIG,strobe=STROBE,hd=HD_TRIG"):
        return fired_config(f"gpio:gpiochip0,{lines}", more)

    return write


@pytest.fixture
def gpio_start(start, gpio_config, tmp_path, chip):
    """gpio_start(more YAML) -> a station of such a config."""
    environment = {"FAKE_GPIO_DIR": str(tmp_path / "chips")}

    def start_one(more="", lines="ir=IR_TRIG,strobe=STROBE,hd=HD_TRIG", wait=True):
        config = gpio_config(more, lines)
        station = start(config, environment=environment)
        station.config, station.environment = config, environment
        if wait:
            chip.wait_lit(IR)
            station.wait_running()
        return station

    return start_one


# 8 ms of light in 17 ms: long enough to be hit in the middle
LONG = "exposure_us: 12000\nstrobe_duty_max: 0.5\n"


def darken(station):
    return subprocess.run([STAGED, "--darken", "--config", station.config], capture_output=True,
                          text=True, timeout=10, check=False,
                          env={**os.environ, **station.environment})


def guard_of(station):
    [children] = [path.read_text().split() for path in
                  pathlib.Path(f"/proc/{station.process.pid}/task").glob("*/children")
                  if path.read_text().strip()]
    [pid] = children
    return int(pid)


def test_pulses_keep_to_the_plan_and_their_jitter_is_told(gpio_start, chip):
    station = gpio_start()
    time.sleep(1.5)
    status = station.status()
    lateness = status["pulses"]["lateness"]
    assert lateness["count"] > 30
    assert lateness["p50_ms"] <= lateness["p99_ms"] <= lateness["max_ms"]
    assert status["pulses"]["lost_why"] is None and not status["trigger_lost"]
    assert "pulses late by" in station.ctl("status").stdout
    code, said, _ = station.stop()
    assert (code, chip.levels()) == (0, 0), said
    starts = [on for on, _ in chip.pulses(IR)]
    grid = [round((on - starts[0]) / PERIOD_S) for on in starts]
    assert len(set(grid)) == len(grid), "two edges in one period"
    burns = sorted(off - on for on, off in chip.pulses(STROBE))
    assert len(burns) >= 60
    # the machine may stop all of us for longer than any limit, now and then
    assert burns[len(burns) * 9 // 10] <= 0.1 * PERIOD_S + 100e-6
    hd = {round((on - starts[0]) / PERIOD_S) % 4 for on, _ in chip.pulses(HD)}
    assert len(hd) == 1, "HD cameras change their phase"


def test_lines_are_dark_within_a_period_of_a_kill_in_mid_pulse(gpio_start, chip):
    within = []
    for _ in range(5):
        station = gpio_start(LONG)
        time.sleep(random.uniform(0, 0.05))
        chip.wait_lit(STROBE)
        station.process.kill()
        killed_at = time.monotonic()
        chip.wait_dark(PATIENCE_S)
        seconds = chip.changes()[-1][0] - killed_at  # this program may see it late
        within.append(seconds <= PERIOD_S)
        by_guard = chip.changes()[-1][2] != station.process.pid
        print(f"dark {1e3 * seconds:.2f} ms later, by the {'guard' if by_guard else 'station'}")
        station.process.communicate()
        wait_for(lambda: chip.changes()[-1][2] != station.process.pid, 2)  # the guard, at last
    assert within.count(True) >= 4


def test_a_station_that_stands_still_with_a_strobe_lit_has_it_cut(gpio_start, chip):
    station = gpio_start(LONG)
    for _ in range(3):
        chip.wait_lit(STROBE)
        station.process.send_signal(signal.SIGSTOP)
        chip.wait_dark(PATIENCE_S)
        time.sleep(0.1)
        assert chip.levels() == 0
        station.process.send_signal(signal.SIGCONT)
        time.sleep(0.2)
    time.sleep(1.1)
    pulses = station.status()["pulses"]
    assert pulses["events"]["guard_cut"] >= 3
    assert pulses["missed"] >= 9 and pulses["last_missed_shot"] > 0
    burns = sorted(off - on for on, off in chip.pulses(STROBE))
    assert burns[len(burns) // 2] <= 0.5 * PERIOD_S + 1e-3
    assert burns[-1] <= PATIENCE_S
    code, said, _ = station.stop()
    assert code == 0
    assert re.search(r"nothing was fired in shots \d+ to \d+", said), said
    assert "guard_cut, about shot" in said


def test_a_guard_that_ends_is_replaced(gpio_start, chip):
    station = gpio_start()
    guard = guard_of(station)
    os.kill(guard, signal.SIGKILL)
    wait_for(lambda: station.status()["pulses"]["reopened"] == 1, RUN_ON_S)
    assert guard_of(station) != guard
    before = chip.number(COUNT_AT)
    wait_for(lambda: chip.number(COUNT_AT) > before + 20, RUN_ON_S)
    code, said, _ = station.stop()
    assert code == 0 and "lost: the lines' guard has ended" in said
    assert not pathlib.Path(f"/proc/{guard}").exists()


def test_a_chip_that_goes_away_is_a_state_and_comes_back_with_its_shots_numbered_on(
        gpio_start, chip, tmp_path):
    station = gpio_start()
    chip.set_gone(1)
    status = wait_for(lambda: (s := station.status())["trigger_lost"] and s, RUN_ON_S)
    assert status["state"] == "running"
    wait_for(lambda: "no GPIO chip" in (station.status()["pulses"]["lost_why"] or ""), RUN_ON_S)
    assert "trigger lost for" in station.ctl("status").stdout
    chip.set_gone(0)
    before = chip.number(COUNT_AT)
    status = wait_for(lambda: (s := station.status())["pulses"]["reopened"] and s, RUN_ON_S)
    assert not status["trigger_lost"]
    wait_for(lambda: chip.number(COUNT_AT) > before + 40, RUN_ON_S)
    time.sleep(1.1)
    assert station.status()["pulses"]["missed"] > 30
    tap = station.ctl("stream", "tap", "--count", "40", "--json")
    shots = [json.loads(line)["shot"] for line in tap.stdout.splitlines()]
    assert shots == sorted(shots) and shots[0] > 60
    code, said, _ = station.stop()
    assert code == 0 and "lost: the device is gone" in said and "is back" in said


def test_a_genlock_that_is_silent_is_told_and_paces_the_shots_when_it_comes(gpio_start, chip):
    station = gpio_start(lines="strobe=STROBE,genlock=SYNC_IN", wait=False)
    wait_for(lambda: (station.socket_dir / "control.sock").exists(), 20)
    status = wait_for(lambda: (s := station.status())["pulses"]["quiet_s"] >= 3 and s, 20)
    assert status["shots"]["edges"] == 0
    assert "trigger: no pulse for" in station.ctl("status").stdout
    for _ in range(120):
        chip.add_edge()
        time.sleep(PERIOD_S)
    status = station.status()
    assert status["shots"]["edges"] >= 60
    assert len(chip.pulses(STROBE)) >= 30
    code, said, _ = station.stop()
    assert code == 0 and "is its genlock connected" in said


def test_a_trigger_lost_while_stopped_is_found_again(gpio_start, chip):
    station = gpio_start()
    chip.set_gone(1)
    wait_for(lambda: station.status()["trigger_lost"], RUN_ON_S)
    assert station.ctl("stop").returncode == 0
    wait_for(lambda: "no GPIO chip" in (station.status()["pulses"]["lost_why"] or ""), RUN_ON_S)
    refused = station.ctl("start")
    assert refused.returncode == 4 and "no GPIO chip" in refused.stderr
    chip.set_gone(0)
    wait_for(lambda: not station.status()["trigger_lost"], RUN_ON_S)
    assert station.ctl("start").returncode == 0
    chip.wait_lit(STROBE)


def test_where_the_guard_was_killed_too_the_unit_darkens(gpio_start, chip):
    station = gpio_start(LONG)
    guard = guard_of(station)
    os.kill(guard, signal.SIGSTOP)
    for _ in range(50):  # until it stands still in mid-pulse
        chip.wait_lit(STROBE)
        station.process.send_signal(signal.SIGSTOP)
        time.sleep(0.01)
        if chip.levels() & STROBE:
            break
        station.process.send_signal(signal.SIGCONT)
    station.process.kill()
    os.kill(guard, signal.SIGKILL)
    station.process.communicate()
    assert chip.levels() & STROBE
    done = darken(station)
    assert (done.returncode, chip.levels()) == (0, 0), done.stderr


def test_to_darken_waits_for_a_guard_that_still_has_the_lines(gpio_start, chip):
    station = gpio_start(LONG)
    guard = guard_of(station)
    chip.wait_lit(STROBE)
    os.kill(guard, signal.SIGSTOP)
    station.process.kill()
    station.process.communicate()
    waiting = subprocess.Popen([STAGED, "--darken", "--config", station.config],
                               env={**os.environ, **station.environment})
    time.sleep(0.1)
    os.kill(guard, signal.SIGCONT)
    assert waiting.wait(timeout=5) == 0
    assert chip.levels() == 0


def test_a_station_without_its_guard_says_so_and_lights_nothing(gpio_start, chip, monkeypatch):
    monkeypatch.setenv("STAGE_GUARD", "/nonexistent/stage-guard")
    station = gpio_start(wait=False)
    _, said = station.process.communicate(timeout=10)
    assert station.process.returncode == 4
    assert "no guard for the lines" in said
    assert chip.pulses(STROBE) == []


def test_bad_lines_and_chips_end_with_one_line_that_says_what_to_do(gpio_start, chip, tmp_path):
    for lines, code, words in [("ir=IR_TRIGGER", 3, "the chip's lines are IR_TRIG, STROBE"),
                               ("laser=IR_TRIG", 3, "none of ir, strobe, hd"),
                               ("genlock=SYNC_IN,exposure=EXPOSURE", 3, "already SYNC_IN")]:
        station = gpio_start(lines=lines, wait=False)
        _, said = station.process.communicate(timeout=10)
        trigger = [line for line in said.splitlines() if line.startswith("trigger ")]
        assert station.process.returncode == code, said
        assert len(trigger) == 1 and words in trigger[0]
    (tmp_path / "chips" / "gpiochip0").unlink()
    station = gpio_start(wait=False)
    _, said = station.process.communicate(timeout=10)
    assert station.process.returncode == 4 and "no GPIO chip gpiochip0" in said


def test_chips_are_listed_with_their_lines_and_who_has_them(gpio_start, chip, tmp_path):
    def list_triggers(*options):
        return subprocess.run([os.environ["STAGECTL_FAKE_GPIO"], "trigger", "list", *options],
                              capture_output=True, text=True, check=True, timeout=10,
                              env={**os.environ, "FAKE_GPIO_DIR": str(tmp_path / "chips")}).stdout

    free = json.loads(list_triggers("--json"))["triggers"]
    ours = next(one for one in free if one["address"] == "gpio:gpiochip0")
    assert ours["device"] == "fake, 6 lines"
    assert ours["lines"] == "IR_TRIG, STROBE, HD_TRIG, EXPOSURE, SYNC_IN"
    gpio_start()
    assert "IR_TRIG (stage trigger), STROBE (stage trigger)" in list_triggers()


@pytest.fixture
def doctor(gpio_config, tmp_path, chip):
    """A doctor who measures the light of a stage on the chip's lines."""
    assert chip.levels() == 0
    with subprocess.Popen([os.environ["STAGECTL_FAKE_GPIO"], "doctor", gpio_config(LONG), "--json"],
                          stdout=subprocess.PIPE, text=True,
                          env={**os.environ, "FAKE_GPIO_DIR": str(tmp_path / "chips")}) as process:
        yield process
        process.kill()


def test_doctor_fires_with_and_without_strobes_and_leaves_the_lines_dark(doctor, chip):
    findings = json.loads(doctor.communicate(timeout=60)[0])["findings"]
    assert chip.levels() == 0
    exposures, burns = chip.pulses(IR), chip.pulses(STROBE)
    assert burns and len(exposures) > 1.5 * len(burns)
    level = next(f for f in findings if f["what"].startswith("line STROBE"))
    assert (level["level"], level["measured"]) == ("ok", "reads dark")
    assert sum(f["topic"] == "light" for f in findings) == 4


def test_a_doctor_who_is_killed_leaves_the_lines_dark(doctor, chip):
    chip.wait_lit(STROBE)
    doctor.kill()
    chip.wait_dark(PATIENCE_S + 2)
