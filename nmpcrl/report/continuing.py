"""The same run elsewhere: as a command, and as a few lines of library code.

`TEMPLATES` has the texts with places in braces, so that a page can fill the same ones for settings
that its reader chose. Both name only fields that differ from their defaults and that the learner
reads, under the names of `Experiment`:

- `command` takes `options`, each an `option` with a `name` whose words are joined by hyphens, and a
  `value`: numbers of a list between commas, a layout as a name or as `x,y` pairs between blanks,
  and in double quotes whatever has blanks. What is true or false is a `switch` instead, whose name
  begins with `no-` where it is false.
- `code` takes `fields`, each a `field` with a `name` and a Python literal as its `value`; a layout
  is a name or a tuple of pairs.

No values but such numbers and words may be filled in: nothing else is quoted.
"""

from dataclasses import fields
from typing import Any

from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment

TEMPLATES = {
    "command": "nmpcrl train{options}",
    "option": " \\\n  --{name} {value}",
    "switch": " \\\n  --{name}",
    "code": """from nmpcrl.study import Experiment, run

experiment = Experiment({fields})
records = run(experiment)
print(records.facts["stopped"])
print(records.facts["final_cost"])
print(records.steps["theta"][-1])
""",
    "field": "\n    {name}={value},",
}


def command(experiment: Experiment) -> str:
    """The command that trains a run and stores it, for a shell."""
    options = (_option(name.replace("_", "-"), one) for name, one in changed(experiment).items())
    return TEMPLATES["command"].format(options="".join(options))


def code(experiment: Experiment) -> str:
    """Library code that trains a run and prints what became of it."""
    named = changed(experiment)
    if "," in named.get("layout", ""):
        named["layout"] = paper.centres_of(experiment.layout)
    template = TEMPLATES["field"]
    filled = [template.format(name=name, value=_literal(one)) for name, one in named.items()]
    return TEMPLATES["code"].format(fields="".join([*filled, "\n" * bool(filled)]))


def changed(experiment: Experiment) -> dict[str, Any]:
    """The fields that differ from their defaults and that the learner reads."""
    values = vars(experiment.canonical)
    return {
        one.name: values[one.name] for one in fields(experiment) if values[one.name] != one.default
    }


def _option(name: str, value: Any) -> str:
    if isinstance(value, bool):
        return TEMPLATES["switch"].format(name=name if value else f"no-{name}")
    text = ",".join(map(repr, value)) if isinstance(value, tuple) else str(value)
    return TEMPLATES["option"].format(name=name, value=f'"{text}"' if " " in text else text)


def _literal(value: Any) -> str:
    """A value as code: text in double quotes, as elsewhere in the project."""
    return f'"{value}"' if isinstance(value, str) else repr(value)
