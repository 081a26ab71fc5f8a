"""What lies beside the notebooks of an edition: a README, and what is to be installed for them.

Whoever runs an edition needs the library, a kernel, papermill and JupyterLab, and neither the tests
nor what builds the book.
"""

import re
import tomllib
from importlib.metadata import PackageNotFoundError, requires
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from driver.project import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
BESIDE = ("ipykernel", "papermill")  # what an edition needs beside the library
CPU = "--extra-index-url https://download.pytorch.org/whl/cpu"  # torch without CUDA
HEAD = "# What the notebooks of this folder need; its README says how it is installed."

README = """\
# {title}

These notebooks come with all that they need: the library `{wheel}`, the published study and the
runs that would take long to train in `data`, and the list `requirements.txt`. Only the installation
needs a network. It takes about {gigabytes} GB and some minutes, once.

You need Python {pythons} (<https://www.python.org/downloads>; `python --version` says which you
have). Open a terminal *in this folder*, and type:

Windows (PowerShell):

    py -m venv .venv
    .venv\\Scripts\\pip install -r requirements.txt
    .venv\\Scripts\\jupyter lab

macOS and Linux:

    python3 -m venv .venv
    .venv/bin/pip install -r requirements.txt
    .venv/bin/jupyter lab

JupyterLab opens in the browser. Begin with `{first}`, and leave the folder `data` where it is.
{purpose}"""
PURPOSES = {  # title, and what is to be done with it
    "student": (
        "Reinforcement learning on nonlinear MPC: notebooks with exercises",
        "Put your answers where the dots are, and hand in the notebooks under their own names.\n",
    ),
    "instructor": (
        "Reinforcement learning on nonlinear MPC: notebooks for teachers",
        "These have the solutions: do not hand them out.\n",
    ),
    "grader": (
        "Reinforcement learning on nonlinear MPC: notebooks for graders",
        "These have the solutions: do not hand them out. `nmpcrl grade` reads this folder; for\n"
        "nbgrader it is a course with an assignment for each chapter.\n",
    ),
}
GIGABYTES = 1.3  # of all that is installed, measured on Linux


def requirements(library: str) -> str:
    """A list for `pip install -r`: this edition's library, and the versions of environment.txt.

    Args:
        library: the file of the library, beside the list.
    """
    extras = PROJECT["optional-dependencies"]
    needed = _brought({*PROJECT["dependencies"], *extras["torch"], *extras["study"], *BESIDE})
    pinned = pins(ROOT / "environment.txt").items()  # with a marker: on some machines only
    lines = [line for name, line in pinned if name in needed or ";" in line]
    lab = pins(ROOT / "book/lab.txt")["jupyterlab"]
    return "\n".join([HEAD, CPU, *lines, lab, f"./{library}", ""])


def readme(edition: str, library: str, first: str) -> str:
    """How an edition is installed on three systems, and what it is for.

    Args:
        edition: its name, one of `PURPOSES`.
        library: the file of the library.
        first: the file of its first notebook.
    """
    title, purpose = PURPOSES[edition]
    low, high = re.findall(r"\d+\.(\d+)", PROJECT["requires-python"])
    return README.format(
        title=title,
        purpose=purpose,
        wheel=library,
        first=first,
        gigabytes=GIGABYTES,
        pythons=f"3.{low} to 3.{int(high) - 1}",
    )


def pins(path: Path) -> dict[str, str]:
    """The lines of a list of requirements, by name."""
    lines = [line for line in path.read_text("utf-8").splitlines() if line and line[0] != "#"]
    return {canonicalize_name(Requirement(line).name): line for line in lines}


def _brought(names: set[str]) -> set[str]:
    """Packages, and those that they bring on any system."""
    found: set[str] = set()
    waiting: set[str] = {canonicalize_name(name) for name in names}
    while waiting:
        found |= waiting
        waiting = {one for name in waiting for one in _required(name)} - found
    return found


def _required(name: str) -> set[str]:
    """What a package asks for without extras; nothing of one that is only for another system."""
    try:
        listed = [Requirement(line) for line in requires(name) or ()]
    except PackageNotFoundError:
        return set()
    return {canonicalize_name(one.name) for one in listed if "extra" not in str(one.marker or "")}
