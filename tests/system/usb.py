"""A station on a USB adapter, with a file for it (tests/usb/fake_ft232h.h): what it counts is what was on
the lines, and what becomes of it when the adapter is pulled out."""
import json
import signal
import time

import pytest
from conftest import wait_for
from fake_adapter import HD, IR, STROBE, Adapter

PERIOD_S = 1 / 60
RUN_ON_S = 5  # the other side of a reopening: looked for every second


@pytest.fixture
def adapter(tmp_path):
    return Adapter(tmp_path / "adapter")


@pytest.fixture
def usb_start(start, fired_config, tmp_path):
    """usb_start(trigger) -> a station on the adapter."""

    def start_one(trigger="usb:FAKE", wait=True):
        station = start(fired_config(trigger),
                        environment={"FAKE_FT232H": str(tmp_path / "adapter")})
        return station.wait_running(10) if wait else station

    return start_one


def periods_of(pulses):
    """When they began, in periods after the first."""
    return [round((on - pulses[0][0]) / PERIOD_S) for on, _ in pulses]


def test_every_shot_that_is_counted_was_on_the_lines(usb_start, adapter):
    station = usb_start()
    time.sleep(1.5)
    code, said, _ = station.stop()
    assert code == 0 and not adapter.is_lit(), said
    exposures, burns, hd = (adapter.pulses(line) for line in (IR, STROBE, HD))
    assert len(exposures) == len(burns) >= 60
    assert max(off - on for on, off in burns) <= 0.1 * PERIOD_S
    hd_shots = [round((on - exposures[0][0]) / PERIOD_S) for on, _ in hd]
    assert {shot % 4 for shot in hd_shots} == {0}


def test_the_stream_numbers_the_shots_as_they_were_fired(usb_start, adapter):
    station = usb_start()
    tap = station.ctl("stream", "tap", "--count", "40", "--json")
    sets = [json.loads(line) for line in tap.stdout.splitlines()]
    fired = adapter.pulses(IR)
    assert len(sets) == 40
    assert [one["shot"] for one in sets] == sorted({one["shot"] for one in sets})
    status = station.status()
    assert status["pulses"]["missed"] >= sets[-1]["shot"] + 1 - len(fired)
    assert status["shots"]["edges"] <= len(adapter.pulses(IR))


def test_an_adapter_that_is_unplugged_is_named_and_comes_back_with_its_shots_numbered_on(
        usb_start, adapter):
    station = usb_start()
    adapter.set_gone(1)
    status = wait_for(lambda: (s := station.status())["trigger_lost"] and s, RUN_ON_S)
    assert status["state"] == "running"
    wait_for(lambda: "no such adapter" in (station.status()["pulses"]["lost_why"] or ""), RUN_ON_S)
    assert "trigger lost for" in station.ctl("status").stdout
    fired = len(adapter.pulses(IR))
    adapter.set_gone(0)
    status = wait_for(lambda: (s := station.status())["pulses"]["reopened"] and s, RUN_ON_S)
    assert not status["trigger_lost"]
    wait_for(lambda: len(adapter.pulses(IR)) > fired + 20, RUN_ON_S)
    wait_for(lambda: station.status()["pulses"]["missed"] > 30, RUN_ON_S)
    tap = station.ctl("stream", "tap", "--count", "20", "--json")
    shots = [json.loads(line)["shot"] for line in tap.stdout.splitlines()]
    assert shots == sorted(shots) and shots[0] > fired
    code, said, _ = station.stop()
    assert code == 0 and "lost: the device is gone" in said and "is back" in said


def test_a_station_that_stands_still_runs_out_of_samples_dark_and_says_so(usb_start, adapter):
    station = usb_start()
    station.process.send_signal(signal.SIGSTOP)
    time.sleep(1)
    assert not adapter.is_lit()
    station.process.send_signal(signal.SIGCONT)
    events = wait_for(lambda: (e := station.status()["pulses"]["events"])["underrun"] and e, RUN_ON_S)
    assert events["underrun"] >= 1
    assert station.status()["pulses"]["missed"] > 20
    grid = periods_of(adapter.pulses(IR))
    assert len(set(grid)) == len(grid), "two pulses in one period"


def test_a_killed_station_leaves_the_lines_dark(usb_start, adapter):
    station = usb_start()
    station.process.kill()
    station.process.communicate()
    assert not adapter.is_lit()
    usb_start()  # nothing is left over of the first


def test_a_stop_is_dark_and_a_start_begins_with_shot_0(usb_start, adapter):
    station = usb_start()
    assert station.ctl("stop").returncode == 0
    before = len(adapter.pulses(IR))
    assert not adapter.is_lit()
    time.sleep(0.3)
    assert len(adapter.pulses(IR)) == before
    assert station.ctl("start").returncode == 0
    wait_for(lambda: len(adapter.pulses(IR)) > before + 20, RUN_ON_S)
    [first] = station.ctl("stream", "tap", "--count", "1", "--json").stdout.splitlines()
    assert json.loads(first)["shot"] <= len(adapter.pulses(IR)) - before


@pytest.mark.parametrize("trigger, gone, code, words", [
    ("usb:OTHER", 0, 4, "no such adapter; there is FAKE"),
    ("usb", 1, 4, "no such adapter"),
    ("usb:FAKE,strobe=D0", 0, 3, "take D1, D3, D5, D6 or D7")])
def test_an_adapter_that_cannot_be_had_ends_with_one_line_that_says_what_to_do(
        usb_start, adapter, trigger, gone, code, words):
    adapter.set_gone(gone)
    station = usb_start(trigger, wait=False)
    _, said = station.process.communicate(timeout=10)
    told = [line for line in said.splitlines() if line.startswith("trigger ")]
    assert station.process.returncode == code, said
    assert len(told) == 1 and words in told[0]
