"""An investigation: arms in places make rows of one table, and the table answers questions.

    parts (arms x places x seeds) -> conditions -> run -> rows -> questions -> answers

Rows are stored one by one in `runs/NAME.jsonl`; complete arms are published as `NAME.csv`.
`nmpcrl.studies` has the investigations of the book, and a reader's own is one file.
"""

import json
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache, partial
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import cloudpickle
import numpy as np
import pandas as pd
from filelock import FileLock

from nmpcrl.analysis.statistics import count
from nmpcrl.claims.rule import read
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, Outcome
from nmpcrl.study import published
from nmpcrl.study.files import check_folder, folder, unwritable
from nmpcrl.study.jobs import Failed, make_once
from nmpcrl.study.lock import code, is_accepted, sources_hash
from nmpcrl.study.provenance import EPOCHS, hash_of, installed, made_here, versions
from nmpcrl.study.published import Unpublishable
from nmpcrl.study.refusal import Refusal

WORDS = {REPRODUCED: "confirmed", PARTLY: "confirmed in part", NOT: "contradicted"}

Row: TypeAlias = dict[str, Any]
Arms: TypeAlias = Mapping[str, Any]  # the setting of each arm, by its name


class Condition(NamedTuple):
    """The name of a row: an arm in a place, with the k-th seed of that place."""

    part: str
    arm: str
    place: str
    k: int


NAMES = list(Condition._fields)
ROWS_OF = "rows of "  # before the name of an array: which rows of the table its entries belong to


@dataclass(frozen=True)
class Part:
    """Every arm in every place with every seed.

    Arms that depend on earlier rows, such as a tuned setting, are a function of the table of
    earlier rows, which may raise a `Refusal` while it is incomplete.
    """

    run: Callable[[Any, str, int, int], Row]  #: (setting, place, episodes, seed)
    arms: Arms | Callable[[pd.DataFrame], Arms]
    places: Sequence[str]
    episodes: int
    seeds: int = 1
    begin: int = 0  #: k of the first seed
    at: Callable[[], Sequence[tuple[str, int]]] | None = None  #: place and k of rows, if no grid
    deterministic: Collection[str] = ()  #: arms without random draws: one seed
    first: Mapping[str, int] = field(default_factory=dict)  #: arms of the first places only
    seconds: float = 0.03  #: of processor time an episode, as long as no row of the arm is known

    def settings(self, table: pd.DataFrame) -> Arms:
        """The setting of each arm, given the rows of earlier parts."""
        return self.arms(table) if callable(self.arms) else self.arms

    def order(self, arm: str) -> list[tuple[str, int]]:
        """Place and k of each row of an arm."""
        if self.at:
            return [*self.at()]
        places = self.places[: self.first.get(arm)]
        seeds = 1 if arm in self.deterministic else self.seeds
        return [(place, k) for place in places for k in range(self.begin, self.begin + seeds)]


@dataclass(frozen=True)
class Answer:
    """The answer to a question."""

    outcome: Outcome
    counts: Mapping[str, tuple[int, int]] = field(default_factory=dict)  #: yes, asked; by unit
    numbers: Mapping[str, float] = field(default_factory=dict)
    beside: Mapping[str, tuple[int, int]] = field(default_factory=dict)  #: further counts
    said: str = ""  #: the outcome in words, where `WORDS` would mislead
    question: str = ""  #: its name

    @property
    def words(self) -> str:
        """The outcome as a page prints it."""
        return self.said or WORDS.get(self.outcome, str(self.outcome))


@dataclass(frozen=True)
class Question:
    """A question, with the answer that was expected before any row was made."""

    name: str
    question: str  #: in words
    expected: Outcome
    answer: Callable[[Any], Answer]  #: of the table, or of `Investigation.evidence`
    pilot: str = ""  #: the sentence of an earlier, smaller experiment


def questions(file: str, answers: Mapping[str, Callable[[Any], Answer]]) -> tuple[Question, ...]:
    """The questions of the TOML file beside a Python file, with the functions that answer them."""
    texts = tomllib.loads(Path(file).with_suffix(".toml").read_text("utf-8"))
    return tuple(
        Question(
            name,
            " ".join(one["question"].split()),
            Outcome(one["expected"]),
            answers[name],
            " ".join(one.get("pilot", "").split()),
        )
        for name, one in texts.items()
    )


