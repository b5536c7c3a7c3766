"""Every citation of the documentation names a page that exists and sections that it has.

A citation is the path of a page from the root of the repository, followed by the numbers of its sections, or by `#` and
the anchor of a heading on a page without numbers: `docs/reference/mavlink.md 1.1, 5.2`, `docs/glossary.md#belief`.
A decision is one page and needs no section.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
GENERATED = ROOT / "docs" / "reference" / "generated"  # written by the build of the site, which resolves links to them
PACKAGES = ("groundstation", "drivers", "sim_bridge", "tests", "config")
CODE = {".py", ".yaml", ".toml", ".js", ".html", ".css"}
NUMBER = r"\d+(?:\.\d+)*"
GAP = r"(?: |\n[ \t]*(?:# )?)"  # a blank, or the break between two lines of a docstring or comment
CITATION = re.compile(rf"(docs/[\w./-]+\.md)(#[\w-]+|{GAP}{NUMBER}(?:(?:,{GAP}|{GAP}and{GAP}){NUMBER})*)?")
HEADING = re.compile(r"^#+ (.+)$", flags=re.MULTILINE)
LINK = re.compile(r"\]\(([^)\s]+)\)")
REPOSITORY_PATH = re.compile(r"`((?:groundstation|drivers|sim_bridge|tests|config)/[\w./-]*)`")
FILE_NAME = re.compile(r"`((?:[\w-]+/)*[\w-]+\.(?:py|js|css|yaml))`")
OLD_SHEETS = re.compile(r"\b(?:AR\.Drone|protocol|reliability) sheet\b|\bshared/(?:reference|design)\b")
OLD_PAGES = re.compile(
    r"(?<![\w/-])(?:ardrone-protocol|mavlink|zenoh|vision|estimation|planning|method|reliability|lab-interop"
    r"|visualisation)\.md\b"
)
FENCE = re.compile(r"^```.*?^```$", flags=re.MULTILINE | re.DOTALL)
RECORD_PARTS = ["Context", "Decision", "Rejected", "Consequence"]


@dataclass(frozen=True)
class Citation:
    """One mention of a page: the file and line of it, the page, its sections and its anchor."""

    place: str
    page: str
    sections: tuple[str, ...]
    anchor: str


def files(suffixes: set[str]) -> Iterator[Path]:
    """Yield the files of the tree with these suffixes, and, for code, the Makefile and `.ci/run`."""
    for folder in (*PACKAGES, "docs"):
        found = (path for path in sorted((ROOT / folder).rglob("*")) if path.suffix in suffixes and path.is_file())
        yield from (path for path in found if not {"_build", "vendor", "generated"} & set(path.parts))
    yield from (path for path in sorted(ROOT.glob("*")) if path.suffix in suffixes)
    if ".py" in suffixes:
        yield from (ROOT / "Makefile", ROOT / ".ci" / "run")


def pages() -> list[Path]:
    return list(files({".md"}))


def citations_of(text: str, name: str) -> Iterator[Citation]:
    for match in CITATION.finditer(text):
        line = text.count("\n", 0, match.start()) + 1
        rest = match[2] or ""
        anchor = rest[1:] if rest.startswith("#") else ""
        yield Citation(f"{name}:{line}", match[1], () if anchor else tuple(re.findall(NUMBER, rest)), anchor)


@cache
def citations() -> tuple[Citation, ...]:
    here = Path(__file__)
    return tuple(
        one
        for path in files(CODE)
        if path != here
        for one in citations_of(path.read_text(encoding="utf-8"), str(path.relative_to(ROOT)))
    )


@cache
def headings(page: Path) -> tuple[str, ...]:
    return tuple(HEADING.findall(FENCE.sub("", page.read_text(encoding="utf-8"))))


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings as MyST and the forges make them."""
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings(page)}


def numbers(page: Path) -> set[str]:
    return {heading.split()[0] for heading in headings(page) if re.fullmatch(NUMBER, heading.split()[0])}


def fault_of(one: Citation) -> str | None:
    page = ROOT / one.page
    if page.is_relative_to(GENERATED):
        return None
    if not page.is_file():
        return f"{one.place}: there is no {one.page}"
    if one.anchor:
        return None if one.anchor in anchors(page) else f"{one.place}: {one.page} has no heading #{one.anchor}"
    lost = [section for section in one.sections if section not in numbers(page)]
    if lost:
        return f"{one.place}: {one.page} has no section {', '.join(lost)}"
    if not one.sections and page.parent.name != "decisions":
        return f"{one.place}: name the section of {one.page}"
    return None


