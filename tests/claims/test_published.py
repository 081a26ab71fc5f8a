"""The published study: read as written, small, refused if damaged, compared with new runs."""

import json
import shutil
from dataclasses import asdict, fields, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from nmpcrl.analysis.rows import row, table
from nmpcrl.analysis.search import Found, Search
from nmpcrl.analysis.summary import summarise
from nmpcrl.claims import published, thetas
from nmpcrl.claims.published import FILES, Damaged, Published, load, publish
from nmpcrl.study import Experiment, design, paper, run, sweep
from nmpcrl.study.experiment import frozen_arm
from nmpcrl.study.provenance import EPOCHS, environment, made_here
from nmpcrl.study.provenance import summary_key as run_key
from nmpcrl.study.storage.machine import fingerprint

RUNS = (
    *sweep(learner=("ES", "frozen"), seed=(0, 1, 2, 3), episodes=4, steps=6, evaluate_every=2),
    *sweep(learner=("ES", "frozen"), seed=(0, 1), episodes=4, steps=6, evaluate_every=2, horizon=2),
)
LABELS = {e: "main" if e.horizon == paper.HORIZON else "N = 2" for e in RUNS}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch) -> Path:
    """What is published here is this test's own."""
    monkeypatch.setenv("NMPCRL_PUBLISHED", str(tmp_path / "published"))
    return tmp_path / "published"


@pytest.fixture(scope="module")
def summaries():
    """A small study: four seeds of two learners, and a variant of two."""
    return {e: summarise(run(e)) for e in RUNS}


@pytest.fixture
def known(summaries) -> Published:
    publish(summaries, LABELS)
    return load()


@pytest.fixture
def whole(known, folder):
    """What is published, and the bytes of its files."""
    return known, {name: (folder / name).read_bytes() for name in FILES}


def changed(one, **rollouts):
    """A summary whose rollouts without noise came out otherwise."""
    return replace(one, evaluations=one.evaluations | rollouts)


def refusal(folder) -> str:
    """The one sentence that `load` ends in; it names the folder and what restores it."""
    published._load.cache_clear()
    with pytest.raises(Damaged) as refused:
        load()
    said = str(refused.value)
    assert str(folder) in said
    assert "`git checkout -- book/published` restores" in said
    assert "\n" not in said
    return said


@pytest.mark.parametrize(
    ("make", "kind"),
    [
        (lambda path: None, ""),
        (lambda path: path.mkdir(), ""),
        (lambda path: path.write_text("a file"), ", which is no folder"),
        (lambda path: path.symlink_to("nowhere"), ""),
    ],
    ids=["missing", "empty", "file", "dangling"],
)
def test_where_nothing_is_published_that_is_refused(folder, make, kind):
    make(folder)
    assert refusal(folder).startswith(f"nothing is published in {folder}{kind}; `git checkout")


def test_a_folder_without_the_files_and_folders_instead_of_files_are_refused(folder):
    folder.mkdir()
    for name in FILES:
        (folder / name).mkdir()
        assert f"{folder} is damaged" in refusal(folder)


def test_a_notebook_shows_the_sentence_alone(folder):
    with pytest.raises(Damaged) as refused:
        load()
    assert refused.value._render_traceback_() == [f"Damaged: {refused.value}"]


def test_theta_of_every_episode_is_kept_of_the_parts_that_a_reader_can_follow(known, summaries):
    for e, one in known.summaries.items():
        if known.variants[e] in thetas.FOLLOWED:
            theta = summaries[e].episodes["theta"].astype(np.float32)
            np.testing.assert_array_equal(one.episodes["theta"], theta)
        else:
            assert "theta" not in one.episodes


def test_the_bytes_of_any_numbers_are_read_bit_for_bit():
    numbers = np.array([0.0, -0.0, 1.0, -1e-38, 3e38, np.inf, -np.inf, np.nan, 1e-45], np.float32)
    planes = thetas.byte_planes(numbers)
    assert planes.shape == (4, numbers.size)
    assert thetas.numbers_of(planes).tobytes() == numbers.tobytes()


