"""A sweep draws the same problems every time, counts each once, and keeps what it counted."""

from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from builders import raising

from nmpcrl.bench import sweep
from nmpcrl.bench.sweep import SweepTable, Tally
from nmpcrl.control import Nmpc, SolverError
from nmpcrl.study import ParameterError, StoreError, paper
from nmpcrl.study.jobs import parallel

ROOT = Path(__file__).resolve().parents[2]
START, THETA = np.array(paper.START), np.array(paper.THETA_INIT)


@pytest.fixture
def here(monkeypatch, tmp_path) -> Path:
    """Sweeps in a thread of this process, into a folder of this test's own."""
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    in_a_thread = partial(parallel, executor=ThreadPoolExecutor(1))
    monkeypatch.setattr(sweep, "parallel", in_a_thread)
    return tmp_path


unsolved = raising(SolverError("no optimum", START, THETA))


def test_every_problem_is_counted_once(here, monkeypatch):
    monkeypatch.setattr(sweep, "OF_A_LAYOUT", 10)
    found = sweep.sweep(25, progress=False).tally
    assert found.tried == 25
    assert found.at_once + found.restarted + found.failed == 25
    assert 0 < found.with_action < 25
    assert found.better + found.equal + found.worse + found.ipopt_failed == 3 + 3 + 2
    assert found.broken == 0
    assert 0 < found.kkt < 1e-2


def test_the_same_problems_are_drawn_again_and_kept_beside_the_benchmark(here):
    found = sweep.sweep(5, progress=False)
    assert sweep.path() == here / "sweep.json"
    assert sweep.read(sweep.path()) == found
    assert sweep.sweep(5, progress=False).tally == found.tally


def test_without_a_folder_to_keep_it_in_nothing_is_solved(here, monkeypatch):
    (here / "file").touch()
    monkeypatch.setenv("NMPCRL_RUNS", str(here / "file"))
    with pytest.raises(StoreError, match="cannot be written"):
        sweep.sweep(1, progress=False)


@pytest.mark.parametrize("content", [None, "", "[]", '{"tally": {"tried": 1}}', '{"tally": 1}'])
def test_what_is_no_sweep_is_refused_with_what_makes_one(tmp_path, content):
    place = tmp_path / "sweep.json"
    if content is not None:
        place.write_text(content)
    with pytest.raises(sweep.DamagedSweep, match=r"sweep.json is missing or damaged .*--sweep"):
        sweep.read(place)


def test_problems_are_drawn_from_where_a_run_may_go():
    rng, nmpc = np.random.default_rng(0), paper.nmpc()
    for _ in range(200):
        state, theta, action = sweep.drawn(rng, nmpc)
        assert (nmpc.task.lower <= state).all()
        assert (state <= nmpc.task.upper).all()
        assert (paper.THETA_SET[0] <= theta).all()
        assert (theta <= paper.THETA_SET[1]).all()
        assert action is None or np.array_equal(action, nmpc.plant.clip(action))


def test_a_solve_that_fails_is_counted_as_given_up(monkeypatch):
    monkeypatch.setattr(Nmpc, "solve", unsolved)
    found = sweep.judged(paper.nmpc(), paper.nmpc(solver="ipopt"), START, THETA, None)
    assert found == Tally(tried=1, failed=1)


def test_a_minimum_is_better_equal_or_worse_than_ipopts(monkeypatch):
    ours, ipopt = paper.nmpc(), paper.nmpc(solver="ipopt")
    solution = ipopt.solve(START, THETA)
    for factor, name in ((1.01, "better"), (1.0, "equal"), (0.99, "worse")):
        other = type(solution)(**vars(solution) | {"value": factor * solution.value})
        monkeypatch.setattr(ipopt, "solve", lambda *_, other=other, **__: other)
        found = sweep.judged(ours, ipopt, START, THETA, None)
        assert (found.better, found.equal, found.worse) == tuple(
            int(name == one) for one in ("better", "equal", "worse")
        )
    monkeypatch.setattr(ipopt, "solve", unsolved)
    assert sweep.judged(ours, ipopt, START, THETA, None).ipopt_failed == 1


def test_a_plan_that_must_leave_the_box_is_counted_and_compared_with_nothing():
    wall = np.array([paper.UPPER[0], 1.0, 0.0])
    ahead = np.array([0.5, 0.0])
    found = sweep.judged(paper.nmpc(), paper.nmpc(solver="ipopt"), wall, THETA, ahead)
    assert (found.outside, found.at_once + found.restarted, found.kkt) == (1, 1, 0.0)
    assert found.better + found.equal + found.worse + found.ipopt_failed == 0


def test_a_number_that_is_not_finite_or_an_input_out_of_bounds_is_counted(monkeypatch):
    nmpc = paper.nmpc()
    solution = nmpc.solve(START, THETA)
    for change in ({"value": np.nan}, {"point": solution.point * 10}):
        other = type(solution)(**vars(solution) | change)
        monkeypatch.setattr(nmpc, "solve", lambda *_, other=other, **__: other)
        assert sweep.judged(nmpc, None, START, THETA, None).broken == 1


def test_another_solver_than_riccati_is_not_judged(monkeypatch):
    nmpc, fatrop = paper.nmpc(), paper.nmpc(solver="fatrop")
    monkeypatch.setattr(nmpc, "solve", fatrop.solve)
    with pytest.raises(RuntimeError, match="fatrop solved instead of riccati"):
        sweep.judged(nmpc, None, START, THETA, None)


@pytest.mark.parametrize("problems", [0, -1, 2.5, True, "many"])
def test_what_is_no_number_of_problems_is_refused(problems):
    with pytest.raises(ParameterError, match=r"must be a whole number from 1"):
        sweep.sweep(problems)


def test_a_table_has_a_line_for_each_count():
    table = SweepTable(Tally(tried=100_000, at_once=99_998, failed=2, kkt=3e-4, worse=7), {})
    lines = str(table).splitlines()
    assert len(lines) == len(table.rows()) == 13
    assert lines[0].split("  ")[0] == "problems tried"
    assert lines[0].endswith(" 100,000")
    assert any(line.endswith(" 3.0e-04") for line in lines)
    assert len({len(line) for line in lines}) == 1


def test_the_published_sweep_found_nothing_out_of_bounds():
    found = sweep.read(ROOT / "book/published/sweep.json").tally
    assert found.tried == found.at_once + found.restarted + found.failed == 100_000
    assert found.broken == 0
    assert found.failed <= 100
    assert found.kkt < 1e-2


@pytest.mark.slow
def test_a_sweep_in_processes_counts_what_one_in_this_process_does(here, monkeypatch):
    found = sweep.sweep(3, progress=False).tally
    monkeypatch.setattr(sweep, "parallel", parallel)
    assert sweep.sweep(3, workers=1, progress=False).tally == found


def test_a_number_that_was_changed_in_a_sweep_is_noticed(tmp_path):
    known = (ROOT / "book/published/sweep.json").read_text()
    (tmp_path / "sweep.json").write_text(known.replace('"failed": 6', '"failed": 0'))
    with pytest.raises(sweep.DamagedSweep, match="it is not the file that was written"):
        sweep.read(tmp_path / "sweep.json")
