"""Modules as Git has them at the commit that registered an investigation."""

import importlib.abc
import importlib.util
import sys
from types import ModuleType

from fixed_questions import git

from nmpcrl.studies.agents import SAC_AND_TD3
from nmpcrl.studies.other_problems import OTHER_PROBLEMS
from nmpcrl.studies.remedies import REMEDIES
from nmpcrl.studies.worlds import WORLDS

INVESTIGATIONS = (SAC_AND_TD3, OTHER_PROBLEMS, REMEDIES, WORLDS)


class _AtCommit(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Finds modules of the library that today's library does not have."""

    def __init__(self, commit: str) -> None:
        self.commit = commit

    def find_spec(self, name, path=None, target=None):
        if name.startswith("nmpcrl.") and git("ls-tree", self.commit, "--", self._file(name)):
            return importlib.util.spec_from_loader(name, self)
        return None

    def exec_module(self, module: ModuleType) -> None:
        text = git("show", f"{self.commit}:{self._file(module.__name__)}")
        exec(compile(text, module.__name__, "exec"), vars(module))

    @staticmethod
    def _file(name: str) -> str:
        return f"{name.replace('.', '/')}.py"


def module(commit: str, name: str) -> ModuleType:
    """A module of a commit; what it imports is today's, where today's library has it."""
    finder, known = _AtCommit(commit), {*sys.modules}
    module = importlib.util.module_from_spec(finder.find_spec(name))
    sys.meta_path.append(finder)
    try:
        sys.modules[name] = module  # dataclasses look their module up
        finder.exec_module(module)
    finally:
        sys.meta_path.remove(finder)
        for added in {*sys.modules} - known:
            if isinstance(getattr(sys.modules[added], "__loader__", None), _AtCommit):
                del sys.modules[added]
    return module
