// What stands on the map of a figure: ticks, obstacles, the robot and its heading, its target and its plan.
(() => {
  "use strict";

  const { add, set, parts: { clamp, points }, words: { parts: words } } = window.nmpcrl;
  const ARROW = 1.0; // from the robot to the handle of its heading [m]
  const TURN = Math.PI / 3.6; // by an arrow key, for each metre that it would move a place [rad]
  const TICKS = 2; // [m]

  function background(map, { view: [left, bottom, width, height], box: [lower, upper] }) {
    const [x, y] = lower;
    add(map.ground, "rect", { class: "box", x, y, width: upper[0] - x, height: upper[1] - y });
    const ticks = (from, to) => Array.from({ length: Math.ceil((to - from) / TICKS) }, (_, k) => from + TICKS * k);
    const first = (from) => Math.ceil(from / TICKS) * TICKS;
    for (const each of ticks(first(left + 0.6), left + width)) {
      map.write(words.tick(each, each + TICKS >= left + width), each, bottom, { class: "x tick" });
    }
    for (const each of ticks(first(bottom + 0.6), bottom + height)) {
      map.write(words.tick(each, each + TICKS >= bottom + height), left, each, { class: "y tick" });
    }
  }

  function obstacles(map, { problem, radii }, read, move) {
    const handles = radii.map((radius, k) => {
      const to = (point) => {
        const [, , clearance] = read().discs[k];
        move({ discs: read().discs.with(k, [...map.inside(point), clearance]) });
      };
      const by = (dx, dy) => to([read().discs[k][0] + dx, read().discs[k][1] + dy]);
      const handle = map.handle({ label: words.obstacle(k + 1), kind: "obstacle", range: map.range, to, by });
      add(handle.body, "circle", { class: "safety", r: problem.discs[k][2] / 2 });
      add(handle.body, "circle", { class: "disc", r: radius });
      return handle;
    });
    return ({ discs }) => discs.forEach(([x, y], k) => handles[k].put([x, y], x, words.place(x, y)));
  }

  function robot(map, { robot: radius, box: [lower, upper] }, read, move) {
    const to = (point) => {
      const [x, y] = map.inside(point);
      move({ start: [clamp(x, lower[0], upper[0]), clamp(y, lower[1], upper[1]), read().start[2]] });
    };
    const by = (dx, dy) => to([read().start[0] + dx, read().start[1] + dy]);
    const handle = map.handle({ label: words.robot, kind: "robot", range: map.range, to, by });
    add(handle.body, "circle", { class: "disc", r: radius });
    return ({ start: [x, y] }) => handle.put([x, y], x, words.place(x, y));
  }

  function arrow(map, read, move, label = words.heading) {
    const turn = (angle) => {
      const heading = Math.atan2(Math.sin(angle), Math.cos(angle)); // the same, within half a turn
      move({ start: read().start.with(2, heading) });
    };
    const shaft = add(map.ground, "line", { class: "shaft" });
    const handle = map.handle({
      label,
      kind: "heading",
      range: [-Math.PI, Math.PI],
      to: ([x, y]) => turn(Math.atan2(y - read().start[1], x - read().start[0])),
      by: (dx, dy) => turn(read().start[2] + TURN * (dy - dx)),
    });
    const tip = add(handle.body, "path", { class: "tip", d: "M1 0L-0.7 0.8L-0.7 -0.8Z" });
    return ({ start: [x, y, heading] }) => {
      const end = [x + ARROW * Math.cos(heading), y + ARROW * Math.sin(heading)];
      set(shaft, { x1: x, y1: y, x2: end[0], y2: end[1] });
      set(tip, { transform: `rotate(${(heading * 180) / Math.PI})` });
      handle.put(end, heading, words.angle(heading));
    };
  }

  // All that can be moved on the map of one controller.
  function handles(map, data, read, move) {
    return [obstacles(map, data, read, move), robot(map, data, read, move), arrow(map, read, move)];
  }

  // An obstacle that stays where it is.
  function circles(parent, [cx, cy, clearance], radius) {
    add(parent, "circle", { class: "safety", cx, cy, r: clearance / 2 });
    add(parent, "circle", { class: "disc", cx, cy, r: radius });
  }

  function target(map, { problem: { target: [x, y] } }) {
    add(map.ground, "circle", { class: "target", cx: x, cy: y });
    map.write(words.target, x, y, { class: "name" });
  }

  function planned(map, data) {
    const line = add(map.ground, "polyline", { class: "plan" });
    const dots = add(map.ground, "g", { class: "dots" });
    target(map, data);
    return (_, { plan }) => {
      const states = plan?.states ?? [];
      set(line, { points: points(states) });
      dots.replaceChildren();
      for (const [cx, cy] of states) add(dots, "circle", { cx, cy });
    };
  }

  window.nmpcrl = { ...window.nmpcrl, mapParts: { background, handles, robot, arrow, circles, target, planned } };
})();
