// The live figure of the kink: walk the robot over an obstacle's boundary, and see V and its slope in theta_c.
(() => {
  "use strict";

  const { add, set, plane, mapParts, slider, graph, parts: shared, words: { kink: words } } = window.nmpcrl;
  const REACH = 0.1; // of the walk, on either side of the boundary [m]
  const BESIDE = 3e-6; // how far beside the boundary its two slopes are read [m]
  const PLACES = 16; // on either side, in a plot
  const C = 8; // theta_c in theta

  // Obstacles that stay where they are, each with a circle of its radius in `around`.
  function discs(map, { problem, radii }, around) {
    problem.discs.forEach(([x, y], k) => mapParts.circles(map.ground, [x, y, 2 * around[k]], radii[k]));
  }

  // The nearest boundary: the way outwards from its obstacle's centre through the robot, and where on it
  // the robot is, negative inside.
  function nearest({ start: [x, y] }, { problem, boundaries }) {
    const all = problem.discs.map(([cx, cy], k) => {
      const away = Math.hypot(x - cx, y - cy);
      const out = away > 0 ? [(x - cx) / away, (y - cy) / away] : [1, 0];
      return { number: k + 1, centre: [cx, cy], out, radius: boundaries[k], offset: away - boundaries[k] };
    });
    return all.reduce((best, each) => (each.offset < best.offset ? each : best));
  }

  const place = ({ centre, out, radius }, offset) => centre.map((c, k) => c + (radius + offset) * out[k]);

  const ask = ({ theta, problem: { discs }, horizon }, state) => ({ state, theta, discs, horizon });

  function walkOver(nmpc, data, { start }, boundary) {
    const at = (offset) => {
      const state = [...place(boundary, offset), start[2]];
      const plan = nmpc.solve(ask(data, state));
      return plan && { offset, value: plan.value, slope: plan.features[C] };
    };
    const side = (sign) => Array.from({ length: PLACES + 1 }, (_, k) => (
      at(sign * (k ? (REACH * k) / PLACES : BESIDE))
    )).filter(Boolean);
    return { inside: side(-1), outside: side(1) };
  }

  function walkSlider(parent, data, read, move) {
    const kind = { name: "walk", label: words.walk, range: [-100, 100, 5], text: words.millimetres };
    const line = add(parent, "div", { class: "wide" });
    return slider(line, kind, {
      read: (given) => Math.round(1000 * nearest(given, data).offset),
      write: (millimetres) => {
        const [x, y] = place(nearest(read(), data), millimetres / 1000);
        move({ start: [x, y, read().start[2]] });
      },
    });
  }

  function way(map) {
    const line = add(map.ground, "line", { class: "shaft" });
    return (_, { boundary }) => {
      const [from, to] = [-REACH, REACH].map((offset) => place(boundary, offset));
      set(line, { x1: from[0], y1: from[1], x2: to[0], y2: to[1] });
    };
  }

  // One quantity along the walk, inside and outside apart.
  function curve(parent, label, name, here) {
    const whole = add(parent, "div");
    shared.write(add(whole, "p", { class: "caption" }), words[name]);
    const { draw } = graph(whole, label);
    return (_, { plan, boundary, inside, outside }) => {
      const heights = [...inside, ...outside].map((each) => each[name]);
      if (!plan || !heights.length) return;
      const least = Math.min(...heights), most = Math.max(...heights), room = 0.08 * (most - least) + 1e-6;
      const [from, to] = [least - room, most + room];
      const line = (look, side) => ({ look, points: side.map((each) => [each.offset, each[name]]) });
      draw({
        x: { name: words.across, from: -REACH, to: REACH },
        y: { from, to },
        lines: [{ look: "edge", points: [[0, to], [0, from]] }, line("inside", inside), line("outside", outside)],
        dots: [[boundary.offset, here(plan)]],
      });
    };
  }

  function build(figure, data, nmpc) {
    const begin = { start: data.start };
    const { read, move } = shared.state(begin, show);
    shared.heading(figure, words);
    const map = plane(figure, data.view, words.handles);
    mapParts.background(map, data);
    discs(map, data, data.boundaries);
    const parts = [mapParts.planned(map, data), way(map), mapParts.robot(map, data, read, move)];
    const tell = shared.results(figure);
    parts.push(walkSlider(figure, data, read, move));
    const row = add(figure, "div", { class: "columns" });
    parts.push(curve(row, words.plots[0], "value", (plan) => plan.value));
    parts.push(curve(row, words.plots[1], "slope", (plan) => plan.features[C]));
    shared.button(add(figure, "div", { class: "last" }), words.reset, () => move(begin));

    function show(given) {
      const boundary = nearest(given, data);
      const plan = nmpc.solve(ask(data, given.start));
      const found = { boundary, plan, ...walkOver(nmpc, data, given, boundary) };
      found.jump = found.inside[0]?.slope - found.outside[0]?.slope;
      tell(plan && found.jump ? words.results(found) : [[words.failed]]);
      for (const draw of parts) draw(given, found);
      figure.shown = { given, found };
    }
    show(begin);
  }

  shared.begin("kink", build);
})();
