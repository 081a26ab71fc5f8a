"""Make the locks anew: `make locks`.

uv resolves environment.txt for each Python, on Linux and x86-64, whichever Python runs this, and
names the very wheels that fit; pip would judge the markers by the Python that runs it.
"""

import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path

UV = "uv==0.13.9"
COMPILE = """pip compile --quiet --no-config --format pylock.toml environment.txt
    --only-binary :all: --python-platform x86_64-manylinux_2_28 --python-version"""
HERE = Path(__file__).resolve().parent


def resolve(uv: Path, python: str) -> list[dict]:
    """What environment.txt comes to on this Python: packages as PEP 751 has them."""
    lock = subprocess.check_output([uv, *COMPILE.split(), python], cwd=HERE.parent, text=True)
    return tomllib.loads(lock)["packages"]


def requirement(package: dict) -> str:
    """A package, its version and the hashes of its wheels, as pip reads them."""
    hashes = sorted(f"--hash=sha256:{wheel['hashes']['sha256']}" for wheel in package["wheels"])
    return " \\\n    ".join((f"{package['name']}=={package['version']}", *hashes))


def main(pythons: list[str]) -> None:
    """Write one lock for each Python."""
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True)
        subprocess.check_call([f"{folder}/bin/pip", "install", "--quiet", UV])
        for python in pythons:
            packages = resolve(Path(folder, "bin/uv"), python)
            head = f"# By `make locks` from environment.txt, for Python {python} on Linux, x86-64."
            lines = [head, *map(requirement, packages), ""]
            (HERE / f"python{python}.txt").write_text("\n".join(lines))
            print(f"locks/python{python}.txt: {len(packages)} packages")


if __name__ == "__main__":
    main(sys.argv[1:])
