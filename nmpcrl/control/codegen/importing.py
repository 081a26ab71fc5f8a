"""A package of modules that is no part of an installation: from its folder, or from its texts."""

import importlib
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.abc import InspectLoader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import module_from_spec, spec_from_file_location, spec_from_loader
from pathlib import Path
from types import ModuleType


def from_folder(package: str, place: Path) -> ModuleType:
    """The package whose modules are files in `place`."""
    spec = spec_from_file_location(
        package, place / "__init__.py", submodule_search_locations=[str(place)]
    )
    if spec is None or spec.loader is None:
        raise ImportError(f"{place} is no package")
    with _whole_or_not_at_all(package):
        module = sys.modules[package] = module_from_spec(spec)
        spec.loader.exec_module(module)
    return module


def from_memory(package: str, texts: Mapping[str, str]) -> ModuleType:
    """The package whose modules have these texts, by name; without any file."""
    finder = _Texts(package, texts)
    sys.meta_path.insert(0, finder)
    try:
        with _whole_or_not_at_all(package):
            return importlib.import_module(package)
    finally:
        sys.meta_path.remove(finder)


class _Texts(InspectLoader, MetaPathFinder):
    """Finds a package's modules in their texts."""

    def __init__(self, package: str, texts: Mapping[str, str]) -> None:
        self._package = package
        self._texts = {
            f"{package}.{module}".removesuffix(".__init__"): text for module, text in texts.items()
        }

    def find_spec(self, fullname: str, *_: object) -> ModuleSpec | None:
        return spec_from_loader(fullname, self) if fullname in self._texts else None

    def get_source(self, fullname: str) -> str:
        return self._texts[fullname]

    def is_package(self, fullname: str) -> bool:
        return fullname == self._package


@contextmanager
def _whole_or_not_at_all(package: str) -> Iterator[None]:
    """Forget the modules of a package whose import fails."""
    try:
        yield
    except BaseException:
        for name in [name for name in sys.modules if name.split(".")[0] == package]:
            del sys.modules[name]
        raise
