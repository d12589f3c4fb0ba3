#!/usr/bin/python3
"""Plays every scene through the tracker and holds its score against the gates: scenes.py BUILD [OPTIONS] [SCENE ...]

A play is one run of `stagectl sim play`. Plays of one scene, level and renderer are one row; a
scene passes when all of its rows do. docs/tracking-figures.md tells what is counted, and why.
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import random
import secrets
import subprocess
import sys
import time

SPEEDS_M_S = (0.2, 1.0)
OPTICS = ("gaussian", "tailed")
BLOB_S, PIXEL_S = 60, 2
SHORT_BLOB_S, SHORT_PIXEL_S = 20, 0.2
SHORT_SPEEDS_M_S = (0.2, 0.4)  # of everyday speech: what no seed may fail
SHORT_PIXEL_SCENES = 3  # which ones the seed says
PIXEL_COST = 60         # of a picture, drawn and searched, over its blobs made from the truth
START_MAX_S = 60        # of plays with pictures; blobs up to there, not scored
SEED_MAX = 10 ** 6
BIN_LEAST = 1000        # markers, below which a mean says little

# Least share of right names without and with occluders, wrong ones of those seen, covariances.
GATES = {"right": (0.999, 0.995), "wrong": 0, "nees_per_axis": (0.8, 1.25), "ellipsoid_share": (0.92, 0.98),
         "predicted_ellipsoid_share": 0.85, "sure_wrong_share": 1e-3}
# What no seed may miss, however unlucky: a short play is a few events and one start from nothing.
SHORT_GATES = {"right": (0.985, 0.98), "wrong": 5e-4, "nees_per_axis": (0.7, 1.4), "ellipsoid_share": (0.9, 0.99),
               "predicted_ellipsoid_share": 0.75, "sure_wrong_share": 1e-3}
RIGHT_LEAST_OF = {"dense-thirty": 0.98}


def stagectl(build, *words):
    done = subprocess.run([pathlib.Path(build) / "ctl" / "stagectl", "sim", *words], check=False,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if done.returncode:
        raise RuntimeError(f"stagectl sim {' '.join(words)}: {done.stderr.strip()}")
    return json.loads(done.stdout)


class Play:
    """One run: what to play and, once run, its score."""

    def __init__(self, scene, level, optics, seed, seconds, speed_m_s, start_s=0):
        self.scene, self.row = scene, (scene["name"], level, optics)
        self.name = f"{seed} at {speed_m_s:.2f}"
        self.words = ["play", scene["name"], "--level", level, "--optics", optics, "--seed", str(seed),
                      "--seconds", f"{seconds:g}", "--face-speed", f"{speed_m_s:.2f}"]
        if start_s > 0:
            self.words += ["--start", f"{start_s:.2f}", "--warm-up", f"{start_s:.2f}"]
        blob_s = start_s + (PIXEL_COST if level == "pixel" else 1) * seconds
        self.weight = blob_s * scene["rate_hz"] * scene["cameras"] * (1 + scene["markers"] / 100)
        self.score = None

    def run(self, build):
        self.score = stagectl(build, *self.words, "--json")

    def command(self):
        return " ".join(["stagectl sim", *self.words])


def speeds_m_s(options):
    return SHORT_SPEEDS_M_S if options.short else SPEEDS_M_S


def dice_of(options, scene, level):
    """Each scene has seeds of its own: the same face in all of them would show less."""
    return random.Random(f"{options.seed} {scene['name']} {level}")


def pick_start_s(dice, scene, seconds):
    """A little before something happens."""
    happens = [t for t in scene["happens_at_s"] if t < START_MAX_S]
    at_s = dice.choice(happens) if happens else dice.uniform(2, min(START_MAX_S, scene["seconds"]))
    return max(1, at_s - dice.uniform(0, 0.5) * seconds)


def blob_plays(scene, options):
    """The first one lasts as long as its scene, the others a minute; both renderers take turns."""
    low, high = speeds_m_s(options)
    dice = dice_of(options, scene, "blob")
    first_seed = dice.randrange(SEED_MAX)
    for i in range(options.seeds):
        speed_m_s = low + (high - low) * i / (options.seeds - 1) if options.seeds > 1 else dice.uniform(low, high)
        seconds = SHORT_BLOB_S if options.short else max(BLOB_S, scene["seconds"] if i == 0 else 0)
        optics = OPTICS[i % 2] if options.seeds > 1 else dice.choice(OPTICS)
        yield Play(scene, "blob", optics, first_seed + i, seconds, speed_m_s)


def pixel_plays(scene, options):
    dice = dice_of(options, scene, "pixel")
    seed = dice.randrange(SEED_MAX)
    seconds = SHORT_PIXEL_S if options.short else PIXEL_S
    start_s = pick_start_s(dice, scene, seconds)
    speed_m_s = dice.uniform(*speeds_m_s(options))
    for optics in OPTICS:
        yield Play(scene, "pixel", optics, seed, seconds, speed_m_s, start_s)


def make_plays(scenes, options):
    pixel_scenes = scenes
    if options.short:
        faces = [scene for scene in scenes if scene["actors"] == 1] or scenes
        pixel_scenes = random.Random(options.seed).sample(faces, min(SHORT_PIXEL_SCENES, len(faces)))
    plays = [play for scene in scenes for play in blob_plays(scene, options)]
    plays += [play for scene in pixel_scenes for play in pixel_plays(scene, options)]
    return sorted(plays, key=lambda play: -play.weight)  # the longest first: cores end together


class Progress:
    """How much of the work is done: one line that changes on a terminal, else a line for every tenth."""

    def __init__(self, plays):
        self.count, self.whole = len(plays), sum(play.weight for play in plays)
        self.done_count, self.done, self.told, self.began_s = 0, 0, 0, time.monotonic()

    def tell(self, play):
        self.done_count += 1
        self.done += play.weight
        share = self.done / self.whole
        passed_s = time.monotonic() - self.began_s
        line = f"{self.done_count} of {self.count} plays, {100 * share:.0f} %, {passed_s / 60:.1f} min"
        if share < 1:
            line += f", about {passed_s * (1 / share - 1) / 60:.1f} min left"
        if sys.stderr.isatty():
            print(f"\r{line:70}", end="\n" if self.done_count == self.count else "", file=sys.stderr, flush=True)
        elif int(10 * share) > self.told:
            self.told = int(10 * share)
            print(line, file=sys.stderr, flush=True)


def run_all(build, plays):
    progress = Progress(plays)
    with concurrent.futures.ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        running = {pool.submit(play.run, build): play for play in plays}
        for future in concurrent.futures.as_completed(running):
            future.result()
            progress.tell(running[future])


def mean(values_and_counts):
    whole = sum(count for _, count in values_and_counts)
    return sum(value * count for value, count in values_and_counts) / whole if whole else 0


def pool(bins):
    return {"count": sum(b["count"] for b in bins),
            "nees_per_axis": mean([(b["nees_per_axis"], b["count"]) for b in bins]),
            "ellipsoid_share": mean([(b["ellipsoid_share"], b["count"]) for b in bins])}


def find_misses(row, right_least, gates):
    misses = [] if row["right_share_worst"] >= right_least else ["right"]
    misses += [what for what in ("wrong", "swapped", "ghosts", "unseen")
               if row[what] > gates["wrong"] * row["seen_by_three"]]
    for b in row["by_cameras"]:
        if b["count"] < BIN_LEAST:
            continue
        for what in ("nees_per_axis", "ellipsoid_share"):
            least, most = gates[what]
            if not least <= b[what] <= most:
                misses.append(f"{what.partition('_')[0]} {b['cameras']}")
    if row["predicted"]["count"] >= BIN_LEAST and \
            row["predicted"]["ellipsoid_share"] < gates["predicted_ellipsoid_share"]:
        misses.append("predicted")
    if row["sure_wrong"] > gates["sure_wrong_share"] * row["sure"]:
        misses.append("sure")
    return misses


def judge(key, plays, gates):
    scores = [play.score for play in plays]
    worst = min(plays, key=lambda play: (-play.score["wrong"], play.score["right_share"]))
    row = dict(zip(("scene", "level", "optics"), key))
    row |= {"plays": len(plays), "worst": worst.command(), "worst_play": worst.name,
            "right_share_worst": min(score["right_share"] for score in scores),
            "right_share_mean": mean([(score["right_share"], score["seen_by_three"]) for score in scores]),
            "unnamed_share": mean([(score["unnamed_share"], score["seen_by_three"]) for score in scores]),
            "rms_mm": mean([(score["rms_mm"] ** 2, score["shots"]) for score in scores]) ** 0.5,
            "by_cameras": [{"cameras": bins[0]["cameras"], **pool(bins)}
                           for bins in zip(*(score["by_cameras"] for score in scores))],
            "predicted": pool([score["predicted"] for score in scores])}
    row |= {what: sum(score[what] for score in scores) for what in ("wrong", "swapped", "ghosts", "unseen",
                                                                "sure", "sure_wrong", "seen_by_three")}
    scene = plays[0].scene
    row["right_least"] = RIGHT_LEAST_OF.get(scene["name"], gates["right"][scene["occluders"]])
    row["misses"] = find_misses(row, row["right_least"], gates)
    return row


def judge_all(plays, gates):
    rows = {}
    for play in plays:
        rows.setdefault(play.row, []).append(play)
    return [judge(key, rows[key], gates) for key in sorted(rows)]


def print_table(rows):
    print(f"{'scene':22} {'level':5} {'renderer':8} {'right %':>8} {'mean':>8} {'unnamed':>7} {'wrong':>5} {'swaps':>5} "
          f"{'ghosts':>6} {'unseen':>6} {'rms mm':>7}  {'NEES/3 by 2, 3, 4, 5+':23} {'in 95 % ellipsoids':23} {'predicted':>11}  {'worst seed, m/s':14}  verdict")
    for row in rows:
        nees, inside = ("".join(f"{b[what] * scale:5.{digits}f}{' ' if b['count'] >= BIN_LEAST else '?'}"
                                if b["count"] else "    - " for b in row["by_cameras"])
                        for what, scale, digits in (("nees_per_axis", 1, 2), ("ellipsoid_share", 100, 1)))
        filled = row["predicted"]
        judged = " " if filled["count"] >= BIN_LEAST else "?"
        predicted = (f"{filled['nees_per_axis']:5.2f} {100 * filled['ellipsoid_share']:5.1f}{judged}"
                     if filled["count"] else f"{'-':>11} ")
        print(f"{row['scene']:22} {row['level']:5} {row['optics']:8} {100 * row['right_share_worst']:8.3f} "
              f"{100 * row['right_share_mean']:8.3f} {100 * row['unnamed_share']:7.3f} {row['wrong']:5} "
              f"{row['swapped']:5} {row['ghosts']:6} {row['unseen']:6} {row['rms_mm']:7.4f} {nees} {inside} {predicted} "
              f"{row['worst_play']:14}  "
              f"{'FAILED: ' + ', '.join(row['misses']) if row['misses'] else 'passed'}")
    print(f"?: fewer than {BIN_LEAST} markers, not judged; -: none")


def print_failures(rows):
    for row in rows:
        if row["misses"]:
            print(f"{row['scene']}: {row['worst']}")


def choose_scenes(build, names):
    scenes = {scene["name"]: scene for scene in stagectl(build, "list", "--json")["scenes"] if scene["actors"]}
    unknown = [name for name in names if name not in scenes]
    if unknown:
        raise RuntimeError(f"no scene with actors has the name '{unknown[0]}': stagectl sim list names them")
    return [scenes[name] for name in names or scenes]


def parse(arguments):
    parser = argparse.ArgumentParser(prog="./stage scenes", description="Every scene through the tracker, scored "
                                     "against the truth. Ends with 1 when a scene misses a gate.")
    parser.add_argument("scenes", metavar="SCENE", nargs="*", help="only these; default: all with actors")
    parser.add_argument("--json", action="store_true", help="one object: rows, and which scenes pass")
    parser.add_argument("--short", action="store_true", help="a minute's worth at up to 0.4 m/s with wider gates, as in ./stage test")
    parser.add_argument("--seeds", type=int, metavar="N", help="plays at blob level per scene; default 5")
    parser.add_argument("--seed", type=int, metavar="N", help="of all plays; default: a fresh one, printed")
    options = parser.parse_args(arguments)
    if options.seeds is None:
        options.seeds = 1 if options.short else 5
    if options.seeds < 1:
        parser.error("--seeds: at least 1")
    if options.seed is None:
        options.seed = secrets.randbelow(SEED_MAX)
    return options


def main(build, arguments):
    options = parse(arguments)
    print(f"seed {options.seed}: --seed {options.seed} plays the same again", file=sys.stderr)
    try:
        plays = make_plays(choose_scenes(build, options.scenes), options)
        run_all(build, plays)
    except RuntimeError as error:
        print(f"stage scenes: {error}", file=sys.stderr)
        return 2
    rows = judge_all(plays, SHORT_GATES if options.short else GATES)
    failed = sorted({row["scene"] for row in rows if row["misses"]})
    count = len({row["scene"] for row in rows})
    if options.json:
        print(json.dumps({"seed": options.seed, "scenes": count, "scenes_passed": count - len(failed),
                          "failed": failed, "rows": rows}))
    else:
        print_table(rows)
        print_failures(rows)
        print(f"every scene: {count - len(failed)} of {count} passed, seed {options.seed}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