def test_a_study_without_such_parts_has_an_empty_file(summaries):
    publish(summaries, dict.fromkeys(summaries, "N = 2"))
    assert not any("theta" in one.episodes for one in load().summaries.values())


def test_published_theta_is_that_of_the_evaluations(monkeypatch):
    """Both are of the same runs, trained twice on machines of two kinds."""
    monkeypatch.delenv("NMPCRL_PUBLISHED")
    for one in published.load().summaries.values():
        if "theta" in one.episodes:
            judged = one.evaluations["theta"][1:]
            after = one.episodes["theta"][one.evaluations["episode"][1:] - 1]
            np.testing.assert_allclose(after, judged, rtol=1e-6)


def test_where_no_folder_is_named_the_projects_own_is_read(monkeypatch):
    monkeypatch.setenv("NMPCRL_PUBLISHED", "")
    assert published.place().parts[-2:] == ("book", "published")


def test_what_is_published_is_in_six_files(known, folder):
    assert {path.name for path in folder.iterdir()} == set(FILES)
    assert len(FILES) == 6


def test_searches_are_published_as_they_were_found(summaries):
    searches = {Search("B", budget=40): Found((0.1, 0.2), 31, (1, 7), (1 / 3, 0.1))}
    publish(summaries, LABELS, searches=searches)
    assert load().searches == searches
    assert load().about["searches"]["machine"] == made_here()["machine"]


def test_the_summaries_are_read_bit_for_bit_and_in_order(known, summaries):
    assert list(known.rows) == list(RUNS)
    for experiment, one in summaries.items():
        for name, value in row(one).items():
            np.testing.assert_equal(known.rows[experiment][name], value)
        assert known.rows[experiment]["key"] == run_key(experiment)
        assert known.variants[experiment] == LABELS[experiment]


def test_the_summaries_have_what_figures_need_in_single_precision(known, summaries):
    assert list(known.summaries) == list(RUNS)
    for experiment, one in summaries.items():
        found = known.summaries[experiment]
        assert found.name == experiment
        pairs = [(found.episodes["cost"], one.episodes["cost"]), (found.states, one.states)]
        pairs += [(found.evaluations[k], one.evaluations[k]) for k in ("episode", "theta", "cost")]
        for published_column, column in pairs:
            assert published_column.shape == column.shape
            np.testing.assert_allclose(published_column, column, rtol=1e-6)
        assert found.facts["stopped"] == one.facts["stopped"]


def test_runs_that_failed_are_read_as_they_were(summaries):
    """A rollout that failed costs infinitely much and has states that are not known."""
    first, *others = summaries
    cost, states = np.array([5.0, np.inf, np.inf]), summaries[first].states.copy()
    states[2:] = np.nan
    facts = summaries[first].facts | {"stopped": 'diverged: ", | "'}
    diverged = replace(changed(summaries[first], cost=cost), states=states, facts=facts)
    publish({first: diverged} | {e: summaries[e] for e in others}, LABELS)
    found = load()
    assert found.rows[first]["final_cost"] == np.inf
    assert found.rows[first]["stopped"] == 'diverged: ", | "'
    np.testing.assert_array_equal(found.summaries[first].evaluations["cost"], cost)
    np.testing.assert_array_equal(np.isnan(found.summaries[first].states), np.isnan(states))


def test_runs_of_other_lengths_are_not_padded(summaries):
    longer = Experiment("frozen", episodes=7, steps=9, evaluate_every=1)
    publish(summaries | {longer: summarise(run(longer))}, LABELS | {longer: "longer"})
    found = load().summaries
    assert found[longer].episodes["cost"].shape == (7,)
    assert found[longer].evaluations["cost"].shape == (8,)
    assert found[longer].states.shape == (9, 3)
    assert found[RUNS[0]].episodes["cost"].shape == (4,)
    assert found[RUNS[0]].evaluations["cost"].shape == (3,)
    assert found[RUNS[0]].states.shape == (6, 3)


