"""The population published: what is read is what was written, and judged alike."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.analysis.difficulty import MEASURES
from nmpcrl.claims import population_published as published
from nmpcrl.claims.published import Damaged, Unpublishable
from nmpcrl.study.drawn import JUDGE, LAYOUTS
from nmpcrl.study.population_design import COMPARED, HORIZONS, seeds, whole_population

NAME = "J001"


@pytest.fixture
def summaries(made_up):
    """All learners in one layout, in both readings, with both seeds."""
    return made_up(layouts=(JUDGE[NAME],), seeds=seeds(NAME)).summaries


@pytest.fixture
def layouts():
    found = pd.DataFrame(0.5, index=[*LAYOUTS], columns=[*MEASURES])
    for horizon in (10, *HORIZONS):
        found[f"stops_{horizon}"] = pd.Series(dict.fromkeys(COMPARED, 0.2))
    return found


@pytest.fixture
def folder(tmp_path, monkeypatch, summaries, layouts):
    monkeypatch.setenv("NMPCRL_PUBLISHED", str(tmp_path))
    return published.publish(summaries, layouts)


@pytest.mark.usefixtures("folder")
def test_what_is_read_is_what_was_published(summaries, layouts):
    found = published.load()
    assert len(found.runs) == len(summaries)
    assert {*found.runs.part} == {"judge", "judge imitating", "judge again"}
    costs = [one.evaluations["cost"][-1] for one in summaries.values()]
    assert found.runs.final_cost.to_numpy() == pytest.approx(costs, rel=1e-5)
    assert found.runs.cost_ratio.notna().all()
    for experiment, path in found.paths.items():
        assert path == pytest.approx(summaries[experiment].states[:, :2], abs=5e-4)
    assert {e.learner for e in found.paths} == {"RDES", "GES"}
    pd.testing.assert_frame_equal(found.layouts, layouts, check_names=False)
    assert found.stops.columns.tolist() == [10, 20, 40]
    assert found.about["runs"] == {"judge": 8, "judge imitating": 4, "judge again": 12}


@pytest.mark.usefixtures("folder")
def test_claims_are_put_to_what_is_published():
    shares = published.load().shares().set_index("claim")
    assert shares.loc["C9", ["holding", "layouts"]].tolist() == [1, 1]
    assert shares.loc["C5", "holding"] == 1


def test_parts_are_put_beside_what_is_there(folder, summaries, layouts, monkeypatch, tmp_path):
    whole = published.load()
    parts = whole_population()
    first = {e: one for e, one in summaries.items() if parts[e] == "judge"}
    others = {e: one for e, one in summaries.items() if e not in first}
    monkeypatch.setenv("NMPCRL_PUBLISHED", str(tmp_path / "parts"))
    there = published.publish(first, layouts)
    begins = (there / published.TABLE).read_bytes()
    published.extend(others)
    assert (there / published.TABLE).read_bytes().startswith(begins)
    found = published.load()
    assert found.shares().equals(whole.shares())
    assert {e: path.tolist() for e, path in found.paths.items()} == {
        e: path.tolist() for e, path in whole.paths.items()
    }
    assert found.about["runs"] == whole.about["runs"]
    assert [one["runs"] for one in found.about["additions"]] == [
        {"judge imitating": 4, "judge again": 12}
    ]


@pytest.mark.usefixtures("folder")
def test_a_run_is_not_published_twice(summaries):
    with pytest.raises(Unpublishable, match="in layout J001 is published already"):
        published.extend(dict([*summaries.items()][:1]))


def test_the_same_runs_give_the_same_bytes(folder, summaries, layouts):
    names = (published.TABLE, published.PATHS, published.MEASURED)
    before = [(folder / name).read_bytes() for name in names]
    published.publish(summaries, layouts)
    assert [(folder / name).read_bytes() for name in names] == before


@pytest.mark.parametrize("name", [published.TABLE, published.PATHS, published.MEASURED])
def test_a_file_that_is_not_the_one_that_was_written_is_refused(folder, name):
    (folder / name).write_bytes(b"1")
    with pytest.raises(Damaged, match="nmpcrl study --population --publish"):
        published.load()


def test_what_is_not_there_is_refused(tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_PUBLISHED", str(tmp_path / "nowhere"))
    with pytest.raises(Damaged, match="not published whole"):
        published.load()


def test_where_a_solve_failed_there_is_no_position():
    states = np.zeros((3, 3))
    states[2] = np.nan
    kept = published._lengthened(published._shortened([states]))
    assert np.isnan(kept[0, 2]).all()
    assert not np.isnan(kept[0, :2]).any()
