"""The editions as downloads: the same bytes, and links to what is there alone."""

import os
import re
from pathlib import Path
from zipfile import ZipFile

import pytest
from driver import project
from driver.course import course, downloads

BOOK = project.ROOT / "book"
PLACE = '<p>Before.</p><div class="course-downloads" data-editions="student slides"></div><p>After.'


@pytest.fixture
def small(tmp_path) -> Path:
    """A built site of one page that has a place for two editions."""
    (tmp_path / "html/book").mkdir(parents=True)
    (tmp_path / "html/book/teach.html").write_text(PLACE)
    return tmp_path / "html"


def folder(place: Path, text: str = "text") -> Path:
    (place / "data/runs/summaries").mkdir(parents=True)
    (place / "a.ipynb").write_text(text)
    for name in ("run", "summaries/run"):
        (place / f"data/runs/{name}.npz").write_bytes(bytes(2_000))
    return place


def names(zipped: Path) -> list[str]:
    with ZipFile(zipped) as archive:
        return archive.namelist()


def links(site: Path) -> dict[str, str]:
    page = (site / "book/teach.html").read_text()
    return dict(re.findall(r'<a href="([^"]+)" download>(.*?)</li>', page))


def test_the_same_folder_gives_the_same_bytes_whenever_it_was_written(tmp_path):
    for name in ("one", "two"):
        place = folder(tmp_path / name / "student")
        if name == "two":
            os.utime(place / "a.ipynb", (1e9, 1e9))
            (place / "a.ipynb").chmod(0o600)
        downloads.zipped(place, tmp_path / f"{name}.zip")
    assert (tmp_path / "one.zip").read_bytes() == (tmp_path / "two.zip").read_bytes()
    assert names(tmp_path / "one.zip") == [
        "student/a.ipynb",
        "student/data/runs/run.npz",
        "student/data/runs/summaries/run.npz",
    ]


@pytest.mark.parametrize("edition", downloads.WITHOUT_RUNS)
def test_only_students_download_whole_runs_which_are_large(edition, tmp_path):
    downloads.zipped(folder(tmp_path / edition), tmp_path / "one.zip")
    assert names(tmp_path / "one.zip") == [
        f"{edition}/a.ipynb",
        f"{edition}/data/runs/summaries/run.npz",
    ]


def test_a_page_links_to_the_files_that_are_there_with_their_size(small, tmp_path):
    (made,) = downloads.offer([folder(tmp_path / "student", "x" * 3)], small)
    ((href, words),) = links(small).items()
    assert (small / "book" / href).resolve() == made
    assert words.startswith(downloads.CONTENTS["student"])
    assert words.endswith(f"(ZIP, {made.stat().st_size / 1e6:.1f} MB)")
    page = (small / "book/teach.html").read_text()
    assert page.startswith("<p>Before.</p>")
    assert page.endswith("</div><p>After.")


def test_a_later_offer_takes_the_place_of_an_earlier_one(small, tmp_path):
    one, two = (folder(tmp_path / name) for name in ("student", "slides"))
    downloads.offer([one, two], small)
    assert len(links(small)) == 2
    downloads.offer([two], small)
    (href,) = links(small)
    assert (small / "book" / href).exists()
    assert not (small / downloads.FOLDER / "student.zip").exists()


def test_a_site_without_the_files_links_to_none_of_them(small):
    downloads.link(small)
    assert (small / "book/teach.html").read_text() == PLACE
    for page in BOOK.glob("*.md"):
        text = page.read_text()
        assert str(downloads.FOLDER) not in text
        for named in downloads.PLACE.finditer(text):
            assert set(named["editions"].split()) <= set(downloads.CONTENTS)


@pytest.mark.parametrize("page", ["teach", "learn_alone"])
def test_the_built_page_has_a_place_for_links_and_each_leads_to_a_file(site, page):
    text = (site / f"book/{page}.html").read_text()
    (place,) = downloads.PLACE.finditer(text)
    for href in re.findall('href="([^"]+)"', place[0]):
        assert (site / "book" / href).exists()


def test_every_edition_and_the_slides_have_words():
    assert set(downloads.CONTENTS) == {*course.EDITIONS, "slides"}
