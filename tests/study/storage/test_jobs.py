"""Which jobs are handed over, and when."""

from concurrent.futures import ThreadPoolExecutor
from functools import partial

import pytest

from nmpcrl.study.storage import executor


@pytest.mark.slow
def test_a_job_is_begun_when_its_turn_comes_and_not_if_it_is_refused():
    begun, ended = [], []

    def begin(name: int) -> bool:
        assert len(begun) - len(ended) < 2  # so that others may begin the rest meanwhile
        if name == 3:
            return False
        begun.append(name)
        return True

    def keep(name: int, result: int) -> str:
        assert result == abs(-name)
        ended.append(name)
        return ""

    jobs = {name: partial(abs, -name) for name in range(6)}
    assert not executor.execute(jobs, keep, begin=begin, workers=1, progress=False)
    assert begun == sorted(ended) == [0, 1, 2, 4, 5]


def test_with_an_executor_of_the_callers_every_job_is_begun_at_once():
    begun = []
    with ThreadPoolExecutor(1) as threads:
        executor.execute(
            {name: partial(abs, name) for name in range(5)},
            lambda *_: str(len(begun)),
            begin=lambda name: not begun.append(name),
            executor=threads,
            progress=False,
        )
    assert begun == [0, 1, 2, 3, 4]
