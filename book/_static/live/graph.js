// Lines and dots over two axes with ticks: numbers in, drawing out, anew at every change. Where many pictures stand
// in a row, and limits are enough, a chart of charts.js is smaller.
(() => {
  "use strict";

  const { add, set, words: { parts: { fixed } } } = window.nmpcrl;
  const SIZE = [340, 215], MARGIN = { left: 50, right: 10, top: 10, bottom: 40 }; // in units of the picture
  const TICKS = 4; // about so many on an axis
  const MARK = 4; // of a tick, beyond the axis

  // Round numbers between two: their places and their names.
  function rounds({ from, to, count = TICKS }) {
    const rough = (to - from) / count, ten = 10 ** Math.floor(Math.log10(rough));
    const step = ten * [1, 2, 5, 10].find((factor) => factor * ten >= 0.999 * rough);
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    const first = Math.ceil(from / step - 1e-9), last = Math.floor(to / step + 1e-9);
    return Array.from({ length: last - first + 1 }, (_, k) => [(first + k) * step, fixed((first + k) * step, digits)]);
  }

  // `label` is what it is to whoever does not see it; `kind` is its class. `draw` is given two axes, each { from, to }
  // and perhaps a `name`, a `count` of ticks or the `ticks` themselves, pairs of a place and its text; lines
  // { points, look, color, dashes }, of which `look` is a class; and dots. It returns where a number stands.
  function graph(parent, label, { kind = "graph", size = SIZE, margin = MARGIN } = {}) {
    const svg = add(parent, "svg", { class: kind, role: "img", "aria-label": label });
    const left = margin.left, top = margin.top;

    function draw({ x, y, lines, dots = [], width = size[0] }) {
      const right = width - margin.right, bottom = size[1] - margin.bottom;
      const across = (at) => left + ((at - x.from) / (x.to - x.from)) * (right - left);
      const up = (at) => bottom - ((at - y.from) / (y.to - y.from)) * (bottom - top);
      set(svg, { viewBox: `0 0 ${width} ${size[1]}` });
      svg.replaceChildren();
      add(svg, "rect", { class: "axes", x: left, y: top, width: right - left, height: bottom - top });
      for (const [at, text] of x.ticks ?? rounds(x)) {
        add(svg, "line", { class: "grid", x1: across(at), x2: across(at), y1: bottom, y2: bottom + MARK });
        add(svg, "text", { x: across(at), y: bottom + MARK + 12 }, text);
      }
      for (const [at, text] of y.ticks ?? rounds(y)) {
        add(svg, "line", { class: "grid", x1: left - MARK, x2: right, y1: up(at), y2: up(at) });
        add(svg, "text", { class: "beside", x: left - MARK - 3, y: up(at) + 4 }, text);
      }
      if (x.name) add(svg, "text", { x: (left + right) / 2, y: size[1] - 7 }, x.name);
      for (const { points, look, color, dashes } of lines) {
        const places = points.map(([at, height]) => `${across(at)},${up(height)}`).join(" ");
        const line = add(svg, "polyline", { class: look, points: places });
        if (color) line.style.setProperty("--look", color);
        if (dashes) line.style.strokeDasharray = dashes;
      }
      for (const [at, height] of dots) {
        if (at >= x.from && at <= x.to) add(svg, "circle", { cx: across(at), cy: up(height), r: 5 });
      }
      return { across, up, right, bottom };
    }
    return { svg, draw };
  }

  window.nmpcrl = { ...window.nmpcrl, graph };
})();
