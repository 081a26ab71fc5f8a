"""Every chapter reads well in JupyterLab as it comes: as a source, and as the build executed it."""

import json
import os
import re
import shutil
import socket
import subprocess
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from time import sleep
from typing import Any

import nbformat
import pytest
from driver import project
from live_page import CHAPTERS, FRAMES

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOKS = list(project.notebooks())
SETTINGS = {  # all cells at once, and no request to another host; the rest is as it comes
    "notebook-extension/tracker": {"windowingMode": "none"},
    "apputils-extension/notification": {"fetchNews": "false", "checkForUpdates": False},
}
SHOWN = ".jp-MarkdownOutput, .jp-OutputArea-output"
# What is read as text: neither code nor what MathJax has set.
READ = """node => {
  const copy = node.cloneNode(true)
  copy.querySelectorAll("pre, code, style, script, mjx-container").forEach(one => one.remove())
  return copy.textContent
}"""
RAW = {  # in text
    "a role": r"\{[\w:.-]+\}|\b(glue|cite|numref):",
    "a directive": r":::|```",
    "a label": r"\([a-z]+:[\w-]+\)=?",
    "a formula": r"\$|\\[a-zA-Z]+",
    "an error": r"Undefined control sequence|Math input error",
    "a tag": r"</?[a-z]+[ >]",
}
UNREAD = {  # by selector
    "a directive": "code[class*='{']",
    "a formula": "mjx-merror, [data-mjx-error]",
    "a macro": "mjx-container mtext[mathcolor=red]",
}

each_notebook = pytest.mark.parametrize("name", NOTEBOOKS)
each_state = pytest.mark.parametrize("state", ["source", "executed"])


@pytest.fixture(scope="module")
def folder(tmp_path_factory, site) -> Path:
    """The sources, and what the build executed."""
    place = tmp_path_factory.mktemp("lab")
    for state, begin in (("source", ROOT / "book"), ("executed", site.parent / "executed")):
        (place / state).mkdir()
        for path in project.notebooks().values():
            shutil.copy2(begin / path.name, place / state)
    return place


@pytest.fixture(scope="module")
def address(folder, jupyter_lab) -> Iterator[str]:
    """A JupyterLab without extensions, settings or kernels of anybody's."""
    for name, settings in SETTINGS.items():
        file = folder / f"settings/@jupyterlab/{name}.jupyterlab-settings"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(settings))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    names = ("CONFIG_DIR", "DATA_DIR", "RUNTIME_DIR")
    own = {f"JUPYTER_{name}": str(folder / name.lower()) for name in names}
    own |= {"JUPYTERLAB_SETTINGS_DIR": str(folder / "settings"), "IPYTHONDIR": str(folder / "i")}
    own |= {"JUPYTERLAB_WORKSPACES_DIR": str(folder / "workspaces")}
    options = ["--no-browser", "--allow-root", "--IdentityProvider.token=", f"--port={port}"]
    options += [f"--ServerApp.root_dir={folder}", "--KernelSpecManager.allowed_kernelspecs=none"]
    options += ["--KernelSpecManager.ensure_native_kernel=False", "--ServerApp.port_retries=0"]
    with (folder / "lab.log").open("w") as log:
        server = subprocess.Popen(
            [jupyter_lab, "lab", *options], env=os.environ | own, stdout=log, stderr=log
        )
    try:
        await_answer(f"http://127.0.0.1:{port}/api", server)
        yield f"http://127.0.0.1:{port}/doc/tree"
    finally:
        server.terminate()
        server.wait()


def await_answer(address: str, server: subprocess.Popen) -> None:
    while server.poll() is None:
        try:
            urllib.request.urlopen(address).close()
        except OSError:
            sleep(0.2)
        else:
            return
    pytest.fail(f"JupyterLab ended with {server.returncode}")


