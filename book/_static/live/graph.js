// Lines and dots over two axes: numbers in, drawing out, anew at every change.
(() => {
  "use strict";

  const { add, words: { parts: { fixed } } } = window.nmpcrl;
  const WIDTH = 340, HEIGHT = 215, LEFT = 50, BOTTOM = 40, TOP = 10, RIGHT = 10; // in units of the picture
  const TICKS = 4; // about so many on an axis

  // Round numbers between two: their places and their names.
  function rounds(least, most) {
    const rough = (most - least) / TICKS, ten = 10 ** Math.floor(Math.log10(rough));
    const step = ten * [1, 2, 5, 10].find((factor) => factor * ten >= rough);
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    const first = Math.ceil(least / step), last = Math.floor(most / step);
    return Array.from({ length: last - first + 1 }, (_, k) => [(first + k) * step, fixed((first + k) * step, digits)]);
  }

  // `label` is what it is to whoever does not see it. Each axis that `draw` is given has `name`, `from`,
  // `to` and perhaps `ticks`, pairs of a place and its text; `lines`, `dots` and `rules` (upright) are by class.
  function graph(parent, label) {
    const svg = add(parent, "svg", {
      class: "graph", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": label,
    });

    function draw({ x, y, lines = {}, dots = {}, rules = {} }) {
      svg.replaceChildren();
      const right = WIDTH - RIGHT, bottom = HEIGHT - BOTTOM;
      const across = (at) => LEFT + ((at - x.from) / (x.to - x.from)) * (right - LEFT);
      const up = (at) => bottom - ((at - y.from) / (y.to - y.from)) * (bottom - TOP);
      add(svg, "rect", { class: "axes", x: LEFT, y: TOP, width: right - LEFT, height: bottom - TOP });
      for (const [at, text] of x.ticks ?? rounds(x.from, x.to)) {
        add(svg, "line", { class: "grid", x1: across(at), x2: across(at), y1: bottom, y2: bottom + 4 });
        add(svg, "text", { x: across(at), y: bottom + 16 }, text);
      }
      for (const [at, text] of y.ticks ?? rounds(y.from, y.to)) {
        add(svg, "line", { class: "grid", x1: LEFT - 4, x2: right, y1: up(at), y2: up(at) });
        add(svg, "text", { class: "beside", x: LEFT - 7, y: up(at) + 4 }, text);
      }
      add(svg, "text", { x: (LEFT + right) / 2, y: HEIGHT - 7 }, x.name);
      for (const [name, at] of Object.entries(rules)) {
        add(svg, "line", { class: name, x1: across(at), x2: across(at), y1: TOP, y2: bottom });
      }
      for (const [name, line] of Object.entries(lines)) {
        const points = line.map((point) => `${across(point[0])},${up(point[1])}`).join(" ");
        add(svg, "polyline", { class: name, points });
      }
      for (const [name, [cx, cy]] of Object.entries(dots)) {
        if (cx < x.from || cx > x.to) continue;
        add(svg, "circle", { class: name, cx: across(cx), cy: up(cy), r: 5 });
      }
    }
    return draw;
  }

  window.nmpcrl = { ...window.nmpcrl, graph };
})();
