#!/usr/bin/env python3
"""Runs the API tests against a built server.

    tests/api/run.py BINARY [PATTERN...]     BINARY: build/release/tessera
    tests/api/run.py --binary BINARY [--tests FOLDER] [--jobs N] [...]

PATTERN selects tests whose name contains it; FOLDER holds other tests that use this folder's
harness. N classes run at a time (4: tests mostly wait), each in a separate process. The last line
has the counts; exit code 0 only if none failed.
"""

import argparse
import concurrent.futures
import io
import os
import sys
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))


class Report(unittest.TextTestResult):
    """One line per test, with its seconds."""

    def startTest(self, test):
        self.began = time.monotonic()
        self.good = getattr(self, "good", 0)
        super(unittest.TextTestResult, self).startTest(test)

    def line(self, word, test):
        self.stream.writeln(f"{word:5} {time.monotonic() - self.began:6.2f} s  {test.id()}")
        self.stream.flush()

    def addSuccess(self, test):
        super(unittest.TextTestResult, self).addSuccess(test)
        self.good += 1
        self.line("ok", test)

    def addError(self, test, err):
        super(unittest.TextTestResult, self).addError(test, err)
        self.stream.writeln(f"ERROR          {test.id()}")

    def addFailure(self, test, err):
        super(unittest.TextTestResult, self).addFailure(test, err)
        self.line("FAIL", test)

    def addSkip(self, test, reason):
        super(unittest.TextTestResult, self).addSkip(test, reason)
        self.stream.writeln(f"skip           {test.id()}: {reason}")


def chosen(suite, patterns):
    for test in suite:
        if isinstance(test, unittest.TestSuite):
            yield from chosen(test, patterns)
        elif not patterns or any(p in test.id() for p in patterns):
            yield test


def run_class(tests):
    """Output and counts of the tests of a class."""
    stream = io.StringIO()
    result = Report(unittest.runner._WritelnDecorator(stream), True, 0)
    unittest.TestSuite(tests).run(result)
    result.printErrors()
    failed = len(result.failures) + len(result.errors) + len(result.unexpectedSuccesses)
    return stream.getvalue(), getattr(result, "good", 0), failed


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary")
    parser.add_argument("--tests", default=HERE)
    parser.add_argument("--jobs", type=int, default=4)
    parser.add_argument("rest", nargs="*")
    options = parser.parse_args()
    binary = options.binary or (options.rest.pop(0) if options.rest else "build/release/tessera")
    os.environ["TESSERA_BINARY"] = os.path.abspath(binary)
    sys.path.insert(0, HERE)
    found = unittest.defaultTestLoader.discover(
        options.tests, pattern="*_test.py", top_level_dir=options.tests)
    classes = {}
    for test in chosen(found, options.rest):
        classes.setdefault(type(test), []).append(test)
    passed = failed = 0
    with concurrent.futures.ProcessPoolExecutor(options.jobs) as pool:
        # Starts with the last name: the farm tests wait longest, and would otherwise be the only
        # ones left.
        running = [pool.submit(run_class, tests) for tests in reversed(classes.values())]
        for done in concurrent.futures.as_completed(running):
            said, good, bad = done.result()
            print(said, end="", flush=True)
            passed, failed = passed + good, failed + bad
    print(f"{passed} passed, {failed} failed", flush=True)
    return 0 if failed == 0 and passed > 0 else 1


if __name__ == "__main__":
    sys.exit(main())
