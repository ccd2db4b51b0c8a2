"""A browser, and pages that the program writes."""

import os
import pathlib
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "python"))
from packages import package  # noqa: E402

FIELDS: dict[str, tuple[str, ...]] = {
    "torus": ("builtin:torus",),
    "box": ("builtin:box", "--strategy", "hp", "--coefficients", "double"),
    "gear": ("builtin:gear", "--target-error", "1e-4"),
}


@pytest.fixture(scope="session")
def program() -> Callable[..., str]:
    """Returns a function that runs the program with these words."""
    path = os.environ["HPSDF_PROGRAM"]
    return lambda *words: subprocess.run([path, *map(str, words)], capture_output=True, text=True, check=True).stdout


@pytest.fixture(scope="session", params=FIELDS)
def field(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, program: Callable[..., str]) -> pathlib.Path:
    """The file of a field, beside which stands its page."""
    file = tmp_path_factory.mktemp("fields") / f"{request.param}.hpsdf"
    program("build", *FIELDS[request.param], "-o", file)
    program("page", file, "-o", file.with_suffix(".html"))
    return file


def started(*arguments: str) -> Any:
    """Returns a headless browser with a window of 700 × 520, small because it draws by the CPU."""
    webdriver = package("selenium.webdriver")
    browser, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if not browser or not driver:
        pytest.skip("chromium and chromium-driver are not installed")
    options = webdriver.ChromeOptions()
    options.binary_location = browser
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--window-size=700,520", *arguments):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return webdriver.Chrome(service=webdriver.ChromeService(driver) if hasattr(webdriver, "ChromeService") else service(driver), options=options)


def service(driver: str) -> Any:
    return package("selenium.webdriver.chrome.service").Service(driver)


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    made = started()
    yield made
    made.quit()
