"""Within control imports run one way: nmpc, browser -> solvers -> the problem -> codegen."""

import re
from pathlib import Path

import nmpcrl.control

ROOT = Path(nmpcrl.control.__file__).parent
FLOORS = (  # each may import from those before it, and from its own
    ("codegen", "vectors", "blocks", "expression"),
    ("problem", "plant", "task", "ocp", "sensitivity", "solution"),
    ("solvers",),
    ("nmpc", "browser"),
)
MODULES = [path for path in sorted(ROOT.rglob("*.py")) if path != ROOT / "__init__.py"]


def floor(name: str) -> int:
    """How high a module or a room of control stands."""
    return next(i for i, names in enumerate(FLOORS) if name in names)


def test_nothing_is_imported_from_above():
    for path in MODULES:
        own = path.relative_to(ROOT).with_suffix("").parts[0]
        text = path.read_text()
        assert not re.search(r"^from nmpcrl\.control import", text, flags=re.M), path
        rooms = re.findall(r"^from nmpcrl\.control\.(\w+)[\w.]* import", text, flags=re.M)
        assert all(floor(room) <= floor(own) for room in rooms), path
