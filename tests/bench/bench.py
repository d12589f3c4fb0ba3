#!/usr/bin/python3
"""Runs the benches and holds every figure against its gate: bench.py BUILD [NAME] [--json] [OPTION ...]

A bench is a program BUILD/tests/bench/bench-NAME that prints one JSON object on standard output when
it is given --json. Its members with a row in FIGURES are judged, all others are told as they are.
Ends with 1 when a figure misses its gate or was not measured.
"""
import json
import pathlib
import subprocess
import sys

USAGE = """usage: ./stage bench [NAME] [--json] [OPTION ...]
  NAME      station  what the station costs over the bare minimum, in one run
            blobs    finding spots: time over reading the frame, centroids over the noise bound
            points   triangulation over the noise bound, covariances, solve time
            calibration  rigs against the truth and against mrcal-calibrate-cameras, time, corners
            ingest   the aravis driver's CPU over a bare receive loop, on simulated cameras
            render   pictures of the simulator per second, speed of scenes at blob level
            without: all of them, one after the other
  --json    one object: every figure, and under "gates" its gate, its ambition and what is met
  OPTION    of that bench (station, ingest: --rounds N; points: --seed N, --quick; render: --seed N;
            calibration: --seed N, --rigs N, --minutes N, --no-tool)
Ends with 1 when a figure misses its gate. docs/figures.md tells what each figure means.
"""

# Bench, figure, gate, ambition. The least a figure may be where the ambition is above the gate or
# the name ends in _least; the most it may be everywhere else.
FIGURES = [
    ("station", "station_cpu_over_read", 2.5, 1.8),
    ("station", "latency_over_floor_p50", 2.0, 1.5),
    ("station", "latency_over_floor_p99", 3.0, 2.0),
    ("blobs", "blob_time_over_read", 1.6, 1.25),
    ("blobs", "blob_time_over_read_dark", 1.15, 1.05),
    ("blobs", "opencv_contours_time_over_ours", 5, 8),
    ("blobs", "opencv_components_time_over_ours", 100, 150),
    ("blobs", "centroid_rmse_over_crlb", 1.25, 1.10),
    ("blobs", "centroid_rmse_saturated_px", 0.020, 0.010),
    ("blobs", "centroid_phase_bias_px", 0.010, 0.003),
    ("points", "point_rmse_over_crlb", 1.03, 1.01),
    ("points", "point_rmse_over_crlb_unequal", 1.10, 1.02),
    ("points", "point_rmse_over_oracle_outliers", 1.5, 1.2),
    ("points", "nees_over_3_least", 0.8, 0.8),
    ("points", "nees_over_3_most", 1.25, 1.25),
    ("points", "ellipsoid_95_share_least", 0.92, 0.92),
    ("points", "ellipsoid_95_share_most", 0.98, 0.98),
    ("points", "solve_cpu_us_p99", 500, 150),
    ("calibration", "rms_over_mrcal_tool", 1.01, 1.001),
    ("calibration", "camera_position_vs_mrcal_tool_mm", 0.01, 0.001),
    ("calibration", "camera_position_error_mm", 0.8, 0.3),
    ("calibration", "volume_reprojection_rms_px", 0.05, 0.02),
    ("calibration", "triangulation_mean_mm", 0.07, 0.02),
    ("calibration", "corner_rms_px", 0.05, 0.04),
    ("calibration", "one_sigma_coverage_least", 0.60, 0.60),
    ("calibration", "one_sigma_coverage_most", 0.76, 0.76),
    ("calibration", "wall_s", 60, 30),
    ("calibration", "hd_reprojection_rms_px", 0.1, 0.05),
    ("calibration", "bump_named_worst_s", 2, 1.6),
    ("calibration", "bump_false_alarms", 0, 0),
    ("ingest", "gige_cpu_over_recv", 1.3, 1.1),
    ("render", "render_images_per_s", 60, 125),
    ("render", "blob_level_over_real_time", 20, 30),
]
# Not measured, and not missed, where the yardstick is not installed.
NEED_TOOL = {"rms_over_mrcal_tool", "camera_position_vs_mrcal_tool_mm"}
BENCHES = list(dict.fromkeys(row[0] for row in FIGURES))


def holds(value, limit, at_least):
    return value >= limit if at_least else value <= limit


def judge(figure, gate, ambition, value):
    at_least = ambition > gate or figure.endswith("_least")
    measured = isinstance(value, (int, float))
    return {"gate": gate, "ambition": ambition, "at": "least" if at_least else "most",
            "gate_met": measured and holds(value, gate, at_least),
            "ambition_met": measured and holds(value, ambition, at_least)}


def run(build, bench, options):
    program = pathlib.Path(build) / "tests" / "bench" / f"bench-{bench}"
    print(f"bench {bench} ...", file=sys.stderr)
    done = subprocess.run([program, "--json", *options], stdout=subprocess.PIPE, check=False)
    try:
        return json.loads(done.stdout)
    except ValueError:
        print(f"bench {bench}: no figures (exit status {done.returncode})", file=sys.stderr)
        return {}


def print_table(values, gates):
    print(f"{'figure':36} {'value':>10} {'gate':>10} {'ambition':>10}")
    for figure, row in gates.items():
        value = values.get(figure)
        sign = ">=" if row["at"] == "least" else "<="
        met = "ambition" if row["ambition_met"] else "gate" if row["gate_met"] else "MISSED"
        shown = "none" if value is None else f"{value:.4g}"
        print(f"{figure:36} {shown:>10} {sign} {row['gate']:>7g} {sign} {row['ambition']:>7g}  {met}")
    print()
    for figure, value in values.items():
        if figure not in gates:
            print(f"{figure:36} {value if isinstance(value, (int, float, str)) else json.dumps(value)}")


def main(build, arguments):
    if "--help" in arguments or "-h" in arguments:
        print(USAGE, end="")
        return 0
    as_json = "--json" in arguments
    options = [a for a in arguments if a != "--json"]
    names = BENCHES
    if options:
        names = [options.pop(0)]
        if names[0] not in BENCHES:
            print(f"stage bench: no bench '{names[0]}'\n{USAGE}", end="", file=sys.stderr)
            return 2
    values = {}
    for name in names:
        values |= run(build, name, options)
    gates = {figure: judge(figure, gate, ambition, values.get(figure))
             for bench, figure, gate, ambition in FIGURES
             if bench in names and not (figure in NEED_TOOL and values.get("mrcal_tool_compared") == 0)}
    if as_json:
        print(json.dumps(values | {"gates": gates}))
    else:
        print_table(values, gates)
    return 0 if all(row["gate_met"] for row in gates.values()) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
