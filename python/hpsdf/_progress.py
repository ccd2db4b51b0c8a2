"""The progress bar of `progress=True`."""

import sys


class Bar:
    """Shows a task and its fraction on standard error: by tqdm where it is installed, else as one line that changes."""

    def __init__(self) -> None:
        try:
            from tqdm.auto import tqdm  # type: ignore[import]

            self._tqdm = tqdm(total=100, unit="%", leave=False)
        except ImportError:
            self._tqdm = None

    def __call__(self, task: str, fraction: float) -> None:
        percent = round(100 * fraction)
        if self._tqdm is None:
            sys.stderr.write(f"\r{task}: {percent} %\x1b[K")
            sys.stderr.flush()
            return
        self._tqdm.set_description(task, refresh=False)
        self._tqdm.n = percent
        self._tqdm.refresh()

    def close(self) -> None:
        if self._tqdm is None:
            sys.stderr.write("\r\x1b[K")
        else:
            self._tqdm.close()
