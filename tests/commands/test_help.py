"""Help fits a terminal of 80 columns, needs ASCII alone, and has examples that are accepted."""

import re
import shlex

import pytest
from click.testing import CliRunner

from nmpcrl.commands import main

EXAMPLE = re.compile(r"^ *(nmpcrl [^|\n]*?)(?: >.*)?$", re.M)


@pytest.mark.parametrize("name", ["", *main.commands])
def test_help(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "handed-in").mkdir()  # which `grade` must find
    text = CliRunner().invoke(main, [*filter(None, [name]), "--help"]).output
    assert max(map(len, text.splitlines())) <= 80
    assert text.isascii()
    examples = EXAMPLE.findall(text.partition("Example:")[2])
    assert examples
    for _, command, *words in map(shlex.split, examples):
        assert command == name or not name
        with main.make_context("nmpcrl", [command, *words]) as context:
            main.commands[command].make_context(command, words, context)
