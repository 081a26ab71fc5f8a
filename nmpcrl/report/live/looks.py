"""How a learner is drawn in a live figure: as in all others."""

from dataclasses import asdict

from nmpcrl.report.figures.style import LOOKS

DASHES = {"-": (), "--": (3.7, 1.6), "-.": (6.4, 1.6, 1.0, 1.6), ":": (1.0, 1.65)}  # matplotlib's
WIDTH = 1.6  # of a line, of which dashes are multiples


def look(learner: str) -> dict[str, str]:
    """Colour and dashes; black follows the theme of the page."""
    found = asdict(LOOKS[learner])
    style = found["linestyle"]
    dashes = DASHES[style] if isinstance(style, str) else style[1]
    color = "var(--ink)" if found["color"] == "#000000" else found["color"]
    return {"color": color, "dashes": " ".join(f"{WIDTH * each:g}" for each in dashes)}
