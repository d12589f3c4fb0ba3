"""A live station on simulated cameras: what it tells, and what it survives."""
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time

import pytest
from conftest import ctl, truncate


def ask(client, method, **parameters):
    client.sendall(json.dumps({"method": method, "parameters": parameters}).encode() + b"\0")
    return read_reply(client)


def read_reply(client):
    reply = b""
    while not reply.endswith(b"\0"):
        more = client.recv(1 << 16)
        assert more, "cut off"
        reply += more
    return json.loads(reply[:-1])


def is_cut_off(client):
    try:
        while client.recv(1 << 16):
            pass
    except ConnectionResetError:
        pass
    return True


def test_status_tells_cameras_rates_and_losses(shared_station):
    time.sleep(1.2)
    status = shared_station.status()
    assert status["state"] == "running"
    assert [camera["name"] for camera in status["cameras"]] == ["ir0", "ir1", "ir2", "ir3"]
    for camera in status["cameras"]:
        assert (camera["width_px"], camera["height_px"]) == (1280, 1024)
        assert 50 < camera["frames_per_s"] < 70
        assert camera["blobs_per_frame"] > 20
        assert set(camera["losses"]) >= {"damaged", "refused", "stale", "device_gaps"}
    assert 0 < status["latency_ms"]["p50"] <= status["latency_ms"]["p99"]
    text = shared_station.ctl("status").stdout
    assert "ir3" in text and "latency" in text


def test_tap_gets_every_shot_with_labels(shared_station):
    done = shared_station.ctl("stream", "tap", "--count", "30", "--json")
    assert done.returncode == 0, done.stderr
    sets = [json.loads(line) for line in done.stdout.splitlines()]
    assert [s["shot"] for s in sets] == list(range(sets[0]["shot"], sets[0]["shot"] + 30))
    labels = [m["label"] for m in sets[-1]["markers"] if m["status"] != "missing"]
    assert len(labels) > 50
    assert sets[-1]["heads"][0]["residual_m"] < 1e-3


def test_tap_that_gets_less_than_it_asked_for_says_so(shared_station):
    done = shared_station.ctl("stream", "tap", "--count", "100000", "--seconds", "0.3")
    assert done.returncode == 6
    assert done.stdout.count("\nshot") > 5


@pytest.mark.parametrize("command", [[os.environ["SUBSCRIBE_C"]],
                                     [sys.executable, os.environ["SUBSCRIBE_PY"]]])
def test_the_examples_print_a_line_a_second(shared_station, command):
    with subprocess.Popen([*command, str(shared_station.socket_dir / "stream.sock")],
                          stdout=subprocess.PIPE, text=True) as example:
        lines = [example.stdout.readline() for _ in range(5)]
        example.kill()
    assert lines[0].startswith("4 cameras, 74 labels, rig ")
    assert all(re.fullmatch(r"shot \d+: \d+ named markers seen, 0 sets lost\n", line)
               for line in lines[1:])


def test_the_c_example_fails_on_what_is_no_stream(tmp_path):
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as listening:
        listening.bind(str(tmp_path / "s"))
        listening.listen()
        with subprocess.Popen([os.environ["SUBSCRIBE_C"], str(tmp_path / "s")],
                              stderr=subprocess.PIPE, text=True) as example:
            client, _ = listening.accept()
            with client:
                client.sendall(b"\xff" * 64)
                assert example.wait(5) == 1


