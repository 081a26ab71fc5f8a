"""Help fits a terminal of 80 columns and shows an example that is accepted."""

import re
import shlex
from importlib.util import find_spec
from pathlib import Path

import pytest
from click.testing import CliRunner

import nmpcrl
from nmpcrl.commands import main

ROOT = Path(nmpcrl.__file__).parent
EXAMPLES = [
    (name, line)
    for name, one in main.commands.items()
    for line in re.findall(
        r"^ *(nmpcrl [^|\n]*?)(?: >.*)?$", one.help.partition("Example:")[2], re.M
    )
]

each_command = pytest.mark.parametrize("name", ["", *main.commands])


def shown(*words: str) -> str:
    asked = CliRunner().invoke(main, [*words, "--help"])
    assert asked.exit_code == 0, asked.output
    return asked.output


@each_command
def test_help_fits_80_columns_and_has_an_example(name):
    text = shown(*filter(None, [name]))
    assert [line for line in text.splitlines() if len(line) > 80] == []
    assert text.count("Example:") == 1


@each_command
def test_a_summary_in_the_list_of_commands_is_a_whole_sentence(name):
    if name:
        (line,) = re.findall(rf"^  {name} +(.*(?:\n   +.*)*)$", shown(), re.M)
        assert line.endswith(".")
        assert not line.endswith("...")


@pytest.mark.parametrize(("name", "line"), EXAMPLES)
def test_the_examples_are_accepted(name, line, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    _, command, *words = shlex.split(line)
    assert command == name
    with main.make_context("nmpcrl", [command, *words]) as context:
        main.commands[name].make_context(name, words, context)


def test_there_is_a_module_for_each_command():
    for name in main.commands:
        assert find_spec(f"nmpcrl.commands.{name}")