def test_every_citation_in_code_resolves() -> None:
    faults = [fault for one in citations() if (fault := fault_of(one))]
    assert not faults, "\n".join(faults)
    assert len(citations()) > 50


def test_a_wrong_citation_is_found() -> None:
    def faults(text: str) -> list[str]:
        return [fault for one in citations_of(text, "code") if (fault := fault_of(one))]

    page = "docs/reference/" + "mavlink.md"
    assert not faults(f"# see {page} 1.1,\n    # 5.2")
    assert faults(f"\n# {page} 1.1,\n    # 5.99") == [f"code:2: {page} has no section 5.99"]
    assert faults(f"({page})") == [f"code:1: name the section of {page}"]
    assert faults(page.replace("mavlink", "carrier-pigeon") + " 1")
    assert faults(f"{page}#no-such-heading")


def test_the_former_names_are_gone() -> None:
    found = []
    for path in files(CODE | {".md"}):
        if path == Path(__file__):
            continue
        text = path.read_text(encoding="utf-8")
        forms = OLD_SHEETS.findall(text) + (OLD_PAGES.findall(text) if path.suffix in CODE else [])
        found += [f"{path.relative_to(ROOT)}: {form}" for form in forms]
    assert not found, f"cite a page of docs/ and its section: {found}"


def test_links_between_pages_resolve() -> None:
    lost = []
    for page in pages():
        for link in LINK.findall(FENCE.sub("", page.read_text(encoding="utf-8"))):
            if "://" in link or link.startswith("mailto:"):
                continue
            path, _, anchor = link.partition("#")
            target = (page.parent / path).resolve() if path else page
            if target.is_relative_to(GENERATED):
                continue
            if not target.exists() or (anchor and target.suffix == ".md" and anchor not in anchors(target)):
                lost.append(f"{page.relative_to(ROOT)}: {link}")
    assert not lost, "\n".join(lost)


def test_documentation_names_files_that_exist() -> None:
    lost = [
        f"{page.relative_to(ROOT)}: {name}"
        for page in pages()
        if page.is_relative_to(ROOT / "docs")
        for name in REPOSITORY_PATH.findall(page.read_text(encoding="utf-8"))
        if not (ROOT / name).exists()
    ]
    assert not lost, "\n".join(lost)


def test_files_are_named_as_they_are_called() -> None:
    """Files named in a package's table or a page exist; the reader's own files are excepted."""
    there = {path.name for path in files({".py", ".js", ".css", ".yaml"})}
    readers_own = {"uwb_range.py", "test_uwb_range.py", "coasting_target.py", "test_coasting_target.py"}
    readers_own |= {"resolved.yaml", "lab.yaml"}
    lost = [
        f"{page.relative_to(ROOT)}: {name}"
        for page in pages()
        for name in FILE_NAME.findall(FENCE.sub("", page.read_text(encoding="utf-8")))
        if Path(name).name not in there | readers_own
    ]
    assert not lost, "\n".join(lost)


def test_numbered_pages_use_each_number_once() -> None:
    for page in pages():
        found = [heading.split()[0] for heading in headings(page) if re.fullmatch(NUMBER, heading.split()[0])]
        assert len(found) == len(set(found)), f"{page.relative_to(ROOT)}: {found}"


def test_decisions_are_numbered_and_have_one_form() -> None:
    records = sorted((ROOT / "docs" / "decisions").glob("[0-9]*.md"))
    for number, record in enumerate(records, 1):
        title, *parts = headings(record)
        assert record.name.startswith(f"{number:04d}-"), f"{record.name}: the next number is {number:04d}"
        assert title.startswith(f"{number:04d} "), record.name
        assert parts == RECORD_PARTS, f"{record.name}: {parts}"


def test_the_index_names_each_decision_once_by_its_title() -> None:
    folder = ROOT / "docs" / "decisions"
    listed = [line for line in (folder / "index.md").read_text(encoding="utf-8").splitlines() if line.startswith("- [")]
    wanted = [f"- [{headings(record)[0]}]({record.name})" for record in folder.glob("[0-9]*.md")]
    wrong = sorted(set(wanted) ^ set(listed)) + [line for line in set(listed) if listed.count(line) > 1]
    assert not wrong, "\n".join(["lines that docs/decisions/index.md lacks, has twice, or should not have:", *wrong])
