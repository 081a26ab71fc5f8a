// Lines over episodes or steps, with axes; as wide as there is room, and redrawn as a whole.
(() => {
  "use strict";

  const { add, set, words: { parts: { fixed } } } = window.nmpcrl;
  const HEIGHT = 190, MARGIN = { left: 50, right: 30, top: 10, bottom: 24 }; // [px]
  const LINE = 12; // height of a small letter [px]
  const TICKS = { x: 5, y: 4 };

  // Round numbers from one to the other, about `count` of them.
  function round(from, to, count) {
    const rough = (to - from) / count, unit = 10 ** Math.floor(Math.log10(rough));
    const step = unit * [1, 2, 5, 10].find((times) => times * unit >= 0.999 * rough);
    const first = Math.ceil(from / step - 1e-9), last = Math.floor(to / step + 1e-9);
    const digits = Math.max(0, -Math.floor(Math.log10(step)));
    return Array.from({ length: last - first + 1 }, (_, k) => [(first + k) * step, digits])
      .map(([at, places]) => ({ at, text: fixed(at, places) }));
  }

  // Powers of ten; every second or third where they are many.
  function powers(from, to, count) {
    const first = Math.ceil(from - 1e-9), all = Math.floor(to + 1e-9) - first + 1;
    const every = Math.max(1, Math.ceil(all / count));
    const name = (k) => (Math.abs(k) < 4 ? fixed(10 ** k, Math.max(0, -k)) : `1e${fixed(k, 0)}`);
    return Array.from({ length: Math.ceil(all / every) }, (_, k) => first + every * k)
      .map((at) => ({ at, text: name(at) }));
  }

  // Least and most of all that is drawn, with some room; what is not finite is left out.
  function extent(values, margin) {
    const known = values.filter(Number.isFinite);
    const least = Math.min(...known), most = Math.max(...known);
    if (!known.length) return [0, 1];
    const room = margin * (most - least) || 0.05 * Math.abs(most) || 1;
    return [least - room, most + room];
  }

  // Places of texts, moved apart so that none covers another, and up again from below the last place.
  function apart(places, last) {
    const order = places.map((_, k) => k).sort((a, b) => places[a] - places[b]), moved = [...places];
    order.forEach((k, i) => {
      if (i) moved[k] = Math.max(moved[k], moved[order[i - 1]] + LINE);
    });
    order.reverse().forEach((k, i) => {
      moved[k] = Math.min(moved[k], i ? moved[order[i - 1]] - LINE : last);
    });
    return moved;
  }

  // What is returned draws { lines, levels, x, log }: lines { points, name, look, color, dashes } and levels
  // { y, name }, which go across. `x` is [least, most]; with `log` the y axis is logarithmic. A `name` stands at the
  // end of its line; one of several parts is a letter and its subscripts.
  function plot(parent, { title, label }) {
    add(parent, "p", { class: "plot-title" }, title);
    const svg = add(parent, "svg", { class: "plot", role: "img", "aria-label": label, height: HEIGHT });
    let shown = null;
    new ResizeObserver(() => shown && draw()).observe(svg);

    function draw() {
      const { lines, levels = [], x, log = false } = shown;
      const width = svg.clientWidth || 600, scale = log ? Math.log10 : (value) => value;
      const tall = [...lines.flatMap(({ points }) => points.map(([, y]) => y)), ...levels.map(({ y }) => y)];
      const y = extent(tall.map(scale), 0.06);
      const right = width - MARGIN.right, bottom = HEIGHT - MARGIN.bottom;
      const across = (value) => MARGIN.left + ((value - x[0]) / (x[1] - x[0])) * (right - MARGIN.left);
      const up = (value) => bottom - ((value - y[0]) / (y[1] - y[0])) * (bottom - MARGIN.top);
      set(svg, { viewBox: `0 0 ${width} ${HEIGHT}` });
      svg.replaceChildren();
      axes(across, up, right, bottom, round(...x, TICKS.x), (log ? powers : round)(...y, TICKS.y));
      const ends = levels.map((level) => ({ ...level, at: up(scale(level.y)), level: true }));
      for (const level of ends) {
        add(svg, "line", { class: "level", x1: MARGIN.left, x2: right, y1: level.at, y2: level.at });
      }
      for (const line of lines) {
        const points = line.points.map(([k, value]) => [across(k), up(scale(value))])
          .filter((point) => point.every(Number.isFinite));
        if (!points.length) continue;
        const drawn = add(svg, "polyline", { class: `line ${line.look ?? ""}`, points: points.join(" ") });
        if (line.color) drawn.style.setProperty("--look", line.color);
        if (line.dashes) drawn.style.strokeDasharray = line.dashes;
        ends.push({ name: line.name, at: points.at(-1)[1], from: points.at(-1)[0] });
      }
      names(ends.filter(({ name }) => name), right);
    }

    function axes(across, up, right, bottom, xs, ys) {
      for (const { at, text } of ys) {
        add(svg, "line", { class: "grid", x1: MARGIN.left, x2: right, y1: up(at), y2: up(at) });
        add(svg, "text", { class: "left", x: MARGIN.left - 5, y: up(at) + 4 }, text);
      }
      for (const { at, text } of xs) add(svg, "text", { x: across(at), y: bottom + 17 }, text);
    }

    function names(ends, right) {
      const places = apart(ends.map(({ at }) => at), HEIGHT - MARGIN.bottom);
      ends.forEach(({ name, from = right }, k) => {
        const [letter, ...subscripts] = [name].flat();
        const text = add(svg, "text", { class: "right", x: Math.min(from, right) + 4, y: places[k] + 4 }, letter);
        if (subscripts.length) add(text, "tspan", { class: "subscript", dy: 3 }, subscripts.join(""));
      });
    }

    return (content) => {
      shown = content;
      draw();
    };
  }

  window.nmpcrl = { ...window.nmpcrl, plot };
})();
