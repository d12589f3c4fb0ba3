"""HD cameras beside the tracked ones: live, and as recordings."""
import json
import time

import pytest
import stageclient

from conftest import Station, SteppedStation, ctl, simulated
from png_file import read_png

PHASE = 2


@pytest.fixture(scope="module")
def hd_recording(tmp_path_factory):
    place = tmp_path_factory.mktemp("hd") / "stage"
    done = ctl("sim", "record", place, "--seconds", "0.2", "--hd", "1", "--seed", "5")
    assert done.returncode == 0, done.stderr
    return place


@pytest.fixture(scope="module")
def live(hd_recording, tmp_path_factory):
    """Four IR cameras at 120 Hz and one HD camera, exposed in shots 4k + PHASE."""
    config = hd_recording / "sim.yaml"
    config.write_text(simulated(hd_recording) + f"hd: {{phase: {PHASE}}}\n")
    station = Station(config, tmp_path_factory.mktemp("live") / "sockets").wait_running()
    yield station
    station.end()


@pytest.fixture
def stepped(live, hd_recording, tmp_path):
    """The same in virtual time."""
    config = hd_recording / "stepped.yaml"
    text = (hd_recording / "sim.yaml").read_text()
    config.write_text(text.replace("seed: 5}", "seed: 5, clock: stepped}"))
    station = SteppedStation(config, tmp_path / "stepped")
    yield station
    station.end()


def hd_camera(status):
    return next(camera for camera in status["cameras"] if camera["role"] == "hd")


def test_hd_frame_k_is_of_shot_4k_plus_phase(live):
    seen, end = set(), time.monotonic() + 2
    while time.monotonic() < end:
        hd = hd_camera(live.status())["hd"]
        assert hd["off_phase"] == 0
        if hd["shot"] is not None:  # the first frame may not have come yet
            assert hd["shot"] == 4 * hd["index"] + PHASE
            seen.add(hd["index"])
    assert len(seen) >= 10 and max(seen) - min(seen) > 45


def test_hd_frames_come_at_a_quarter_of_the_rate_and_none_is_lost(live):
    before, begin = hd_camera(live.status()), time.monotonic()
    time.sleep(1)
    after, passed = hd_camera(live.status()), time.monotonic() - begin
    assert abs((after["frames"] - before["frames"]) / passed - 30) < 3
    assert after["losses"]["refused"] == after["losses"]["wrong_time"] == 0


def test_marker_sets_name_the_hd_frame_of_their_shot(live):
    tap = live.ctl("stream", "tap", "--json", "--count", "60")
    sets = [json.loads(line) for line in tap.stdout.splitlines() if '"shot"' in line]
    assert len(sets) == 60
    for one in sets:
        if one["shot"] % 4 == PHASE:
            assert one["hd"].items() >= {"index": one["shot"] // 4, "phase": PHASE}.items()
            assert 0 < one["hd"]["mid_exposure_ns"] - one["mid_exposure_ns"] < 8_000_000
        else:
            assert "hd" not in one


def test_python_interpolates_to_the_hd_exposure():
    times_ns = [1000, 2000, 3100, 4000]
    places_m = [(t, 2 - t * t, t ** 3) for t in (1, 2, 3.1, 4)]
    place_m = stageclient.interpolate(times_ns, places_m, 2500)
    assert place_m == pytest.approx((2.5, 2 - 6.25, 15.625))
    with pytest.raises(ValueError):
        stageclient.interpolate(times_ns, places_m, 900)


def test_no_shot_waits_for_hd(live):
    status = live.status()
    assert hd_camera(status)["missing"] == 0
    assert status["shots"]["solved"] > status["cameras"][-1]["frames"] * 3


def test_preview_of_an_hd_camera_is_a_colour_picture_of_its_size(live, tmp_path):
    image = tmp_path / "hd0.png"
    done = live.ctl("camera", "preview", "hd0", "--output", image)
    assert done.returncode == 0, done.stderr
    assert read_png(image) == (1920, 1080)


def test_recorded_hd_frames_bear_the_shots_they_were_exposed_in(hd_recording, start):
    rows = (hd_recording / "hd0" / "frames.csv").read_text().splitlines()[1:]
    shots = [int(row.split(",")[0]) for row in rows]
    assert shots == [0, 4, 8, 12, 16, 20]
    station = start(hd_recording / "stage.yaml").wait_running()
    deadline = time.monotonic() + 5
    while (status := station.status())["state"] != "ended" and time.monotonic() < deadline:
        time.sleep(0.05)
    camera = hd_camera(status)
    assert camera["frames"] == 6 and camera["hd"]["off_phase"] == 0


def test_two_seconds_hold_sixty_hd_frames(stepped):
    stepped.run_for(0.5)
    before = hd_camera(stepped.status())
    stepped.run_for(2)
    after = hd_camera(stepped.status())
    assert after["frames"] - before["frames"] == 60
    assert after["hd"]["index"] - before["hd"]["index"] == 60
    assert after["hd"]["shot"] == 4 * after["hd"]["index"] + PHASE
    assert after["losses"]["device_gaps"] == after["losses"]["refused"] == 0
