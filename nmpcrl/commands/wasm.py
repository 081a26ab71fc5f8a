"""`nmpcrl wasm`: the controller of a plant, or of a problem, as a WebAssembly module."""

import importlib
import sys
from pathlib import Path
from typing import Any

import click

from nmpcrl.commands.options import NewFile

ROBOT = "nmpcrl.control:differential_drive"


@click.command()
@click.option(
    "--plant",
    "of_plant",
    default=ROBOT,
    metavar="MODULE:NAME",
    help="Of a Plant.",
    show_default=True,
)
@click.option("--task", "of_task", metavar="MODULE:NAME", help="Of a Task; by default the paper's.")
@click.option(
    "--problem", "of_problem", metavar="MODULE:NAME", help="Of a Problem, instead of both."
)
@click.option("--out", type=NewFile(), default="nmpc.wasm", show_default=True)
def wasm(of_plant: str, of_task: str | None, of_problem: str | None, out: Path) -> None:
    """Compile what solves and learns to WebAssembly.

    It holds the solver, the update rules and the network, and runs in any
    browser, in Node and in engines such as wasmtime; target, obstacles, horizon
    and discount are arguments of its functions; of a Problem, data and theta. It
    takes a minute or two, once. MODULE:NAME may be a function that returns it.

    \b
    Example:
      nmpcrl wasm --plant my_robot:plant --task my_robot:task --out robot.wasm
      nmpcrl wasm --problem my_reactor:problem --out reactor.wasm
    """
    from nmpcrl.study.limits import need_numba

    need_numba("its LLVM compiles to WebAssembly")

    from nmpcrl.control import Plant, Problem, Task
    from nmpcrl.control.codegen.source import CannotCompile
    from nmpcrl.learning import browser
    from nmpcrl.study import paper

    of: tuple[Any, ...]
    if of_problem is not None:
        if of_task is not None or of_plant != ROBOT:
            raise click.ClickException("a Problem has no Plant and no Task beside it")
        of = (named(of_problem, Problem),)
    else:
        plant = named(of_plant, Plant)
        task = paper.task() if of_task is None else named(of_task, Task)
        if task.start.size != plant.n:
            raise click.ClickException(
                f"the task has {task.start.size} states, the plant {plant.n}"
            )
        of = plant, task
    try:
        module = browser.module(*of)
    except (CannotCompile, RuntimeError) as error:
        raise click.ClickException(str(error)) from None
    out.write_bytes(module)
    name, size = click.format_filename(out), len(module) / 1000
    click.echo(f"{name}: {size:.0f} kB; its host gives it functions of JavaScript's Math.")


def named(name: str, kind: type) -> Any:
    """The object called MODULE:NAME, or what it returns; the working directory is searched, too.

    Raises:
        click.ClickException: there is none, or it is not of this kind.
    """
    module, _, attribute = name.partition(":")
    sys.path.insert(0, str(Path.cwd()))
    try:
        found = getattr(importlib.import_module(module), attribute)
        found = found() if callable(found) else found
    except (ImportError, AttributeError, TypeError, ValueError) as error:
        raise click.ClickException(
            f"{name!r} names no {kind.__name__}, as MODULE:NAME would: {error}"
        ) from None
    finally:
        sys.path.pop(0)
    if not isinstance(found, kind):
        raise click.ClickException(f"{name} is no {kind.__name__}")
    return found
