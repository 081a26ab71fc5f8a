"""Gather what a release hands out in one folder, checked and with its hashes: `make release`.

    _build/release/nmpcrl-*.whl             the library, checked by twine and check-wheel-contents
    _build/release/nmpcrl-book.zip          the built book
    _build/release/nmpcrl.pdf               the book on paper
    _build/release/nmpcrl-article.pdf       and the article
    _build/release/nmpcrl-*.zip             the editions of the course
    _build/release/nmpcrl.cdx.json          what is installed with it, by CycloneDX from a lock
    _build/release/codemeta.json            and CITATION.cff
    _build/release/ro-crate-metadata.json   what each of these files is, by RO-Crate 1.3
    _build/release/SHA256SUMS               the hash of each: sha256sum --check SHA256SUMS

All of it is made beforehand, by `make book pdf article course`; the tools are those of tools.txt.
"""

import json
import shutil
import subprocess
import sys
from hashlib import sha256
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

ROOT = Path(__file__).resolve().parents[1]
SITE, COURSE = Path("_build/html"), Path("_build/course/instructor")
TARGET, LOCK = Path("_build/release"), "locks/python3.11.txt"
SBOM = "nmpcrl.cdx.json"
KINDS = {  # of each file, in words; the first name that fits
    "*.whl": "The library as a wheel",
    "nmpcrl-book.zip": "The executable book as pages that open from a disk",
    "nmpcrl.pdf": "The book on paper",
    "nmpcrl-article.pdf": "The article, a report of the reproduction",
    "nmpcrl-*.zip": "An edition of the course",
    SBOM: "The software bill of materials, in the form of CycloneDX",
    "codemeta.json": "What the software is, in the form of CodeMeta",
    "CITATION.cff": "How to cite it",
}


def zipped(folder: Path, target: Path) -> None:
    """The files of a folder; no date, so that the same files give the same bytes."""
    with ZipFile(target, "w") as archive:
        for path in sorted(path for path in folder.rglob("*") if path.is_file()):
            entry = ZipInfo(path.relative_to(folder.parent).as_posix())
            archive.writestr(entry, path.read_bytes(), ZIP_DEFLATED)


def gathered(root: Path, target: Path) -> list[Path]:
    """What was made, in one folder.

    Raises:
        SystemExit: something was not.
    """
    wheels = sorted((root / COURSE).glob("*.whl"))
    editions = sorted((root / SITE / "_downloads/course").glob("*.zip"))
    papers = [root / SITE / name for name in ("nmpcrl.pdf", "nmpcrl-article.pdf")]
    about = [root / name for name in ("codemeta.json", "CITATION.cff")]
    missing = [str(path) for path in papers if not path.exists()]
    if missing or len(wheels) != 1 or not editions:
        raise SystemExit(
            "A release needs what `make book pdf article course` makes: it found"
            f" {len(wheels)} wheels, {len(editions)} editions, and not {', '.join(missing) or '-'}."
        )
    for path in (*wheels, *papers, *about):
        shutil.copy2(path, target)
    for path in editions:
        shutil.copy2(path, target / f"nmpcrl-{path.name}")
    zipped(root / SITE, target / "nmpcrl-book.zip")
    return sorted(target.iterdir())


def checked(wheel: Path) -> None:
    """Whether the index would take the wheel, and whether it holds what it should."""
    bin_ = Path(sys.executable).parent
    subprocess.check_call([bin_ / "twine", "check", "--strict", wheel])
    subprocess.check_call([bin_ / "check-wheel-contents", wheel])


def bill_of_materials(root: Path, target: Path) -> None:
    """The packages of a lock with their hashes, by CycloneDX."""
    command = [Path(sys.executable).with_name("cyclonedx-py"), "requirements", root / LOCK]
    options = ["--pyproject", root / "pyproject.toml", "--mc-type", "library", "--validate"]
    subprocess.check_call([*command, *options, "--output-reproducible", "-o", target / SBOM])


def described(target: Path) -> None:
    """What each file is, by RO-Crate."""
    from rocrate.rocrate import ROCrate

    about = json.loads((target / "codemeta.json").read_text("utf-8"))
    crate = ROCrate(version="1.3")
    crate.name, crate.description = about["name"], about["description"]
    crate.license = about["license"]
    for path in sorted(target.iterdir()):
        kind = next(words for pattern, words in KINDS.items() if path.match(pattern))
        digest = {"sha256": sha256(path.read_bytes()).hexdigest()}
        size = {"contentSize": str(path.stat().st_size)}
        crate.add_file(path, path.name, properties={"name": kind, **size, **digest})
    paper = about["isBasedOn"]
    article = {"@type": "ScholarlyArticle", "name": paper["name"]}
    crate.root_dataset["isBasedOn"] = crate.add_jsonld({"@id": paper["@id"], **article})
    crate.metadata.write(target)


def summed(target: Path) -> None:
    """The hash of each file, as `sha256sum --check` reads it."""
    lines = [f"{sha256(path.read_bytes()).hexdigest()}  {path.name}" for path in target.iterdir()]
    (target / "SHA256SUMS").write_text("".join(f"{line}\n" for line in sorted(lines)))


def main() -> None:
    """Make the folder anew."""
    target = ROOT / TARGET
    shutil.rmtree(target, ignore_errors=True)
    target.mkdir(parents=True)
    (wheel,) = (path for path in gathered(ROOT, target) if path.suffix == ".whl")
    checked(wheel)
    bill_of_materials(ROOT, target)
    described(target)
    summed(target)
    print((target / "SHA256SUMS").read_text(), end="")


if __name__ == "__main__":
    main()
