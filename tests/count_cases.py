#!/usr/bin/python3
"""Counts test cases of the last `meson test`: count_cases.py BUILD/meson-logs

A program that reports cases (TAP) counts by its cases, any other as one. A program that failed in
no case of its own (it crashed, hung, or told fewer cases than it planned) is one more failure. meson
takes one that told no case for skipped: it is, when it says why, and else a failure.
"""
import json
import pathlib
import re
import sys
import xml.etree.ElementTree as ElementTree

PASSED, FAILED, SKIPPED = range(3)
SKIP_REASON = re.compile(r"^1\.\.0 # SKIP (\S.*)$", re.M)
RESULTS = {"OK": PASSED, "EXPECTEDFAIL": PASSED, "SKIP": SKIPPED}  # all others are failures


def case_result(case):
    if case.find("failure") is not None or case.find("error") is not None:
        return FAILED
    return PASSED if case.find("skipped") is None else SKIPPED


def read_suites(path):
    """Results of cases by program; meson names a suite PROJECT.PROGRAM when the program tells cases."""
    suites = ElementTree.parse(path).getroot().iter("testsuite")
    return {suite.get("name").partition(".")[2]: [case_result(c) for c in suite.iter("testcase")]
            for suite in suites}


def say(program, words):
    print(f"{program['name']}: {words}", file=sys.stderr)


def result_without_cases(program, result):
    if result != SKIPPED:
        return result
    reason = SKIP_REASON.search(program.get("stdout", ""))
    say(program, f"skipped: {reason[1]}" if reason else "told no case, nor why it was skipped")
    return SKIPPED if reason else FAILED


def program_results(program, suites):
    result = RESULTS.get(program["result"], FAILED)
    cases = suites.get(program["name"])
    if not cases:
        return [result_without_cases(program, result)]
    if result == FAILED and FAILED not in cases:
        say(program, program["result"].lower())
        return cases + [FAILED]
    return cases


def count_all(logs):
    suites = read_suites(logs / "testlog.junit.xml")
    results = []
    with open(logs / "testlog.json", encoding="utf-8") as lines:
        for line in lines:
            results += program_results(json.loads(line), suites)
    return [results.count(kind) for kind in (PASSED, FAILED, SKIPPED)]


def main(logs):
    try:
        passed, failed, skipped = count_all(logs)
    except FileNotFoundError:
        print("no tests were run; ./stage test --list tells which there are")
        passed = failed = skipped = 0
    print(f"{passed} passed, {failed} failed, {skipped} skipped")
    return 0 if passed and not failed else 1


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
