"""What an installed package needs besides its modules is in the wheel, and it works from there."""

import os
import re
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest
from driver.course import course

ROOT = Path(__file__).resolve().parents[1]
SCRIPT = """
import nmpcrl
from nmpcrl.study import lock, paper

assert lock.locked()
print(paper.nmpc().solve(paper.START, paper.THETA_INIT).solver, nmpcrl.__file__)
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """As a course hands it out."""
    name, content = course.wheel()
    path = tmp_path_factory.mktemp("wheel") / name
    path.write_bytes(content)
    return path


@pytest.mark.slow
def test_every_file_of_the_package_is_in_the_wheel(wheel):
    kept = (path for path in (ROOT / "nmpcrl").rglob("*") if path.suffix != ".pyc")
    files = {path.relative_to(ROOT).as_posix() for path in kept if path.is_file()}
    found = {name for name in zipfile.ZipFile(wheel).namelist() if name.startswith("nmpcrl/")}
    assert found == files
    assert {f"nmpcrl/{name}" for name in ("py.typed", "study/population.json")} < found
    assert "nmpcrl/control/solvers/kernel.py" in found  # its text is compiled for each plant


@pytest.mark.slow
def test_the_package_works_where_the_wheel_is_unpacked(wheel, tmp_path):
    zipfile.ZipFile(wheel).extractall(tmp_path)
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert done.stdout.split() == ["riccati", str(tmp_path / "nmpcrl/__init__.py")], done.stderr


@pytest.mark.slow
@pytest.mark.network
def test_readmes_example_runs_where_the_wheel_alone_is_installed(wheel, tmp_path):
    """With what it declares, at our versions: no book, no extra, nothing of this environment."""
    venv.create(tmp_path / "bare", with_pip=True)
    python = tmp_path / "bare/bin/python"
    pins = ROOT / "environment.txt"
    install = [python, "-m", "pip", "install", "-q", "--no-compile", "-c", pins, wheel]
    done = subprocess.run(install, capture_output=True, text=True)
    if "No matching distribution" in done.stderr and "NMPCRL_REQUIRE_REGISTRY" not in os.environ:
        pytest.skip(f"the registry cannot be reached: {done.stderr.splitlines()[-1]}")
    assert done.returncode == 0, done.stderr
    (example,) = re.findall(
        r"^```python\n(.*?)^```$", (ROOT / "README.md").read_text(), flags=re.M | re.S
    )
    done = subprocess.run(  # -I: without this folder, the user's packages and PYTHONPATH
        [python, "-I", "-c", example], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert "'margin'" in done.stdout
