"""The questions of `syllabus.yml`: each with a place for its answer, and a folded answer.

The place is that of an exercise, so `book/_static/exercises` checks it. Without scripts and on
paper there are the question, its choices, and the answer.
"""

import json
import re

from driver.page.questions import PLACE
from driver.teaching.declared import Question, declared
from driver.teaching.syllabus import chapters

QUESTION = """\
::::{{div}} exercise question
**{number}.** {asks}

{choices}
::::

{place}

::::{{admonition}} Answer to {number}
:class: dropdown

**{right}**: {why} Read: {read}.
::::"""


def self_test() -> str:
    """All questions, as MyST."""
    return "\n\n".join(question(k, one) for k, one in enumerate(declared().self_test, 1))


def question(number: int, asked: Question) -> str:
    """One question, as MyST."""
    why = {letter: sentence for letter, (_, sentence) in asked.choices.items()}
    said = f"Right: {why[asked.right]}"
    data = {"kind": "choice", "said": said, "right": asked.right, "why": why}
    given = json.dumps(data, ensure_ascii=False).replace("<", "\\u003c")
    return QUESTION.format(
        number=number,
        asks=asked.asks,
        choices="\n".join(f"- **{key}.** {text}" for key, (text, _) in asked.choices.items()),
        place=PLACE.format(name=f"self-test-{number}", number=number, data=given),
        right=asked.right,
        why=why[asked.right],
        read=to_read(asked.read),
    )


def to_read(text: str) -> str:
    """A link as it is, a citation, or "page: section" as links to both."""
    page, _, title = text.partition(": ")
    if page not in chapters():
        return re.sub(r"\[[^]]+\]\(references\.md#(\w+)\)", r"{cite:t}`\1`", text)
    chapter = chapters()[page]
    return f"{chapter.link}, {chapter.section(title).link}"
