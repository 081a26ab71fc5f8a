"""`nmpcrl remedies` as a user calls it."""

from nmpcrl.claims import remedy_published
from nmpcrl.claims.remedies import COLUMNS
from nmpcrl.claims.remedy_questions import PARTS


def test_what_is_published_is_advised_on(command):
    import pandas as pd

    one = PARTS["judge 50"]
    rows = [
        {**dict.fromkeys(COLUMNS, 0), "part": "judge 50", "entry": "grid", "name": "grid",
         "layout": layout, "k": k, "initial": 4000.0, "best": 3000.0, "cost": 3200.0,
         "arrived": True, "episodes": 11, "over": False, "seconds": 0.25}
        for layout in one.layouts
        for k in range(one.seeds)
    ]  # fmt: skip
    remedy_published.extend(pd.DataFrame(rows, columns=[*COLUMNS]))
    said = command("remedies", "--judge")
    assert said.exit_code == 0, said.output
    _, row, *others = said.stdout.splitlines()
    assert row.split()[:4] == ["grid", "first", "0.80", "[0.80,"]
    assert "one number by hand: not decidable here (0 of 0 layouts)" in others
