"""What is lost where a notebook is stopped, and that nothing else is."""

import time
from dataclasses import replace

import psutil
import pytest
from small_course import ASKED, solved_by_student

from nmpcrl.course import judging
from nmpcrl.course.execution import Limits
from nmpcrl.course.judging import Run


def test_where_the_chapter_itself_is_stopped_the_last_answer_before_it_is_taken_out(
    submission, judge, monkeypatch
):
    _, handed = submission(solved_by_student())
    codes = []

    def ends_between(judge, steps, limits, until, *, restored):
        code = {step.name: step.code for step in steps}
        codes.append(code)
        names = list(code)
        if "2" in code["two-answer"]:  # as if it had left a timer running
            names = names[: names.index("between-2")]
        return Run(dict.fromkeys(names, ""), dict.fromkeys(names, ""), why="it ended")

    monkeypatch.setattr(judging, "run", ends_between)
    losses = judging.losses(judge, handed, Limits())
    assert [name for name in ASKED if losses[name]] == ["two"]
    assert len(codes) == 2
    changed = {name for name, code in codes[1].items() if code != codes[0][name]}
    assert changed == {"two-answer"}


def test_an_exercise_that_is_stopped_untouched_is_left_out_altogether(
    submission, judge, monkeypatch
):
    _, handed = submission(solved_by_student())

    def ends_in_its_check(judge, steps, limits, until, *, restored):
        names = [step.name for step in steps]
        if "two-check" in names:
            names = names[: names.index("two-check")]
        return Run(dict.fromkeys(names, ""), dict.fromkeys(names, ""), why="it ended")

    monkeypatch.setattr(judging, "run", ends_in_its_check)
    losses = judging.losses(judge, handed, Limits())
    assert [name for name in ASKED if losses[name]] == ["two"]


def test_the_time_of_a_notebook_holds_for_all_its_runs(submission, judge):
    _, handed = submission(solved_by_student(three="import time\ntime.sleep(10**6)"))
    losses = judging.losses(judge, handed, Limits(seconds=3))
    assert losses["three"]
    assert "the notebook took longer than 3 s" in losses["seven"]


def test_files_are_written_in_a_folder_that_is_thrown_away(
    submission, judge, tmp_path, monkeypatch
):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    code = "from pathlib import Path\nPath('left.txt').write_text(str(Path.cwd()))"
    chapter, handed = submission(solved_by_student(one=code))
    steps = [replace(step, code="1 / 0") if step.group == "two" else step for step in handed.steps]
    made = judging.run(judge, steps, Limits(), time.monotonic() + 60)
    assert made.errors["one-answer"] == ""
    assert made.errors["two-answer"].startswith("ZeroDivisionError")
    assert list(tmp_path.joinpath("here").iterdir()) == []
    assert edition_files(chapter) == {"of_the_chapter.txt", "published"}


DAEMON = """import os, time
from pathlib import Path
if not os.fork():
    os.setsid()
    if os.fork():
        os._exit(0)
    os.chdir("/")
    {goes_on}
os.wait()
while not Path({file!r}).exists() or not Path({file!r}).read_text():
    time.sleep(0.01)
"""


@pytest.mark.parametrize(
    "goes_on",
    [
        "Path({0!r}).write_text(str(os.getpid())); time.sleep(600)",
        "os.execve('/bin/sh', ['sh', '-c', 'echo $$ > {0}; exec sleep 600'], {{}})",
    ],
    ids=["as itself", "without environment"],
)
def test_a_process_that_left_the_notebook_ends_with_it(submission, judge, tmp_path, goes_on):
    file = tmp_path / "daemon"
    daemon = DAEMON.format(file=str(file), goes_on=goes_on.format(str(file)))
    _, handed = submission(solved_by_student(one=daemon))
    judging.run(judge, handed.steps, Limits(), time.monotonic() + 60)
    left = int(file.read_text())
    until = time.monotonic() + 5
    while psutil.pid_exists(left) and psutil.Process(left).status() != psutil.STATUS_ZOMBIE:
        assert time.monotonic() < until, "the daemon goes on"
        time.sleep(0.05)


@pytest.mark.slow
@pytest.mark.parametrize(
    "line",
    ["if os.fork(): os._exit(0)", "if os.fork(): time.sleep(1); os._exit(0)"],
)
def test_a_copy_that_goes_on_for_its_process_costs_the_exercise_that_made_it(
    line, submission, judge
):
    _, handed = submission(solved_by_student(one=f"import os, time\nroot_of_one = 2\n{line}"))
    losses = judging.losses(judge, handed, Limits())
    assert [name for name in ASKED if losses[name]] == ["one"]


def edition_files(chapter) -> set[str]:
    return {path.name for path in chapter.data.iterdir()}
