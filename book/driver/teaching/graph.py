"""A graph of chapters as SVG: names and needs in, text out. Its colours are those of the page."""

from html import escape

import networkx as nx

WIDTH, HEIGHT, GAP = 150, 44, 40  # of a node, and between two rows
MARGIN = 12

Needs = dict[str, list[str]]


def svg(names: dict[str, tuple[str, str]], needs: Needs) -> str:
    """Each chapter below what it needs.

    Args:
        names: number and short title of a chapter, by page; each row keeps their order.
        needs: the pages that a page needs.
    """
    rows, shown = arranged({page: needs[page] for page in names})
    needs = {page: shown[page] for page in needs}
    widest = max(map(len, rows))
    size = (widest * (WIDTH + MARGIN) + MARGIN, len(rows) * (HEIGHT + GAP) - GAP + 2 * MARGIN)
    at = {
        page: (size[0] * (k + 0.5) / len(row), MARGIN + HEIGHT / 2 + depth * (HEIGHT + GAP))
        for depth, row in enumerate(rows)
        for k, page in enumerate(row)
    }
    lines = [_line(at[other], at[page]) for page, others in needs.items() for other in others]
    nodes = [_node(at[page], page, *names[page]) for page in needs]
    described = "; ".join(
        f"{names[page][0]} needs {' and '.join(names[other][0] for other in others)}"
        for page, others in needs.items()
        if others
    )
    return "\n".join(
        [
            f'<svg class="chapters" viewBox="0 0 {size[0]} {size[1]}" role="group"'
            f' aria-label="What needs what, by number of chapter: {described}.">',
            *lines,
            *nodes,
            "</svg>",
        ]
    )


def arranged(needs: Needs) -> tuple[list[list[str]], Needs]:
    """Rows of pages, each of which needs only rows before it, and needs that follow from no others.

    Raises:
        ValueError: pages need each other in a circle.
    """
    whole = nx.DiGraph()
    whole.add_nodes_from(needs)
    whole.add_edges_from((other, page) for page, others in needs.items() for other in others)
    if not nx.is_directed_acyclic_graph(whole):
        raise ValueError(f"{sorted(page for page, _ in nx.find_cycle(whole))} need each other")
    edges, order = nx.transitive_reduction(whole).edges, list(needs)
    rows = [sorted(row, key=order.index) for row in nx.topological_generations(whole)]
    return rows, {page: [one for one in needs[page] if (one, page) in edges] for page in needs}


def _line(start: tuple[float, float], end: tuple[float, float]) -> str:
    (x1, y1), (x2, y2) = start, end
    return f'<path d="M{x1:g} {y1 + HEIGHT / 2:g} L{x2:g} {y2 - HEIGHT / 2:g}"/>'


def _node(at: tuple[float, float], page: str, number: str, title: str) -> str:
    x, y = at[0] - WIDTH / 2, at[1] - HEIGHT / 2
    return (
        f'<a href="{page}.html" aria-label="Chapter {number}: {escape(title)}">'
        f'<rect x="{x:g}" y="{y:g}" width="{WIDTH}" height="{HEIGHT}" rx="6"/>'
        f'<text x="{at[0]:g}" y="{y + 18:g}">{number}</text>'
        f'<text x="{at[0]:g}" y="{y + 35:g}">{escape(title)}</text></a>'
    )
