// The one chart: lines and dots over two axes with round ticks, drawn anew at every change and as wide as there is room.
(() => {
  "use strict";

  const { add, set, numbers: { fixed, power } } = window.nmpcrl;
  const MARGIN = { left: 50, right: 12, top: 8 }, MARK = 4, LINE = 12; // [px]

  // Round numbers between two: their places and their names.
  function rounds([from, to], count) {
    const rough = (to - from) / count || 1, ten = 10 ** Math.floor(Math.log10(rough));
    const step = ten * [1, 2, 5, 10].find((factor) => factor * ten >= 0.999 * rough);
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    const first = Math.ceil(from / step - 1e-9), last = Math.floor(to / step + 1e-9);
    return Array.from({ length: last - first + 1 }, (_, k) => [(first + k) * step, fixed((first + k) * step, digits)]);
  }

  // Powers of ten between two logarithms; every second or third where they are many.
  function powers([from, to], count) {
    const first = Math.ceil(from - 1e-9), last = Math.floor(to + 1e-9);
    const every = Math.max(1, Math.ceil((last - first + 1) / count)), begin = Math.ceil(first / every) * every;
    return Array.from({ length: Math.max(0, Math.floor((last - begin) / every) + 1) }, (_, k) => (
      [begin + k * every, power(begin + k * every)]
    ));
  }

  // Where names beside lines stand, moved apart so that none covers another.
  function apart(places, last) {
    const order = places.map((_, k) => k).sort((a, b) => places[a] - places[b]), moved = [...places];
    order.forEach((k, i) => { if (i) moved[k] = Math.max(moved[k], moved[order[i - 1]] + LINE); });
    order.reverse().forEach((k, i) => { moved[k] = Math.min(moved[k], i ? moved[order[i - 1]] - LINE : last); });
    return moved;
  }

  // A line in the colour and the dashes of a learner; pale if it stands behind.
  function trace(parent, name, attributes, { color = "", dashes = "", pale = false, look = "" }) {
    const line = add(parent, name, { class: `learner ${pale ? "pale" : ""} ${look}`, "stroke-dasharray": dashes, ...attributes });
    if (color) line.style.setProperty("--learner", color);
  }

  // A chart under its title. What comes back draws { x, y, lines, dots, cursor, logs, across }: `x` and `y` are limits,
  // `lines` have { points, color, dashes, pale, look, name }, dots are points, `logs` holds "x" or "y" where an axis is
  // logarithmic, `across` names the x axis. A line is broken where its height is not a number, and cut at the frame; its
  // name stands at its end.
  function chart(parent, { label, title = label, height = 150, ticks = 4 }) {
    const whole = add(parent, "div", { class: "chart" });
    const head = add(whole, "p", { class: "caption" }, title);
    const svg = add(whole, "svg", { class: "graph", role: "img", "aria-label": label, height });
    let shown = null;
    new ResizeObserver(() => shown && draw(shown)).observe(svg);

    function draw(content) {
      shown = content;
      const { x, y, lines, dots = [], cursor = null, logs = "", across = "" } = content;
      const width = svg.clientWidth || 340, { left, top } = MARGIN, named = lines.some(({ name }) => name);
      const right = width - (named ? 34 : MARGIN.right), bottom = height - (across ? 38 : 20);
      const scale = (of, [from, to], least, most) => {
        const log = logs.includes(of), read = log ? (value) => Math.log10(Math.abs(value)) : Number;
        const [low, high] = [read(from), read(to)], span = high - low || 1;
        const names = (log ? powers : rounds)([low, high], of === "x" ? ticks : 3);
        return { at: (value) => least + ((read(value) - low) / span) * (most - least), ticks: names.map(([value, text]) => (
          [least + ((value - low) / span) * (most - least), text])) };
      };
      const h = scale("x", x, left, right), v = scale("y", y, bottom, top);
      const place = ([a, b]) => [h.at(a), Math.min(Math.max(v.at(b), -1e4), 1e4)];
      set(svg, { viewBox: `0 0 ${width} ${height}` });
      svg.replaceChildren();
      add(svg, "rect", { class: "axes", x: left, y: top, width: right - left, height: bottom - top });
      for (const [at, text] of h.ticks) {
        add(svg, "line", { class: "grid", x1: at, x2: at, y1: bottom, y2: bottom + MARK });
        add(svg, "text", { x: at, y: bottom + MARK + 12 }, text);
      }
      for (const [at, text] of v.ticks) {
        add(svg, "line", { class: "grid", x1: left - MARK, x2: right, y1: at, y2: at });
        add(svg, "text", { class: "beside", x: left - MARK - 3, y: at + 4 }, text);
      }
      if (across) add(svg, "text", { x: (left + right) / 2, y: height - 6 }, across);
      const frame = add(svg, "svg", { x: left, y: top, width: right - left, height: bottom - top, viewBox: `${left} ${top} ${right - left} ${bottom - top}` });
      if (cursor !== null) add(frame, "line", { class: "cursor", x1: h.at(cursor), x2: h.at(cursor), y1: top, y2: bottom });
      const drawn = lines.map((line) => ({ ...line, places: line.points.map(place).map(([a, b]) => [a, b]) }));
      for (const { places, ...look } of drawn) {
        let pen = "M";
        const d = places.map(([a, b]) => {
          const stroke = Number.isFinite(b) ? `${pen}${a.toFixed(2)} ${b.toFixed(2)}` : "";
          pen = stroke ? "L" : "M";
          return stroke;
        }).join("");
        trace(frame, "path", { d }, look);
      }
      for (const [cx, cy] of dots.map(place)) add(svg, "circle", { cx, cy, r: 5 });
      const ends = drawn.filter(({ name, places }) => name && places.some(([, b]) => Number.isFinite(b)));
      const last = ends.map(({ places }) => places.findLast(([, b]) => Number.isFinite(b)));
      const heights = apart(last.map(([, b]) => Math.min(Math.max(b, top), bottom)), bottom);
      ends.forEach(({ name: [letter, ...subscripts] }, k) => {
        const text = add(svg, "text", { class: "right", x: Math.min(last[k][0], right) + 4, y: heights[k] + 4 }, letter);
        if (subscripts.length) add(text, "tspan", { class: "subscript", dy: 3 }, subscripts.join(""));
      });
    }
    return { head, draw };
  }

  // What a line of a look is called.
  function key(parent, text, look) {
    const item = add(parent, "span");
    trace(add(item, "svg", { viewBox: "0 0 34 4", "aria-hidden": true }), "path", { d: "M0 2H34" }, look);
    item.append(text);
  }

  // Limits with some room around what is drawn.
  function extent(values) {
    const known = values.filter(Number.isFinite);
    if (!known.length) return [0, 1];
    const least = Math.min(...known), most = Math.max(...known), room = 0.06 * (most - least) || 0.05 * Math.abs(most) || 1;
    return [least - room, most + room];
  }

  window.nmpcrl = { ...window.nmpcrl, chart, trace, key, extent };
})();
