"""What an installed package needs besides its modules is in the wheel, and it works from there."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SCRIPT = """
import nmpcrl
from nmpcrl.study import paper, provenance

assert provenance.locked()
print(paper.nmpc().solve(paper.START, paper.THETA_INIT).solver, nmpcrl.__file__)
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """Built from a copy, without a network."""
    place = tmp_path_factory.mktemp("wheel")
    source = place / "source"
    source.mkdir()
    shutil.copytree(ROOT / "nmpcrl", source / "nmpcrl", ignore=shutil.ignore_patterns("*.pyc"))
    for name in ("pyproject.toml", "LICENSE"):
        shutil.copy2(ROOT / name, source / name)
    options = ("--no-deps", "--no-build-isolation", "--no-index", "--wheel-dir", str(place))
    command = (sys.executable, "-m", "pip", "wheel", "--quiet", *options, str(source))
    subprocess.run(command, check=True)
    (built,) = place.glob("*.whl")
    return built


@pytest.mark.slow
def test_every_file_of_the_package_is_in_the_wheel(wheel):
    kept = (path for path in (ROOT / "nmpcrl").rglob("*") if path.suffix != ".pyc")
    files = {path.relative_to(ROOT).as_posix() for path in kept if path.is_file()}
    found = {name for name in zipfile.ZipFile(wheel).namelist() if name.startswith("nmpcrl/")}
    assert found == files
    assert {"nmpcrl/py.typed", "nmpcrl/study/sources.lock.json"} < found
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