@dataclass(frozen=True, kw_only=True)
class Investigation:
    """Parts, run in order, and the questions that their rows answer."""

    name: str
    parts: Mapping[str, Part]
    questions: Sequence[Question]
    seed: Callable[[str, int], int]  #: of a place and k
    registered: str = ""  #: the commit that fixed parts and questions, before the first row
    epoch: int = 1  #: raised by hand where an edit changes a number
    epochs: Mapping[str, int] = field(default_factory=lambda: EPOCHS)  #: of packages it rests on
    libraries: Sequence[str] = ()  #: further libraries whose versions change rows
    digits: int | None = None  #: to which published numbers are rounded
    arrays: Sequence[str] = ()  #: columns of lists, published in NAME.npz for the rows with one
    evidence: Callable[[pd.DataFrame], Any] = lambda table: table  #: that questions are asked of
    prepare: Callable[[Iterable[tuple[Condition, Any]]], None] | None = None  #: compiles ahead
    where: Path | None = None  #: of the published table; by default the project's folder
    source: str = ""  #: what of a reader's file rows depend on, as `lock.code` reads it

    @property
    def asked(self) -> dict[str, Question]:
        """The questions by name."""
        return {one.name: one for one in self.questions}

    def key(self, one: Condition) -> str:
        """A hash of all that a row depends on."""
        episodes = self.parts[one.part].episodes
        made_with = {**versions(), **{name: installed(name) for name in self.libraries}}
        of_file = [self.source] if self.source else []
        depends = [self.name, self.epoch, {**self.epochs}, made_with, episodes, *one, *of_file]
        return hash_of(depends)

    def table(self) -> pd.DataFrame:
        """The published rows; `Damaged` if a file is missing or was changed."""
        return published.read(self.name, self.where)

    def _published(self) -> pd.DataFrame:
        """The published rows; an empty table before the first publication."""
        known = published.about(self.name, self.where)
        return self.table() if known else pd.DataFrame(columns=NAMES)

    def is_current(self, part: str) -> bool:
        """Whether the published rows of a part are of the present epochs."""
        return published.is_current(self.name, part, self.where, self.epochs)

    def known(self) -> pd.DataFrame:
        """The published rows of these epochs, then further rows stored here."""
        there = self._published()
        parts = [*filter(self.is_current, there.part.unique())]
        tables = [one for one in (there[there.part.isin(parts)], self.made()) if len(one)]
        every = pd.concat(tables) if tables else there[:0]
        return every.drop_duplicates(NAMES, ignore_index=True)

    @property
    def log(self) -> Path:
        """The file of the rows that were made here, a line of JSON each, with key and sources."""
        return folder() / f"{self.name}.jsonl"

    def _lines(self, of: str = "") -> dict[str, tuple[Row, str]]:
        """The rows whose keys begin with `of`, by key, with the commit that had registered each.

        Incomplete lines are skipped, and rows of sources that are not accepted, or of other keys,
        arms, places or seeds.
        """
        found, order = {}, cache(lambda part, arm: {*self.parts[part].order(arm)})
        lines = self.log.read_text("utf-8").splitlines() if self.log.exists() else ()
        for line in (one for one in lines if one.startswith(f'["{of}')):
            with suppress(ValueError):
                key, sources, row, *commit = json.loads(line)
                one = Condition(*(row[name] for name in NAMES))
                part = self.parts.get(one.part)
                if part is None or not is_accepted(sources) or key != self.key(one):
                    continue
                there = callable(part.arms) or one.arm in part.arms
                if there and (one.place, one.k) in order(one.part, one.arm):
                    found[key] = row, commit[0] if commit else ""
        return found

    def made(self) -> pd.DataFrame:
        """The table of the rows that were made here."""
        return pd.DataFrame([row for row, _ in self._lines().values()])

    @property
    def unregistered(self) -> int:
        """How many rows were made here before parts and questions were registered as they are."""
        return sum(commit != self.registered for _, commit in self._lines().values())

    def conditions(self, part: str) -> dict[Condition, Any]:
        """The setting of each row of a part; a `Refusal` if an arm depends on unknown rows."""
        one = self.parts[part]
        return {
            Condition(part, arm, *at): setting
            for arm, setting in one.settings(self.known()).items()
            for at in one.order(arm)
        }

    def missing(self, part: str) -> dict[Condition, Any]:
        """The conditions of a part without a row that was made here."""
        made = self._lines()
        return {one: it for one, it in self.conditions(part).items() if self.key(one) not in made}

    def complete(self, parts: Iterable[str] = (), workers: int | None = None) -> pd.DataFrame:
        """Make every missing row of parts, by default of all; the table of rows made here.

        One process at a time makes a row. `Failed` names a failure once all other rows are made.
        """
        chosen = [*parts] or [*self.parts]
        check_folder()
        for part in filter(chosen.__contains__, self.parts):
            missing = self.missing(part)
            if missing and self.prepare:
                self.prepare(missing.items())
            _, failures = make_once(
                lambda job: self.make(*job),
                missing.items(),
                name=lambda job: f"{self.name}-{self.key(job[0])[:16]}",
                read=lambda job: self._lines(self.key(job[0])).get(self.key(job[0]), (None,))[0],
                save=self._append,
                workers=workers,
                label=part,
            )
            if failures:
                raise Failed(failures, len(missing))
        return self.made()

    def _append(self, job: tuple[Condition, Any], row: Row) -> None:
        """Store a row."""
        named = job[0]._asdict() | row
        line = json.dumps([self.key(job[0]), sources_hash(), named, self.registered])
        try:
            with FileLock(f"{self.log}.lock"), self.log.open("a", encoding="utf-8") as file:
                file.write(f"\n{line}")  # a new line, also after one that was cut off
        except OSError as error:
            raise unwritable(self.log, error) from error

    def make(self, one: Condition, setting: Any) -> Row:
        """A row, with the seconds of processor time that it took unless it has its own."""
        part, began = self.parts[one.part], time.process_time()
        row = part.run(setting, one.place, part.episodes, self.seed(one.place, one.k))
        if not isinstance(row, dict):
            raise TypeError(f"{row!r} is no row: the function of part {one.part!r} returns a dict")
        return {"seconds": time.process_time() - began} | row

    def price(self, part: str) -> tuple[int, int, float]:
        """How many rows a part has, how many are missing, and their processor time [s].

        The published arms of earlier epochs take the place of arms that depend on unknown rows; a
        `Refusal` if there are none.
        """
        known, one = pd.concat([self.made(), self._published()]), self.parts[part]
        known = known[known.part == part]
        try:
            rows = [*self.conditions(part)]
        except Refusal:
            if known.empty:
                raise
            rows = [Condition(part, arm, *at) for arm in {*known.arm} for at in one.order(arm)]
        made = self._lines()
        missing = [each.arm for each in rows if self.key(each) not in made]
        means = known.groupby("arm").seconds.mean().dropna() if "seconds" in known else {}
        seconds = sum(means.get(arm, one.seconds * one.episodes) for arm in missing)
        return len(rows), len(missing), float(seconds)

    def answers(self, table: pd.DataFrame) -> dict[str, Answer]:
        """The answers of a table to all questions, by name."""
        return self.judge(self.evidence(table))

    def judge(self, known: Any) -> dict[str, Answer]:
        """The answers of `evidence` to all questions, by name."""
        return {one.name: replace(_asked(one, known), question=one.name) for one in self.questions}

    def publish(self) -> Path:
        """Add the complete arms that were made here to the published table, or raise Unpublishable.

        Rows of earlier epochs are replaced part by part, once every arm of the part is complete.
        The commit that registers a table is the one that its first rows name.
        """
        there, made = self._published(), self.made()
        known = published.about(self.name, self.where)
        blocks, replaced = list[pd.DataFrame](), set[str]()
        for part, rows in made.groupby("part", sort=False) if len(made) else ():
            old, arms = there[there.part == part], self._complete(str(part), rows)
            if len(old) and not self.is_current(str(part)):
                if not {*self.parts[str(part)].settings(self.known())} <= {*arms}:
                    continue
                replaced.add(str(part))
            else:
                names = [name for name in old if name != "seconds"]
                for arm in filter(arms.__contains__, old.arm.unique()):
                    before = old[old.arm == arm][names].reset_index(drop=True)
                    if not before.equals(arms.pop(arm)[names]):
                        raise Unpublishable(
                            f"{arm} of the part {part!r} is published with other numbers, and these"
                            " stay: give the investigation another name, or delete its table and"
                            " manifest"
                        )
            blocks += arms.values()
        if not blocks:
            raise Unpublishable(f"no arm of {self.name} is complete and new")
        added, kept = pd.concat(blocks), self._with_lists(there)[~there.part.isin(replaced)]
        every = pd.concat([kept, added], ignore_index=True) if len(kept) else added
        if replaced:
            order = [*dict.fromkeys([*there.part, *added.part])]
            every = every.sort_values("part", key=lambda part: part.map(order.index), kind="stable")
        table, arrays = self._without_lists(every.reset_index(drop=True))
        counts = added.groupby("part", sort=False).size().to_dict()
        return published.write(
            self.name,
            table,
            arrays,
            batch=made_here() | {"epochs": {**self.epochs}, "rows": counts},
            registered=None if known else "" if self.unregistered else self.registered,
            earlier=published.without(known.get("batches", []), replaced),
            where=self.where,
        )

    def _complete(self, part: str, rows: pd.DataFrame) -> dict[str, pd.DataFrame]:
        """The complete arms of a part as they are published."""
        found = {}
        for arm, each in rows.groupby("arm", sort=False):
            by, order = each.set_index(["place", "k"], drop=False), self.parts[part].order(str(arm))
            if {*order} <= {*by.index}:
                block = by.loc[order].reset_index(drop=True)
                found[str(arm)] = block.map(partial(rounded, digits=self.digits))
        return found

    def _with_lists(self, table: pd.DataFrame) -> pd.DataFrame:
        """The published rows with the columns of lists that are published apart."""
        arrays = published.arrays(self.name, self.where) if self.arrays and len(table) else {}
        for name in {*self.arrays} & {*arrays}:
            lists = dict(zip(arrays[ROWS_OF + name].tolist(), [*arrays[name]], strict=True))
            table = table.assign(**{name: pd.Series(lists, table.index, dtype=object)})
        return table

    def _without_lists(self, table: pd.DataFrame) -> tuple[pd.DataFrame, published.Arrays]:
        """A table without its columns of lists, and these with the numbers of their rows."""
        arrays: published.Arrays = {}
        for name in {*self.arrays} & {*table}:
            lists = table[name].dropna()
            arrays |= {name: np.array([*lists]), ROWS_OF + name: lists.index.to_numpy()}
        return table.drop(columns=[*arrays], errors="ignore"), arrays


