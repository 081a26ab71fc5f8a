// The laboratory's six plots over the episodes: what all runs cost, how theta moves, and how wrong the value is.
(() => {
  "use strict";

  const { add, graph, laboratoryRuns: { judged }, words: { laboratory: words, parts: { fixed, symbols } } } = window.nmpcrl;
  const NAMED = 4; // components of theta that have names
  const ARM = "frozen";
  const SIZE = [600, 135], MARGIN = { left: 48, right: 30, top: 6, bottom: 22 }; // [px]
  const OVER = "7 4"; // dashes of a run that is laid over the chosen one, as on the map
  const LINE = 12; // height of a small letter [px]
  const ROOM = 0.06; // above and below all that is drawn, of its height
  const TICKS = { x: 3, y: 3 };

  // Powers of ten; every second or third where they are many.
  function powers(from, to, count) {
    const first = Math.ceil(from - 1e-9), all = Math.floor(to + 1e-9) - first + 1;
    const every = Math.max(1, Math.ceil(all / count));
    const name = (k) => (Math.abs(k) < 4 ? fixed(10 ** k, Math.max(0, -k)) : `1e${fixed(k, 0)}`);
    return Array.from({ length: Math.ceil(all / every) }, (_, k) => first + every * k).map((at) => [at, name(at)]);
  }

  // Least and most of these, with some room.
  function extent(values) {
    if (!values.length) return [0, 1];
    const least = Math.min(...values), most = Math.max(...values);
    const room = ROOM * (most - least) || 0.05 * Math.abs(most) || 1;
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

  // What is returned draws { lines, x, log }: lines { points, name, look, color, dashes }; `x` is [least, most]; with
  // `log` the y axis is logarithmic. A `name` stands at the end of its line; one of several parts is a letter and its
  // subscripts. It is as wide as there is room, and redrawn as a whole.
  function plot(parent, { title, label }) {
    add(parent, "p", { class: "plot-title" }, title);
    const { svg, draw } = graph(parent, label, { kind: "plot", size: SIZE, margin: MARGIN });
    let shown = null;
    new ResizeObserver(() => shown && redraw()).observe(svg);

    function redraw() {
      const { lines, x, log = false } = shown, scale = log ? Math.log10 : (value) => value;
      const scaled = lines.map(({ points, ...line }) => ({
        ...line, points: points.map(([k, value]) => [k, scale(value)]).filter(([, y]) => Number.isFinite(y)),
      })).filter(({ points }) => points.length);
      const [from, to] = extent(scaled.flatMap(({ points }) => points.map(([, y]) => y)));
      const places = draw({
        x: { from: x[0], to: x[1], count: TICKS.x },
        y: { from, to, count: TICKS.y, ticks: scaled.length ? log && powers(from, to, TICKS.y) || undefined : [] },
        lines: scaled,
        width: svg.clientWidth || SIZE[0],
      });
      names(scaled.filter(({ name }) => name), places);
    }

    function names(lines, { across, up, right, bottom }) {
      const ends = lines.map(({ points }) => points.at(-1));
      const places = apart(ends.map(([, y]) => up(y)), bottom);
      lines.forEach(({ name }, k) => {
        const [letter, ...subscripts] = [name].flat(), x = Math.min(across(ends[k][0]), right) + 4;
        const text = add(svg, "text", { class: "right", x, y: places[k] + 4 }, letter);
        if (subscripts.length) add(text, "tspan", { class: "subscript", dy: 3 }, subscripts.join(""));
      });
    }

    return (content) => {
      shown = content;
      redraw();
    };
  }

  const after = (rows) => rows.filter(({ episode }) => episode);

  // The four that move most have names. What ended a run that diverged is so large that it would hide the rest.
  function components(run, data, color) {
    const rows = run.rows.filter(({ diverged }) => !diverged);
    const moved = data.names.map((_, k) => {
      const values = rows.map(({ theta }) => theta[k]);
      return Math.max(...values) - Math.min(...values);
    });
    const most = [...moved].sort((a, b) => b - a)[NAMED - 1];
    return data.names.map((name, k) => ({
      name: moved[k] > 0 && moved[k] >= most ? symbols[name] : "",
      look: moved[k] > 0 && moved[k] >= most ? "line" : "line quiet",
      color,
      points: rows.map(({ episode, theta }) => [episode, theta[k]]),
    }));
  }

  // Of the chosen run: what its value says of the start, and what a rollout without noise pays from there.
  function worth({ rows }, color) {
    const line = (name, read, look) => ({
      name, look, color, points: judged(rows).map(({ episode, judged: one }) => [episode, read(one)]),
    });
    return [
      line("cost", ({ discounted }) => discounted, "line truth"), line("V", ({ value }) => value, "line chosen"),
    ];
  }

  // What is returned draws (runs, chosen, kept), and names the panels to look at.
  function plots(parent, data) {
    const none = add(parent, "p", { class: "hint" }, words.noRuns);
    const grid = add(parent, "div", { class: "plots" });
    const panels = Object.fromEntries(Object.keys(words.plots).map((name) => [name, add(grid, "div", { class: "panel" })]));
    const draw = Object.fromEntries(Object.entries(panels).map(([name, panel]) => [name, plot(panel, words.plots[name])]));
    const lookAt = (names) => {
      for (const [name, panel] of Object.entries(panels)) panel.classList.toggle("look", names.includes(name));
    };
    const heights = (lines) => lines.flatMap(({ points }) => points.map(([, y]) => y)).filter(Number.isFinite);
    const wide = (values) => Math.max(...values) > 20 * Math.min(...values.filter((value) => value > 0));
    // Costs among other obstacles cannot be compared: only runs in the chosen one's place share the axes.
    const place = ({ given: { layout, start, target } }) => JSON.stringify([layout, start, target]);
    const drawn = (all, chosen, kept) => {
      const runs = all.filter((run) => !chosen || run === kept || place(run) === place(chosen));
      [none.hidden, grid.hidden] = [Boolean(runs.length), !runs.length];
      const x = [0, Math.max(...runs.map(({ given }) => given.episodes), 1)];
      const line = (run) => (run === chosen ? "line chosen" : "line");
      const look = (run) => (run === kept ? { look: "line kept", dashes: OVER } : { look: line(run) });
      const lines = (points) => runs.map((run) => ({
        ...data.looks[run.given.learner], ...look(run), name: `${run.number}`, points: points(run.rows),
      }));
      const arms = (points) => runs.map((run) => ({ ...data.looks[ARM], look: "line", points: points(run) }));
      const both = (points, ofArm) => {
        const all = [...arms(ofArm), ...lines(points)];
        return { lines: all, x, log: wide(heights(all)) };
      };
      const trained = (rows) => after(rows).map(({ episode, cost }) => [episode, cost]);
      const free = (rows) => judged(rows).map(({ episode, judged: { cost } }) => [episode, cost]);
      const level = ({ rows, given }) => free(rows.slice(0, 1)).flatMap(([, cost]) => [[0, cost], [given.episodes, cost]]);
      draw.judged(both(free, level)); // without noise the frozen arm always does the same
      draw.cost(both(trained, ({ arm }) => trained(arm)));
      draw.theta({ x, lines: chosen ? components(chosen, data, data.looks[chosen.given.learner].color) : [] });
      draw.value({ x, lines: chosen ? worth(chosen, data.looks[chosen.given.learner].color) : [] });
      const deltas = lines((rows) => after(rows).map(({ episode, delta }) => [episode, delta]));
      draw.delta({ x, lines: deltas, log: wide(heights(deltas)) });
      const steps = lines((rows) => after(rows).map(({ episode, alphaPhi2 }) => [episode, alphaPhi2]));
      const limit = { look: "level", name: `${data.overshoot}`, points: x.map((episode) => [episode, data.overshoot]) };
      const drawnSteps = [limit, ...steps];
      draw.step({ x, lines: drawnSteps, log: wide(heights(drawnSteps)) });
    };
    return { draw: drawn, lookAt };
  }

  window.nmpcrl = { ...window.nmpcrl, laboratoryPlots: plots };
})();