@pytest.fixture
def opened(address, folder, browser) -> Iterator[Any]:
    """Opens a notebook, and waits for every cell, picture and formula."""
    tab = browser.new_page(viewport={"width": 1200, "height": 1000})

    def open_notebook(state: str, name: str) -> Any:
        cells = nbformat.read(folder / state / f"{name}.ipynb", 4).cells
        prose = sum(cell.cell_type == "markdown" for cell in cells)
        shown = [out.get("data", {}) for cell in cells for out in cell.get("outputs", [])]
        pictures = sum("image/png" in one for one in shown)  # an SVG would wait to be trusted
        tab.goto(f"{address}/{state}/{name}.ipynb?reset")
        tab.wait_for_function(
            "([all, prose, pictures]) => document.querySelectorAll('.jp-Notebook .jp-Cell').length"
            " == all && document.querySelectorAll('.jp-MarkdownOutput').length == prose &&"
            " document.querySelectorAll('.jp-RenderedImage, .jp-RenderedSVG').length == pictures",
            arg=[len(cells), prose, pictures],
        )
        tab.wait_for_function(
            f"() => [...document.querySelectorAll('{SHOWN}')]"
            f".every(one => one.childElementCount && !({READ})(one).includes('$'))",
            timeout=20_000,
        )
        return tab

    yield open_notebook
    tab.close()


@pytest.fixture
def trust(folder, jupyter_lab) -> Any:
    """Trusts an executed notebook, as its reader may."""

    def sign(name: str) -> None:
        own = os.environ | {"JUPYTER_DATA_DIR": str(folder / "data_dir")}
        subprocess.run(
            [jupyter_lab, "trust", folder / f"executed/{name}.ipynb"], env=own, check=True
        )

    return sign


def raw(part: Any) -> list[tuple[str, str]]:
    """What a notebook editor could not read in a part of its page: kinds, and where they stand."""
    shown = part.locator(SHOWN)
    texts = shown.evaluate_all(f"all => all.map({READ})")
    found = [(what, text) for text in texts for what in RAW if re.search(RAW[what], text)]
    for what, selector in UNREAD.items():
        found += [(what, text) for text in shown.locator(selector).all_inner_texts()]
    return found


@each_notebook
@each_state
def test_nothing_is_left_raw_in_a_plain_jupyterlab(opened, state, name):
    assert raw(opened(state, name)) == []


def test_a_link_to_an_equation_leads_there(opened):
    tab = opened("source", "02_expected_sarsa")
    tab.evaluate("document.querySelectorAll('details').forEach(one => { one.open = true })")
    tab.locator(".jp-Dialog-footer button").first.click()  # it asks for a kernel, and gets none
    tab.locator(".jp-MarkdownOutput").get_by_text("Eq. (2.4)").last.click()  # in a solution
    tab.wait_for_function(
        """() => {
          const place = document.querySelector("[data-jupyter-id='eq-es-features']")
          const { top } = place.getBoundingClientRect()
          return 0 < top && top < innerHeight
        }"""
    )


@pytest.mark.parametrize("name", sorted({*CHAPTERS.values()} - {"intro"}))  # which is no notebook
def test_live_figures_run_in_a_papermill_output_that_is_trusted(opened, trust, name):
    figures = [figure for figure, chapter in CHAPTERS.items() if chapter == name]
    before = opened("executed", name).locator("figure.live")
    for words in before.all_inner_texts():
        assert words == "This figure is live once the notebook is trusted, or its cells are run."
    assert before.count() == len(figures)
    trust(name)
    tab = opened("executed", name)
    tab.locator(".jp-Dialog-footer button").first.click()  # it asks for a kernel, and gets none
    for figure in figures:
        live = tab.locator(f"figure.live[data-figure={figure}]")
        live.locator("[role=status][aria-busy=false]").wait_for()
        begin = live.evaluate(FRAMES)["given"]
        live.locator("input[type=range], [role=slider]").first.press("ArrowLeft")
        tab.wait_for_function(
            "([figure, begin]) => JSON.stringify(figure.shown.given) !== JSON.stringify(begin)",
            arg=[live.element_handle(), begin],
        )