def _asked(question: Question, known: Any) -> Answer:
    """The answer to a question; a `Refusal` where its function fails."""
    try:
        found = question.answer(known)
    except Exception as error:
        why = f"{type(error).__name__}: {error}"
        raise Refusal(f"the question {question.name!r} fails: {why}") from error
    if not isinstance(found, Answer):
        raise Refusal(f"the question {question.name!r} gives {found!r} and no `Answer`")
    return found


def rounded(value: Any, digits: int | None) -> Any:
    """Floats with so many significant digits, in lists as well."""
    if isinstance(value, list):
        return [rounded(one, digits) for one in value]
    if digits and isinstance(value, float) and np.isfinite(value):
        return float(f"{value:.{digits}g}")
    return value


def of_file(path: Path) -> Investigation:
    """The investigation that a Python file defines; published beside it, in `published`.

    The first commit with the present code of the file registers it; comments are no code. Rows are
    made again after an edit of the code.
    """
    spec = spec_from_file_location(f"investigation_{path.stem}", path)
    if not path.is_file() or spec is None or spec.loader is None:
        raise Refusal(f"{path} is no Python file")
    module = sys.modules[spec.name] = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise Refusal(f"{path} fails: {type(error).__name__}: {error}") from error
    cloudpickle.register_pickle_by_value(module)  # workers cannot import it
    found = [one for one in vars(module).values() if isinstance(one, Investigation)]
    if len(found) != 1:
        raise Refusal(f"{path} must define one Investigation, and defines {len(found)}")
    where = found[0].where or path.parent / "published"
    source = code(path.read_text("utf-8"))
    registered = found[0].registered or _commit(path, source)
    return replace(found[0], where=where, registered=registered, source=source)


