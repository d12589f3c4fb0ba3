"""Runs the pytest cases of one file and tells their results as TAP, so that meson counts each.

TAP goes to standard output, all that pytest says to standard error.
"""
import os
import signal
import sys

import pytest


class Tap:
    def __init__(self, out):
        self.out = out
        self.count = 0

    def tell(self, line):
        print(line, file=self.out, flush=True)

    def pytest_collection_finish(self, session):
        self.tell(f"1..{len(session.items)}")

    def pytest_runtest_logreport(self, report):
        if report.passed and report.when != "call":
            return
        self.count += 1
        name = report.nodeid.split("::")[-1].removeprefix("test_")
        if report.skipped:
            self.tell(f"ok {self.count} - {name} # SKIP {report.longrepr[2]}")
        else:
            self.tell(f"{'ok' if report.passed else 'not ok'} {self.count} - {name}")


def main(path):
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup would have the tested programs ignore it, too
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    return pytest.main(["-q", "-p", "no:cacheprovider", path], plugins=[Tap(out)])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
