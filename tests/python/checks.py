"""Checks of a test: each is printed, `finish` prints how many passed and ends the test."""
import pathlib
import sys
import tempfile

passed = failed = 0


def check(name, condition, detail=""):
    global passed, failed
    passed, failed = passed + bool(condition), failed + (not condition)
    print(("ok      " if condition else "FAILED  ") + name + ("" if condition else f"  [{detail}]"), flush=True)


def finish():
    print(f"{passed} passed, {failed} failed")
    sys.exit(failed > 0 or passed == 0)


def run_tests(*tests):
    """Runs each in one folder, which is gone afterwards; one that raises has failed."""
    with tempfile.TemporaryDirectory() as name:
        for test in tests:
            try:
                test(pathlib.Path(name))
            except Exception as error:
                check(f"{test.__name__}: ran to its end", False, repr(error))
    finish()