def _commit(path: Path, source: str) -> str:
    """The commit since which a file has its present code; empty before a commit has it."""

    def git(*arguments: str) -> str:
        asked = ["git", "-C", str(path.parent), *arguments]
        return subprocess.run(asked, capture_output=True, text=True, check=False).stdout

    since = ""
    with suppress(SyntaxError):
        for commit in git("log", "--format=%H", "--", path.name).split():
            if code(git("show", f"{commit}:./{path.name}")) != source:
                break
            since = commit
    return since


def share(
    yes: pd.Series, unit: str = "layouts", numbers: Mapping[str, float] | None = None
) -> Answer:
    """The answer of a share of yes, by `rule.read`."""
    found = count(yes)
    return Answer(read(*found), {unit: found}, numbers or {})


def cheaper(ratio: pd.Series, unit: str = "layouts") -> Answer:
    """The answer to whether a ratio of costs lies below 1, with its median."""
    return share(ratio < 1, unit, {"median ratio": float(ratio.median())})


def above(low: float, high: float, limit: float = 0.0) -> Outcome:
    """Confirmed if an interval lies above a limit, contradicted if below, else in part."""
    return REPRODUCED if low > limit else NOT if high < limit else PARTLY


def means(table: pd.DataFrame, part: str, column: str = "cost") -> pd.DataFrame:
    """The mean over seeds, a row a place and a column an arm; nan where no row is known."""
    rows = table[table.part == part]
    known = rows.assign(value=rows[column].astype(float))
    return known.groupby(["place", "arm"], sort=False).value.mean().unstack("arm")


def lower(
    part: str, first: str, second: str, unit: str = "layouts"
) -> Callable[[pd.DataFrame], Answer]:
    """Asked of each place: does the first arm cost less than the second?"""

    def answer(table: pd.DataFrame) -> Answer:
        both = means(table, part).reindex(columns=[first, second]).dropna()
        return share(both[first] < both[second], unit)

    return answer
