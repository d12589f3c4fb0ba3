"""The Python client reads what the C server wrote. Run by meson, which sets SERVE_SAMPLE, and EMULATOR
where that is built for another processor."""
import os
import socket
import struct
import subprocess

import pytest

import stageclient


@pytest.fixture
def stream(tmp_path):
    path = str(tmp_path / "stream.sock")
    command = [*os.environ["EMULATOR"].split(), os.environ["SERVE_SAMPLE"], path]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as station:
        assert station.stdout.readline() == b"ready\n"
        with stageclient.connect(path, timeout_s=10) as client:
            yield client
        assert station.wait(10) == 0


def test_python_reads_what_c_wrote(stream):
    events = list(stream)
    description, sets = events[0], events[1:]
    assert isinstance(description, stageclient.Description)
    assert description.protocol_version == 1 and description.length_unit == "m"
    assert description.clock.name == "CLOCK_MONOTONIC"
    assert [c.name for c in description.cameras] == ["ir1", "hd1"]
    assert stream.labels[73] == "marker_73"
    assert description.actors[0].markers[3].rigid
    assert [s.shot for s in sets] == list(range(1, 51))
    last = sets[-1]
    assert last.mid_exposure_ns == 1000000000 + 50 * 8333333
    assert list(last.heads[0].q_wxyz) == [1, 0, 0, 0]
    assert list(last.heads[0].t_m) == [0.1, 0.2, 1.5]
    assert len(last.markers) == 74 + 3
    assert (last.markers[72].x_m, last.markers[72].y_m) == (0.001 * 72, 1e-6 * 50)
    assert last.markers[72].cov_m2[5] == pytest.approx(6e-10, rel=1e-6)
    assert last.markers[70].status == stageclient.MISSING and not last.markers[70].cov_m2
    assert last.markers[70].gone and not last.markers[70].stabilised_m
    assert last.markers[72].confidence == 0.875 and last.markers[72].normalised_m[2] == -36
    assert last.markers[71].status == stageclient.PREDICTED
    assert last.markers[76].label == -1
    assert stream.sets_lost == 0


def connect_to_bytes(tmp_path, data):
    """A client of a station that sends just these bytes."""
    path = str(tmp_path / "s")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(path)
        listener.listen()
        client = stageclient.connect(path, timeout_s=5)
        peer, _ = listener.accept()
        with peer:
            peer.sendall(data)
    return client


@pytest.mark.parametrize("data", [
    pytest.param(struct.pack("<I", 1 << 31), id="too_long"),
    pytest.param(struct.pack("<I", 4) + b"\xff\xff\xff\xff", id="not_protobuf"),
    pytest.param(struct.pack("<I", 2) + b"\x12\x00", id="markers_before_description"),
])
def test_what_is_not_a_stream_is_refused(tmp_path, data):
    with connect_to_bytes(tmp_path, data) as client:
        with pytest.raises(stageclient.ProtocolError):
            next(client)


def test_stream_cut_in_mid_message_has_ended(tmp_path):
    with connect_to_bytes(tmp_path, struct.pack("<I", 100) + b"\x0a") as client:
        assert list(client) == []
