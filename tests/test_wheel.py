"""What an installed package needs besides its modules is in the wheel, and it works from there."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from driver.course import course

ROOT = Path(__file__).resolve().parents[1]
SCRIPT = """
import nmpcrl
from nmpcrl.study import paper, provenance

assert provenance.locked()
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
