"""What an installed package needs besides its modules is in the wheel, and it works from there."""

import os
import re
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
IGNORED = shutil.ignore_patterns("__pycache__")
OFFLINE = ("--no-deps", "--no-build-isolation", "--no-index", "--quiet")
SCRIPT = """
import nmpcrl
from nmpcrl.study import lock, paper

assert lock.locked()
print(paper.nmpc().solve(paper.START, paper.THETA_INIT).solver, nmpcrl.__file__)
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """Built from a copy of the sources, without a network."""
    folder = tmp_path_factory.mktemp("wheel")
    shutil.copytree(ROOT / "nmpcrl", folder / "source/nmpcrl", ignore=IGNORED)
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy2(ROOT / name, folder / "source")
    command = [sys.executable, "-m", "pip", "wheel", *OFFLINE, "-w", folder, folder / "source"]
    subprocess.run(command, check=True)
    (made,) = folder.glob("*.whl")
    return made


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


EXAMPLE = re.findall(r"^```python\n(.*?)^```$", (ROOT / "README.md").read_text(), re.M | re.S)[0]
OF_EXTRA = {  # what runs with each
    "": EXAMPLE + EXAMPLE.replace("Nmpc(problem)", 'Nmpc(problem, solver="ipopt")'),
    "[gymnasium]": EXAMPLE + """
from nmpcrl.learning import as_gymnasium
env = as_gymnasium(Nmpc(problem), plant=problem.plant(), start=[0.0])
result.policy.predict(env.reset(seed=0)[0])
""",
    "[torch]": EXAMPLE + """
import torch
from nmpcrl.torch import Layer
theta = torch.tensor(result.vector, requires_grad=True)
Layer(Nmpc(problem))([[0.5]], theta)[0].sum().backward()
(slope,) = Nmpc(problem, solver="ipopt").solve([0.5], result.vector).features
assert abs(theta.grad.item() - slope) < 1e-6
""",
    "[study]": """
from nmpcrl.__main__ import main
import sys
sys.argv[1:] = "train --learner RDES --episodes 1 --steps 3".split()
main()
""",
    "[book]": "import ipykernel, papermill\nfrom nmpcrl.report.figures import trials",
}  # fmt: skip
BARE = 750  # MB that an installation without extras may take, of which CasADi and LLVM are 450


@pytest.mark.weekly
@pytest.mark.network
@pytest.mark.parametrize("extra", OF_EXTRA)
def test_each_extra_brings_what_its_part_needs(extra, wheel, tmp_path):
    """With what the wheel declares, at our versions, and nothing of this environment."""
    venv.create(tmp_path / "bare", with_pip=True)
    python = tmp_path / "bare/bin/python"
    before = _megabytes(tmp_path / "bare")
    pins = ROOT / "environment.txt"
    install = [python, "-m", "pip", "install", "-q", "--no-compile", "-c", pins, f"{wheel}{extra}"]
    done = subprocess.run(install, capture_output=True, text=True)
    if "No matching distribution" in done.stderr and "NMPCRL_REQUIRE_REGISTRY" not in os.environ:
        pytest.skip(f"the registry cannot be reached: {done.stderr.splitlines()[-1]}")
    assert done.returncode == 0, done.stderr
    taken = _megabytes(tmp_path / "bare") - before
    assert extra or taken < BARE
    done = subprocess.run(  # -I: without this folder, the user's packages and PYTHONPATH
        [python, "-I", "-c", OF_EXTRA[extra]],
        cwd=tmp_path,
        env=os.environ | {"NMPCRL_RUNS": str(tmp_path / "runs")},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_the_command_says_which_extra_brings_it():
    script = "import sys; sys.modules['click'] = None; from nmpcrl.__main__ import main; main()"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 1
    assert "pip install 'nmpcrl[study]' brings the command" in done.stderr


def _megabytes(folder: Path) -> float:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6
