// The live figure of obstacles that move: each has an arrow, its velocity, and two robots plan among them.
//
// What can be moved is `given`: { movers, theta, step }, a mover being [x, y, vx, vy] with its place at the start.
(() => {
  "use strict";

  const {
    add, set, plane, mapParts, weight, trace, key, player, button, solver, numbers: { points, fixed }, parts: shared,
  } = window.nmpcrl;
  const PACE = 80; // from one step to the next while it plays [ms]
  const AHEAD = 4; // an arrow is as long as the motion in this time [s]
  const FASTEST = 1; // [m/s]
  const KEYS = 0.5; // of a velocity [m/s], for each metre that an arrow key would move a place

  const ROBOTS = { extrapolated: "Extrapolates each velocity", frozen: "Plans as if they stood" };

  const at = ([x, y, vx, vy], seconds) => [x + seconds * vx, y + seconds * vy];

  // Where a robot expects the obstacles at the i-th stage of its plan, as `study.moving` has it.
  const EXPECTED = {
    extrapolated: (now, before, i) => now.map((place, j) => place.map((each, a) => each + i * (each - before[j][a]))),
    frozen: (now) => now,
  };

  // An episode of a robot: its states and plans, and how much it was charged and how often it was inside by then.
  // A failed solve ends it, as in `evaluate`.
  function drive(expect, { movers, theta }, { start, steps, period, problem: { discs } }, nmpc, planner) {
    const found = { states: [], plans: [], costs: [], inside: [], failed: false };
    const centres = (step) => movers.map((mover) => at(mover, period * step));
    const stages = [...planner.problem.data.keys()];
    let state = start, cost = 0, inside = 0, planned = null;
    for (let k = 0; k < steps; k++) {
      const now = centres(k), before = centres(k - 1);
      const data = stages.map((i) => expect(now, before, i).flat());
      planned = planner.solve({ state, theta, data }, { warm: planned });
      if (!planned) return { ...found, failed: true };
      const around = now.map((place, j) => [...place, discs[j][2]]);
      cost += nmpc.cost({ discs: around }, state, planned.action);
      inside += around.some(([x, y, clearance]) => (state[0] - x) ** 2 + (state[1] - y) ** 2 < (clearance / 2) ** 2);
      found.states.push(state);
      found.plans.push(planned.states);
      found.costs.push(cost);
      found.inside.push(inside);
      state = nmpc.step(state, planned.action);
    }
    return found;
  }

  // An obstacle where it is at the step that is shown, and its arrow, which begins at the edge of the disc.
  function obstacle(map, k, { period, radii, problem: { discs } }, read, move) {
    const seconds = () => period * read().step;
    const now = () => at(read().movers[k], seconds());
    const velocity = () => read().movers[k].slice(2);
    const put = ([x, y], [vx, vy]) => {
      move({ movers: read().movers.with(k, [...at([x, y, -vx, -vy], seconds()), vx, vy]) });
    };
    const to = (point) => put(map.inside(point), velocity());
    const disc = map.handle({
      label: mapParts.obstacle(k + 1), kind: "obstacle", range: map.range, to,
      by: (dx, dy) => to(now().map((each, a) => each + [dx, dy][a])),
    });
    add(disc.body, "circle", { class: "safety", r: discs[k][2] / 2 });
    add(disc.body, "circle", { class: "disc", r: radii[k] });

    const speed = (wanted) => {
      const size = Math.hypot(...wanted), most = Math.min(1, FASTEST / size);
      put(now(), size ? wanted.map((each) => Math.round(100 * most * each) / 100) : [0, 0]);
    };
    const shaft = add(map.ground, "line", { class: "shaft" });
    const arrow = map.handle({
      label: `Obstacle ${k + 1}, velocity`, kind: "heading", range: [0, FASTEST],
      to: (point) => {
        const away = point.map((each, a) => each - now()[a]), size = Math.hypot(...away);
        speed(away.map((each) => (each / size) * Math.max(0, size - radii[k]) / AHEAD));
      },
      by: (dx, dy) => speed(velocity().map((each, a) => each + KEYS * [dx, dy][a])),
    });
    const tip = add(arrow.body, "path", { class: "tip", d: "M1 0L-0.7 0.8L-0.7 -0.8Z" });
    return () => {
      const [x, y] = now(), [vx, vy] = velocity(), angle = Math.atan2(vy, vx), size = Math.hypot(vx, vy);
      const along = (length) => [x + length * Math.cos(angle), y + length * Math.sin(angle)];
      const begin = along(radii[k]), end = along(radii[k] + AHEAD * size);
      disc.put([x, y], x, mapParts.place(x, y));
      set(shaft, { x1: begin[0], y1: begin[1], x2: end[0], y2: end[1] });
      set(tip, { transform: `rotate(${(angle * 180) / Math.PI})` });
      arrow.put(end, size, size ? `${fixed(vx, 2)} m/s in x, ${fixed(vy, 2)} m/s in y` : "stands");
    };
  }

  // Each robot with its whole way, the part that is driven, and its plan.
  function robots(map, { looks, robot: r }) {
    const drawn = add(map.ground, "g");
    return ({ step }, found) => {
      drawn.replaceChildren();
      for (const [view, { states, plans, inside }] of Object.entries(found)) {
        const look = looks[view], now = Math.min(step, states.length - 1);
        trace(drawn, "polyline", { points: points(states) }, { ...look, pale: true });
        if (now < 0) continue;
        const [cx, cy] = states[now], plain = { color: look.color, dashes: "none" };
        trace(drawn, "polyline", { points: points(states.slice(0, now + 1)), }, { ...look, look: "way" });
        trace(drawn, "polyline", { points: points(plans[now]), }, { ...plain, look: "planned" });
        trace(drawn, "circle", { cx, cy, r, }, { ...plain, look: "driven" });
        if (inside[now] > (inside[now - 1] ?? 0)) add(drawn, "circle", { cx, cy, r, class: "within" });
      }
    };
  }

  // A line of texts and numbers in turn.
  function results(name, { states, costs, inside, failed }, step) {
    const now = Math.min(step, states.length - 1);
    if (failed) return [`${name}: the solver found no plan at step ${states.length}, and the episode ends there.`];
    return [
      `${name}: cost`, fixed(costs[now], 0), "so far,", fixed(costs.at(-1), 0), "in all; states inside an obstacle:",
      `${inside[now]}`, "so far,", `${inside.at(-1)}`, "in all",
    ];
  }

  async function build(figure, data, nmpc) {
    const planning = await solver(window.nmpcrl.problem_module, data.planning);
    const begin = { movers: data.movers, theta: data.theta, step: data.step };
    const { read, move } = shared.state(begin, show);
    const views = Object.keys(data.looks);
    shared.heading(figure, {
      label: "Map of two robots among obstacles that move; obstacles and their velocities can be moved",
      title: "Try it: two robots among obstacles that move, solved in your browser.",
      hint: "Press Play. Drag an obstacle to where it is at the time shown, and the tip of its arrow, which is as long as "
        + "its motion in 4 s; with the tip on the disc, it stands. Or reach both with Tab and press the arrow keys, with "
        + "Shift for larger steps.",
    });
    const map = plane(figure, data.view, "What can be moved on the map");
    mapParts.background(map, data);
    mapParts.target(map, data);
    const keys = add(figure, "p", { class: "key" });
    for (const view of views) key(keys, ROBOTS[view], data.looks[view]);
    const play = player(figure, {
      label: "Time", last: data.steps - 1, pace: PACE, text: (step) => `${fixed(data.period * step, 1)} s`,
    }, { read: () => read().step, write: (step) => move({ step }) });
    const moved = (change) => {
      play.stop();
      move(change);
    };
    const obstacles = data.movers.map((_, k) => obstacle(map, k, data, read, moved));
    const drawRobots = robots(map, data);
    const tell = shared.results(figure);
    const margin = weight(add(figure, "div", { class: "groups" }), "c", data, read, move);
    const last = add(figure, "div", { class: "last" });
    shared.write(add(last, "p"), "Which {c} keeps the second robot out of every obstacle, and what does it then cost? "
      + "Shorten the arrow on the left a little: which robot costs less now?");
    button(last, "Reset all", () => moved(begin));
    add(figure, "p", { class: "legend" }, "Thin lines: each robot's whole way. Thick lines: the part that is driven. Dots: "
      + "its plan at the time shown. A robot that is inside an obstacle's dashed circle has a red ring.");
    let asked = null, found = null;

    function show(given) {
      if (asked?.movers !== given.movers || asked.theta !== given.theta) {
        found = Object.fromEntries(views.map((view) => [view, drive(EXPECTED[view], given, data, nmpc, planning)]));
      }
      asked = given;
      for (const draw of obstacles) draw();
      drawRobots(given, found);
      play.draw(given.step);
      margin(given);
      tell(views.map((view) => results(ROBOTS[view], found[view], given.step)));
      figure.shown = { given, found }; // for whoever asks; tests do
    }
    show(begin);
  }

  shared.begin("moving", build);
})();
