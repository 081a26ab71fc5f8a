"""A file of its own beside the published study, to which parts are added and none is changed."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nmpcrl.claims.published import Damaged, place
from nmpcrl.study import sealed
from nmpcrl.study.files import write_json
from nmpcrl.study.provenance import made_here


@dataclass(frozen=True)
class Extendable:
    """A file that is sealed each time, so that a change by hand is noticed."""

    name: str  # of the file
    what: str  # it holds, in words
    command: str  # that makes it

    @property
    def path(self) -> Path:
        """Where it is."""
        return place() / self.name

    def begun(self, **empty: Any) -> dict[str, Any]:
        """What is there, or what it begins with.

        Raises:
            Damaged: as `content`.
        """
        return self.content(self.path) if self.path.exists() else {**empty, "about": []}

    def content(self, path: Path) -> dict[str, Any]:
        """What is there.

        Raises:
            Damaged: it is not there, or not what was written.
        """
        try:
            return sealed.content_of(path)
        except sealed.DAMAGE as error:
            raise self.damaged(path, error) from error

    def write(self, content: Mapping[str, Any]) -> Path:
        """Write it, with where and by what it was made put beside what says that of the rest."""
        plain = {name: one for name, one in content.items() if name != "seal"}
        plain["about"] = [*content["about"], made_here()]
        self.path.parent.mkdir(parents=True, exist_ok=True)
        write_json(self.path, plain | {"seal": sealed.seal_of(plain)})
        return self.path

    def damaged(self, path: Path, error: Exception) -> Damaged:
        """What is said of it where it is not what it should be."""
        return Damaged(
            f"{self.what} is not published whole in {path} ({error});"
            f" `{self.command}` makes it anew"
        )