def test_what_is_published_says_what_made_it(known):
    about = known.about
    assert about["epochs"] == EPOCHS
    assert about["machine"] == fingerprint()
    assert about["versions"] == environment()
    assert about["runs"] == {"main": 8, "N = 2": 4}


def test_the_same_content_gives_the_same_bytes(known, summaries, folder):
    before = {name: (folder / name).read_bytes() for name in FILES}
    shutil.rmtree(folder)
    publish(summaries, LABELS)
    again = {name: (folder / name).read_bytes() for name in FILES}
    about, about_again = (json.loads(files.pop("about.json")) for files in (before, again))
    assert again == before
    for name in ("date", "seal"):
        about.pop(name), about_again.pop(name)
    assert about_again == about


def test_what_is_published_anew_takes_the_place_of_what_was_read(known, summaries):
    fewer = [RUNS[0], frozen_arm(RUNS[0])]
    publish({e: summaries[e] for e in fewer}, LABELS)
    assert list(load().summaries) == fewer


def test_when_the_thresholds_were_fixed_is_said_again_by_what_is_published_anew(
    known, summaries, folder
):
    published._seal(folder, {**known.about, "fixed": "then"})
    publish(summaries, LABELS)
    assert load().about["fixed"] == "then"


def test_the_whole_study_takes_20_megabytes_at_most(summaries, folder):
    """Runs of full length whose numbers no compression makes smaller; theta moves by little."""
    rng, full, n = np.random.default_rng(0), Experiment(), 40
    rollouts = full.episodes // full.evaluate_every + 1
    noise = {}
    for experiment in sweep(learner=("ES", "frozen"), seed=tuple(range(n // 2))):
        one = summaries[RUNS[0]]
        episodes = {k: rng.normal(size=(300, *c.shape[1:])) for k, c in one.episodes.items()}
        episodes["theta"] = 1 + np.cumsum(1e-3 * episodes["theta"], axis=0)
        judged = {k: rng.normal(size=(rollouts, *c.shape[1:])) for k, c in one.evaluations.items()}
        judged |= {"episode": np.arange(rollouts) * full.evaluate_every}
        states = rng.normal(size=(129, 3))
        noise[experiment] = replace(
            one, experiment=asdict(experiment), episodes=episodes, evaluations=judged, states=states
        )
    followed = sum(variant in thetas.FOLLOWED for variant in design.whole_study().values())
    share = followed / len(design.whole_study())
    labels = {e: "main" if i < share * n else "N = 5" for i, e in enumerate(noise)}
    publish(noise, labels)
    each = sum(path.stat().st_size for path in folder.iterdir()) / n
    assert each * len(design.whole_study()) < 20e6


@pytest.mark.parametrize("name", FILES)
def test_a_missing_file_is_said_in_a_sentence(known, folder, name):
    (folder / name).unlink()
    assert_refused(folder)


def test_what_is_said_of_the_study_cannot_be_edited_unnoticed(known, folder):
    (folder / "about.json").write_text(json.dumps({**known.about, "hours": 9.0}))
    assert_refused(folder)


def without(folder, columns) -> Published:
    """What is published, as it was before these columns came."""
    runs = pd.read_csv(folder / "runs.csv").drop(columns=columns)
    runs.to_csv(folder / "runs.csv", index=False)
    published._seal(folder, json.loads((folder / "about.json").read_text()))
    return load()


def test_a_column_that_an_older_table_lacks_takes_the_fields_default(known, summaries, folder):
    found, default = without(folder, ["projected", "evaluate_every"]), Experiment().evaluate_every
    assert list(found.rows) == [replace(e, evaluate_every=default) for e in summaries]


@pytest.mark.parametrize(("name", "word"), [("runs.csv", "stuck")])
def test_a_word_that_is_not_known_is_refused(known, folder, name, word):
    text = (folder / name).read_text()
    (folder / name).write_text(text.replace(word, "hardly"))
    about = json.loads((folder / "about.json").read_text())
    published._seal(folder, about)
    assert word in text
    assert_refused(folder)


def test_a_table_with_columns_that_are_not_known_is_refused_with_their_names(known, folder):
    published_runs = pd.read_csv(folder / "runs.csv").rename(columns={"bias": "leaning"})
    published_runs.to_csv(folder / "runs.csv", index=False)
    published._seal(folder, json.loads((folder / "about.json").read_text()))
    assert "columns that are not known: leaning" in refusal(folder)


def test_a_metric_that_is_younger_than_the_table_is_not_known(known, folder):
    found = without(folder, ["bias"])
    assert all(np.isnan(one["bias"]) for one in found.rows.values())


def test_who_has_no_repository_is_not_told_to_ask_git(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(published.nmpcrl, "__file__", str(tmp_path / "nmpcrl/__init__.py"))
    published._load.cache_clear()
    with pytest.raises(Damaged, match="comes with the project's repository") as refused:
        load()
    assert "git checkout" not in str(refused.value)


def assert_refused(folder):
    assert f"{folder} is damaged" in refusal(folder)


DEEP = "[" * 100_000 + "]" * 100_000
WORDS = ("learner", "files", "seal", "hours", "2", "cost", ",", "\n", '"', "{", "ES", "nan")


@st.composite
def damages(draw):
    """What may happen to the bytes of a file, or of all: a function of them."""
    kind = draw(st.sampled_from(["bits", "cut", "grow", "rename", "deep", "other", "gone"]))
    share, byte = draw(st.floats(0, 1)), draw(st.integers(1, 255))
    if kind == "bits":
        at = lambda whole: min(int(share * len(whole)), len(whole) - 1)  # noqa: E731
        return lambda whole: (
            whole[: at(whole)] + bytes([whole[at(whole)] ^ byte]) + whole[at(whole) + 1 :]
        )
    if kind == "cut":
        return lambda whole: whole[: int(share * len(whole))]
    if kind == "grow":
        return lambda whole: whole + bytes([byte]) * int(1 + 9 * share)
    if kind == "rename":
        before, after = draw(st.sampled_from(WORDS)), draw(st.sampled_from(WORDS))
        return lambda whole: whole.replace(before.encode(), after.encode(), 1 + byte % 2)
    if kind == "deep":
        return lambda whole: draw(st.sampled_from([DEEP, f'{{"files": {DEEP}}}'])).encode()
    if kind == "other":
        text = st.sampled_from(["", "null", "[]", "{}", "3", "NaN", '"x"', "a,b\n1,2", "\0"])
        return draw(text.map(lambda one: lambda whole: one.encode()))
    return lambda whole: None


@pytest.mark.slow
@settings(
    derandomize=True,
    deadline=None,
    max_examples=150,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    names=st.lists(st.sampled_from(FILES), min_size=1, max_size=2, unique=True),
    damage=damages(),
    resealed=st.booleans(),
)
def test_whatever_is_damaged_either_all_is_read_as_it_was_or_it_is_refused(
    whole, folder, names, damage, resealed
):
    """Sealed anew, a file is what somebody wrote on purpose; even so nothing else is raised."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    found, contents = whole
    for name, content in contents.items():
        made = damage(content) if name in names else content
        if made is not None:
            (folder / name).write_bytes(made)
    if resealed and "about.json" not in names and all((folder / n).exists() for n in FILES):
        published._seal(folder, json.loads((folder / "about.json").read_text()))
    published._load.cache_clear()
    said = ""
    try:
        again = load()
    except Damaged as refused:
        said = str(refused)
    assert "\n" not in said
    assert len(said) < 500
    if not said and not resealed:
        np.testing.assert_equal(parts(again), parts(found))


def parts(found: Published) -> dict:
    """All that is in it, in terms that can be compared."""
    names = ("experiment", "episodes", "evaluations", "states", "facts")
    summaries = {str(e): [getattr(one, n) for n in names] for e, one in found.summaries.items()}
    rows = {repr(e): row for e, row in found.rows.items()}
    return {
        "summaries": summaries,
        "rows": rows,
        "variants": {repr(e): part for e, part in found.variants.items()},
        "about": dict(found.about),
    }


def test_times_are_published_anew_and_all_else_stays(known, folder):
    before = [(folder / name).read_bytes() for name in ("runs.csv", "curves.npz")]
    published.republish(pd.DataFrame({"solver": ["ipopt"], "learner": ["ES"]}))
    assert load().timings.to_dict("list") == {"solver": ["ipopt"], "learner": ["ES"]}
    assert load().about["timings"]["machine"] == fingerprint()
    assert before == [(folder / name).read_bytes() for name in ("runs.csv", "curves.npz")]


FURTHER = Experiment("ES", seed=7, episodes=6, steps=6, evaluate_every=2, alpha=2e-7)


@pytest.fixture(scope="module")
def further():
    """A run of another length and step size, whose frozen arm is not published."""
    return {FURTHER: summarise(run(FURTHER))}


def test_further_runs_are_published_beside_the_others_which_keep_every_byte(known, folder):
    more = replace(next(iter(known.rows)), alpha=3e-7)
    made = summarise(run(more))
    before = (folder / "runs.csv").read_text()
    curves = dict(np.load(folder / "curves.npz"))
    followed = (folder / "thetas.npz").read_bytes()
    published.extend({more: made}, {more: "alpha x 3"})
    found = load()
    assert (folder / "runs.csv").read_text().startswith(before)
    assert (folder / "thetas.npz").read_bytes() == followed
    for name, column in np.load(folder / "curves.npz").items():
        np.testing.assert_array_equal(column[: len(RUNS)], curves[name])
    assert list(found.variants.values())[-1] == "alpha x 3"
    assert found.rows[more]["final_cost"] == row(made)["final_cost"]
    assert found.rows[more]["ending"]
    np.testing.assert_allclose(found.summaries[more].states, made.states, atol=1e-6)
    assert found.about["runs"]["alpha x 3"] == 1
    (addition,) = found.about["additions"]
    assert addition["machine"] == fingerprint()
    assert addition["runs"] == {"alpha x 3": 1}


def test_how_a_further_run_went_wrong_is_what_the_whole_study_would_say(known, summaries):
    one = next(e for e in RUNS if e.learner == "ES" and e.seed == 1)
    worse = changed(summaries[one], cost=summaries[one].evaluations["cost"] * [1, 1.5, 2])
    more = replace(one, alpha=3e-7)
    asked = {more: replace(worse, experiment=worse.experiment | {"alpha": 3e-7})}
    published.extend(asked, {more: "alpha x 3"})
    expected = published.failure_modes_of(summaries | asked).iloc[-1]
    found = load().rows[more]
    assert found["wrong"] == "without noise"
    assert [found[name] for name in expected.index] == expected.tolist()


def test_runs_that_cannot_stand_beside_the_others_are_refused_in_a_sentence(
    known, summaries, further
):
    with pytest.raises(published.Unpublishable, match="is published already, in the part 'main'"):
        published.extend({RUNS[0]: summaries[RUNS[0]]}, LABELS)
    with pytest.raises(published.Unpublishable, match=r"the frozen arm of ES .* is not published"):
        published.extend(further, {FURTHER: "alpha x 2"})
    assert load().rows.keys() == known.rows.keys()


def test_the_rows_make_the_same_table_as_the_summaries(known, summaries):
    """So a chapter may take either."""
    names = [*(one.name for one in fields(Experiment)), "final_cost", "training_cost", "seconds"]
    pd.testing.assert_frame_equal(
        pd.DataFrame(list(known.rows.values()))[names], table(summaries)[names], check_dtype=False
    )


def test_about_is_json_that_people_can_read(known, folder):
    text = (folder / "about.json").read_text()
    assert json.loads(text) == known.about
    assert len(text.splitlines()) > 5