def test_preview_is_a_picture_with_the_spots_found(shared_station, tmp_path):
    picture = tmp_path / "ir2.png"
    done = shared_station.ctl("camera", "preview", "ir2", "--output", picture, "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert (told["width_px"], told["height_px"]) == (1280, 1024)
    assert told["blobs"] > 20
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_camera_show_asks_the_station(shared_station):
    told = json.loads(shared_station.ctl("camera", "show", "ir1", "--json").stdout)
    assert told["address"] == "sim:ir1" and told["state"] == "running"
    lines = shared_station.ctl("camera", "show", "ir1").stdout.splitlines()
    keys = [re.match(r" *\S+", line)[0] for line in lines]
    assert len(set(keys)) == len(keys)
    assert [line.split()[1:] for line in lines if line.startswith("lost ")] == [["-"]]
    refused = shared_station.ctl("camera", "show", "ir9")
    assert refused.returncode == 4 and "ir9" in refused.stderr
    refused = shared_station.ctl("camera", "preview", "ir9")
    assert refused.returncode == 4 and "no camera ir9, but ir0, ir1" in refused.stderr


def test_control_socket_describes_itself(shared_station):
    client = shared_station.connect("control.sock")
    info = ask(client, "org.varlink.service.GetInfo")["parameters"]
    assert "org.stage.Control" in info["interfaces"]
    text = ask(client, "org.varlink.service.GetInterfaceDescription",
               interface="org.stage.Control")["parameters"]["description"]
    assert "method Preview" in text
    assert ask(client, "org.stage.Control.Explode")["error"].endswith("MethodNotFound")
    assert ask(client, "org.stage.Control.Preview")["error"].endswith("InvalidParameter")


def test_two_requests_in_one_packet_get_two_replies(shared_station):
    client = shared_station.connect("control.sock")
    request = json.dumps({"method": "org.varlink.service.GetInfo"}).encode() + b"\0"
    client.sendall(request + request)
    replies = b""
    while replies.count(b"\0") < 2:
        replies += client.recv(1 << 16)
    assert all(b"staged" in reply for reply in replies.split(b"\0")[:2])


def test_garbage_is_cut_off_and_the_station_runs_on(station):
    for garbage in (b"\xff\xfe\0", b"[]\0", b'{"method":7}\0', b"{" * 5000 + b"\0",
                    b"x" * 70000):
        client = station.connect("control.sock")
        try:
            client.sendall(garbage)
        except (BrokenPipeError, ConnectionResetError):
            pass
        assert is_cut_off(client)
    subscriber = station.connect("stream.sock")
    subscriber.sendall(b"\x00garbage")
    assert is_cut_off(subscriber)
    status = station.status()
    assert status["control"]["cut_off"] == 5
    assert status["stream"]["cut_off"] == 1
    assert station.ctl("stream", "tap", "--count", "3").returncode == 0


def test_client_that_stops_inside_a_request_is_cut_off(station):
    client = station.connect("control.sock")
    client.sendall(b'{"method":')
    assert is_cut_off(client)
    assert station.status()["control"]["cut_off"] == 1


def test_crowd_of_clients_is_refused_and_leaves_room_again(station):
    clients = []
    for _ in range(40):
        clients.append(station.connect("control.sock"))
        time.sleep(0.01)  # the kernel's own queue is short
    for client in clients:
        client.close()
    time.sleep(0.2)
    assert station.status()["control"]["refused"] >= 20


def test_silent_clients_make_room_for_a_new_one(station):
    clients = []
    for _ in range(16):
        clients.append(station.connect("control.sock"))
        time.sleep(0.01)
    refused = station.ctl("status")
    assert refused.returncode == 7 and "no more than 16" in refused.stderr
    time.sleep(5.1)
    assert station.ctl("status").returncode == 0


def test_second_station_in_the_same_place_is_refused(station, start, sim_config):
    second = start(sim_config)
    _, said = second.process.communicate(timeout=10)
    assert second.process.returncode == 7
    assert "control.sock" in said and "another" in said
    assert station.ctl("stream", "tap", "--count", "3").returncode == 0


def test_second_station_is_refused_before_it_touches_a_device(station, start, sim_config):
    config = sim_config.with_name("busy.yaml")
    config.write_text(sim_config.read_text().replace("sim:ir3", "sim:busy"))
    second = start(config)
    _, said = second.process.communicate(timeout=10)
    assert second.process.returncode == 7, said
    assert "another station" in said and "busy" not in said


def test_station_takes_the_place_of_one_that_was_killed(station, start, sim_config):
    station.stop(signal.SIGKILL)
    assert (station.socket_dir / "control.sock").exists()
    start(sim_config).wait_running()


def test_sigterm_ends_within_a_second_and_leaves_nothing(station):
    tap = station.connect("stream.sock")
    code, said, seconds = station.stop()
    assert code == 0, said
    assert seconds < 1
    assert not list(station.socket_dir.iterdir())
    assert is_cut_off(tap)


def test_sockets_are_for_the_owner_and_the_group(shared_station):
    for name in ("control.sock", "stream.sock"):
        assert (shared_station.socket_dir / name).stat().st_mode & 0o777 == 0o660


def test_systemd_is_told_when_it_is_ready_and_when_it_stops(start, sim_config, tmp_path):
    notify = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    notify.bind(str(tmp_path / "notify"))
    notify.settimeout(5)
    station = start(sim_config, environment={"NOTIFY_SOCKET": str(tmp_path / "notify")})
    assert b"READY=1" in notify.recv(1000)
    station.process.send_signal(signal.SIGINT)
    assert b"STOPPING=1" in notify.recv(1000)
    assert station.process.wait(5) == 0


def test_socket_dir_that_cannot_be_made_names_the_remedy(start, sim_config, tmp_path):
    (tmp_path / "file").write_text("")
    station = start(sim_config, socket_dir=tmp_path / "file" / "sockets")
    _, said = station.process.communicate(timeout=10)
    assert station.process.returncode == 5
    assert "--socket-dir" in said and "socket_dir" in said


def test_recording_that_ends_leaves_the_station_up(recording, start):
    station = start(recording / "stage.yaml").wait_running()
    deadline = time.monotonic() + 5
    while station.status()["state"] != "ended" and time.monotonic() < deadline:
        time.sleep(0.1)
    status = station.status()
    assert status["state"] == "ended"
    assert status["shots"]["solved"] == 48 and status["shots"]["incomplete"] == 0
    assert station.stop()[0] == 0


def test_recording_of_another_rate_than_the_config_loses_no_shot(stage, start):
    for camera in range(4):  # without shot numbers, so that the times alone count
        table = stage / f"ir{camera}" / "frames.csv"
        rows = [line.partition(",")[2] for line in table.read_text().splitlines()]
        table.write_text("\n".join(rows) + "\n")
    config = stage / "stage.yaml"
    config.write_text(config.read_text().replace("rate_hz: 120", "rate_hz: 240"))
    station = start(config).wait_running()
    time.sleep(1)
    shots = station.status()["shots"]
    assert shots["lost"] == 0 and shots["solved"] >= 47


def test_truncated_image_is_named_and_counted(stage, start):
    truncate(stage / "ir1" / "000010.pgm")
    station = start(stage / "stage.yaml").wait_running()
    time.sleep(1.5)
    status = station.status()
    assert status["cameras"][1]["losses"]["damaged"] == 1
    assert status["shots"]["solved"] == 48 and status["shots"]["incomplete"] == 1
    assert "ir1/000010.pgm" in station.stop()[1]


def test_without_a_station_the_live_verbs_say_so(tmp_path):
    for verb in (["status"], ["stream", "tap"], ["camera", "show", "ir0"],
                 ["camera", "preview", "ir0"]):
        done = ctl(*verb, "--socket-dir", tmp_path)
        assert done.returncode == 5
        assert "staged" in done.stderr and str(tmp_path) in done.stderr


def test_address_is_opened_without_a_station(recording, tmp_path):
    done = ctl("camera", "preview", f"files:{recording}/ir0", "--output", tmp_path / "a.png")
    assert done.returncode == 0, done.stderr
    assert "1280x1024" in done.stdout and (tmp_path / "a.png").exists()
    missing = ctl("camera", "show", "files:/nowhere")
    assert missing.returncode in (3, 4) and "/nowhere" in missing.stderr


def test_every_verb_has_help_and_wrong_usage_is_told():
    assert ctl("--version").returncode == 0
    for verb in ("status", "camera list", "camera show", "camera preview", "trigger list",
                 "stream tap", "config check", "process", "sim record"):
        told = ctl(*verb.split(), "--help")
        assert told.returncode == 0
        assert f"stagectl {verb}" in told.stdout and "Exit codes" in told.stdout
        assert ctl(*verb.split(), "--no-such-option").returncode == 2
        assert "stagectl" in ctl(*verb.split(), "--no-such-option").stderr.split(":")[0]
    assert ctl("fly").returncode == 2
    assert ctl().returncode == 2


def test_sim_record_tells_wrong_wishes_from_a_full_disk(tmp_path):
    for wish in (("--cameras", "99"), ("--scene", "opera"), ("--rate", "99999"), ("--hd", "77")):
        told = ctl("sim", "record", tmp_path / "take", *wish)
        assert told.returncode == 2 and wish[1] in told.stderr
        assert not (tmp_path / "take").exists()
    assert ctl("sim", "record", tmp_path / "no" / "take").returncode == 1
