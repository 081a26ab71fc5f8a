"""What a journal or a citation would read of this package: complete, true, and nobody invented."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from nmpcrl.claims import published
from nmpcrl.claims.verdict import NOT, REPRODUCED

ROOT = Path(__file__).resolve().parents[2]
METADATA = yaml.safe_load((ROOT / "metadata.yaml").read_text())
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text())
(PAPER,) = CITATION["references"]

GROUPS = {  # fields that ReScience C's template has as lists of single entries
    "code": {"url", "doi", "swh"},
    "data": {"url", "doi"},
    "replication": {"cite", "bib", "url", "doi"},
    "review": {"url"},
    "dates": {"received", "accepted", "published"},
    "article": {"number", "doi", "url"},
    "journal": {"name", "issn", "volume", "issue"},
}
TEXTS = ("title", "keywords", "abstract", "bibliography", "type", "domain", "language")
PEOPLE = {"authors", "affiliations", "contributors"}


def group(name: str) -> dict:
    """One of `GROUPS` as a single dictionary."""
    return {key: value for entry in METADATA[name] for key, value in entry.items()}


def bibliography() -> str:
    return (ROOT / METADATA["bibliography"]).read_text()


def entries(key: str) -> str:
    """The entry of the bibliography with this key, without the braces that keep capitals."""
    found = re.search(rf"^@\w+\{{{key},\n(.*?)^\}}", bibliography(), flags=re.M | re.S)
    assert found, f"{key} is not in the bibliography"
    return found[1].replace("{", "").replace("}", "")


def leaves(node: object) -> Iterator[object]:
    """Every value in nested lists and dictionaries."""
    for one in node.values() if isinstance(node, dict) else node:
        yield from leaves(one) if isinstance(one, dict | list) else [one]


def test_every_field_of_the_template_is_there_and_no_other():
    assert set(METADATA) == {*GROUPS, *TEXTS, *PEOPLE}
    for name, fields in GROUPS.items():
        assert set(group(name)) == fields, name


@pytest.mark.parametrize("name", TEXTS)
def test_what_the_authors_fill_in_is_filled_in(name):
    assert isinstance(METADATA[name], str)
    assert METADATA[name].strip()


def test_the_authors_are_those_of_the_citation_file():
    names = [author["name"] for author in METADATA["authors"]]
    assert names == [author["name"] for author in CITATION["authors"]]


def test_nobody_is_named_who_has_not_taken_part():
    assert not any(person["name"] or person["orcid"] for person in METADATA["contributors"])
    assert not any(author["orcid"] or author["email"] for author in METADATA["authors"])
    assert METADATA["affiliations"] == []
    assert [person["role"] for person in METADATA["contributors"]].count("editor") == 1


@pytest.mark.parametrize("name", ["dates", "article", "review"])
def test_what_only_a_journal_can_know_is_empty(name):
    assert not any(group(name).values())


def test_the_paper_is_the_one_of_the_citation_file():
    cited = group("replication")
    assert PAPER["title"] in cited["cite"]
    assert str(PAPER["year"]) in cited["cite"]
    assert cited["url"] == PAPER["url"]
    (identifier,) = (one["value"] for one in PAPER["identifiers"])
    assert identifier in cited["cite"]
    for author in PAPER["authors"]:
        assert f"{author['given-names'][0]}. {author['family-names']}" in cited["cite"]


def test_the_paper_is_in_the_bibliography_under_that_key():
    entry = entries(group("replication")["bib"])
    assert PAPER["title"] in entry
    assert PAPER["url"] in entry
    for author in PAPER["authors"]:
        assert f"{author['family-names']}, {author['given-names']}" in entry


def test_the_title_is_the_papers_after_the_prefix_that_the_published_verdicts_ask_for():
    prefix, _, title = METADATA["title"].partition(" ")
    assert title == PAPER["title"]
    outcomes = [v.outcome for v in published.load().verdicts if v.claim.startswith("C")]
    failed = 2 * outcomes.count(NOT) > len(outcomes)
    whole = outcomes.count(REPRODUCED) == len(outcomes)
    assert prefix == ("[¬Re]" if failed else "[Re]" if whole else "[~Re]")


def test_the_entry_to_copy_is_what_the_citation_file_says():
    text = (ROOT / "book/references.md").read_text()
    said = dict(re.findall(r"^  (\w+) += \{+(.+?)\}+,?$", text, flags=re.M))
    assert [said["author"]] == [author["name"] for author in CITATION["authors"]]
    assert said["note"] == f"Reproduces {PAPER['identifiers'][0]['value']}"
    assert {said[key] for key in ("title", "version", "license")} == {
        CITATION[key] for key in ("title", "version", "license")
    }
    config = yaml.safe_load((ROOT / "_config.yml").read_text())
    assert said["year"] == config["copyright"]


def test_no_placeholder_is_left():
    texts = [str(leaf) for leaf in leaves(METADATA)]
    assert not [text for text in texts if re.search(r"TODO|FIXME|XXX|example\.(com|org)", text)]


def test_the_data_are_where_the_study_is_published(monkeypatch):
    monkeypatch.delenv("NMPCRL_PUBLISHED", raising=False)
    assert published.folder() == ROOT / group("data")["url"]
