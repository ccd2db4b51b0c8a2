"""Runs the pytest cases of a file, or exits with status 77, for a skipped test, where a package is not installed."""

import sys

SKIPPED = 77


def main() -> int:
    try:
        import numpy
        import pytest
    except ImportError as error:
        print(f"skipped: python3-numpy or python3-pytest is not installed ({error})")
        return SKIPPED
    status = pytest.main(["-q", "-p", "no:cacheprovider", *sys.argv[1:]])
    return SKIPPED if status == pytest.ExitCode.NO_TESTS_COLLECTED else status  # what a file needs is not installed


if __name__ == "__main__":  # processes that the tests spawn import this file
    sys.exit(main())
