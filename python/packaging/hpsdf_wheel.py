"""Builds the wheel of the Python module by CMake: a build backend (PEP 517) of the standard library alone, because Debian has
no backend for CMake, and pip finds none in a clone without a network.

Meshes and pictures come with the wheel; level sets of OpenVDB and simulations by Bullet do not, so that it needs fewer
libraries on the machine that imports it.
"""

import base64
import hashlib
import os
import pathlib
import re
import subprocess
import sys
import sysconfig
import tomllib
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / "out" / "wheel"

OPTIONS = {
    "CMAKE_BUILD_TYPE": "Release",
    "CMAKE_UNITY_BUILD": "ON",
    "HPSDF_BUILD_PYTHON": "ON",
    "HPSDF_BUILD_TESTS": "OFF",
    "HPSDF_BUILD_C": "OFF",
    "HPSDF_BUILD_OPENVDB": "OFF",
    "HPSDF_BUILD_PHYSICS": "OFF",
    "HPSDF_WINDOW": "OFF",
}


def get_requires_for_build_wheel(config_settings=None):
    return []


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Builds the wheel into a folder and returns its name."""
    project, version = _project(), _version()
    tag = f"cp{sys.version_info.major}{sys.version_info.minor}"
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    name = f"{project['name']}-{version}-{tag}-{tag}-{platform}.whl"
    package = _built_package()
    info = f"{project['name']}-{version}.dist-info"
    files = {f"hpsdf/{file.name}": file.read_bytes() for file in sorted(package.iterdir()) if file.is_file()}
    files[f"{info}/METADATA"] = _metadata(project, version).encode()
    files[f"{info}/LICENSE"] = (ROOT / "LICENSE").read_bytes()
    files[f"{info}/WHEEL"] = (
        f"Wheel-Version: 1.0\nGenerator: hpsdf_wheel\nRoot-Is-Purelib: false\nTag: {tag}-{tag}-{platform}\n".encode()
    )
    record = f"{info}/RECORD"
    files[record] = ("".join(_record_line(path, content) for path, content in files.items()) + f"{record},,\n").encode()
    with zipfile.ZipFile(pathlib.Path(wheel_directory) / name, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, content in files.items():
            member = zipfile.ZipInfo(path)  # with a fixed date, so that the same files make the same wheel
            member.compress_type = zipfile.ZIP_DEFLATED
            member.external_attr = 0o644 << 16
            archive.writestr(member, content)
    return name


def build_sdist(sdist_directory, config_settings=None):
    raise NotImplementedError("a clone of the repository is the source; build a wheel from it")


def _project():
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def _version():
    found = re.search(r"^project\(hpsdf VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8"), re.MULTILINE)
    return found.group(1)


def _built_package():
    """Builds the module for this interpreter. Returns the folder of the package."""
    options = {**OPTIONS, "HPSDF_PYTHON": sys.executable}
    configure = ["cmake", "-S", str(ROOT), "-B", str(BUILD), "-G", "Ninja"]
    subprocess.run(configure + [f"-D{name}={value}" for name, value in options.items()], check=True)
    jobs = str(os.cpu_count() or 1)
    subprocess.run(["cmake", "--build", str(BUILD), "--target", "hpsdf_python", "-j", jobs], check=True)
    package = BUILD / "python" / "hpsdf"
    if not list(package.glob("_hpsdf*.so")):
        raise SystemExit("hpsdf_wheel: CMake built no module; tools/setup --optional installs what is missing")
    return package


def _metadata(project, version):
    lines = [
        "Metadata-Version: 2.1",
        f"Name: {project['name']}",
        f"Version: {version}",
        f"Summary: {project['description']}",
        f"Requires-Python: {project['requires-python']}",
        *(f"Requires-Dist: {name}" for name in project["dependencies"]),
        "Description-Content-Type: text/markdown",
    ]
    return "\n".join(lines) + "\n\n" + (ROOT / project["readme"]).read_text(encoding="utf-8")


def _record_line(path, content):
    digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
    return f"{path},sha256={digest},{len(content)}\n"
