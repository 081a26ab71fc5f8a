"""What a page says of the drawn layouts."""

import pandas as pd

from nmpcrl.claims.population import shares
from nmpcrl.report.drawn import share_table


def test_a_row_has_count_interval_outcome_and_what_was_expected():
    rows = [("ES improves", f"J{i:03}", 1, 2, i < 38) for i in range(40)]
    table = share_table(
        shares(pd.DataFrame(rows, columns=["claim", "layout", "yes", "of", "holds"]))
    )
    assert '<th scope="row"' in table
    assert "ES improves" in table
    assert "38 of 40<br>95% [83%, 99%]" in table
    assert '<span class="verdict-reproduced">reproduced</span>' in table
    assert "85% to 97%" in table
