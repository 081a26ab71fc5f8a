"""`nmpcrl wasm`: the controller of a plant, or of a problem, as a WebAssembly module."""

import json
import sys
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import click

from nmpcrl.commands.options import new_file

ROBOT = "nmpcrl.control:differential_drive"


@click.command()
@click.option("--plant", default=ROBOT, metavar="MODULE:NAME", help="Of a Plant.")
@click.option("--task", metavar="MODULE:NAME", help="Of a Task; by default the paper's.")
@click.option("--problem", metavar="MODULE:NAME", help="Of a Problem, instead of both.")
@click.option("--out", metavar="FILE", type=new_file, default="nmpc.wasm")
def wasm(plant: str, task: str | None, problem: str | None, out: Path) -> None:
    """Compile the solver and the learners to WebAssembly.

    The module has the solver, the update rules and the network, and runs in any
    browser, in Node and in engines such as wasmtime. The problem is an argument
    of its functions: a file beside it, with .json for .wasm, has its numbers as
    one array, its sizes, and where theta starts. Compilation takes a minute or two, once.
    MODULE:NAME may be a function that returns a Plant, a Task or a Problem.

    \b
    Example:
      nmpcrl wasm --plant my_robot:plant --task my_robot:task --out robot.wasm
      nmpcrl wasm --problem my_reactor:problem --out reactor.wasm
    """
    from nmpcrl.control import Nmpc, Plant, Problem, Task
    from nmpcrl.control import browser as alone
    from nmpcrl.control.codegen.source import CannotCompile
    from nmpcrl.learning import browser
    from nmpcrl.study import paper

    if problem is not None:
        if task is not None or plant != ROBOT:
            raise click.ClickException("a Problem has no Plant and no Task beside it")
        of = [_named(problem, Problem)]
    else:
        of = [_named(plant, Plant), paper.task() if task is None else _named(task, Task)]
        states, start = of[0].n, of[1].start.size
        if start != states:
            raise click.ClickException(f"the task has {start} states, the plant {states}")
    try:
        solved, module = Nmpc(*of).problem, browser.module(*of)
        described = alone.problem(solved)
    except (CannotCompile, RuntimeError) as error:
        raise click.ClickException(str(error)) from None
    out.write_bytes(module)
    described |= {"numbers": alone.packed(described).tolist(), "start": solved.theta.tolist()}
    out.with_suffix(".json").write_text(json.dumps(described))
    name, size = click.format_filename(out), len(module) / 1000
    click.echo(f"{name}: {size:.0f} kB; its host gives it functions of JavaScript's Math.")


def _named(name: str, kind: type) -> Any:
    """The object MODULE:NAME, or its value if it is a function; searches the working directory."""
    sys.path.insert(0, str(Path.cwd()))
    try:
        found = resolve_name(name)
        found = found() if callable(found) else found
    except (ImportError, AttributeError, TypeError, ValueError) as error:
        said = f"{name!r} names no {kind.__name__}, as MODULE:NAME would: {error}"
        raise click.ClickException(said) from None
    finally:
        sys.path.pop(0)
    if not isinstance(found, kind):
        raise click.ClickException(f"{name} is no {kind.__name__}")
    return found
