// The live figure of the controller: move the robot, the obstacles, theta and N, and see what it then does.
//
// What can be moved is `given`: { start, theta, horizon, discs }. Each part of the figure is a function that
// takes what it needs of it, calls `move(change)` when the reader moves something, and returns what draws.
(() => {
  "use strict";

  const { add, set, plane, solver, words: { controller: words } } = window.nmpcrl;
  const ARROW = 1.0; // from the robot to the handle of its heading [m]
  const TURN = Math.PI / 3.6; // by an arrow key, for each metre that it would move a place [rad]
  const QUIET = 500; // after the last change, before a screen reader speaks [ms]
  const TICKS = 2; // [m]

  const clamp = (number, least, most) => Math.min(Math.max(number, least), most);
  const points = (states) => states.map(([x, y]) => `${x},${y}`).join(" ");

  // The parts of V. It is quadratic in each weight, so a weight's part is half its product with its feature.
  function shares({ theta }, { value, features }) {
    const half = theta.map((weight, k) => (weight * features[k]) / 2);
    const sum = (from, to) => half.slice(from, to).reduce((a, b) => a + b);
    const parts = { stages: sum(0, 3), inputs: sum(3, 5), end: sum(5, 8) };
    return { ...parts, slacks: value - parts.stages - parts.inputs - parts.end };
  }

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

  function trajectories(map, { problem: { target: [x, y] } }, before) {
    add(map.ground, "polyline", { class: "before", points: points(before.states) });
    const loop = add(map.ground, "polyline", { class: "loop" });
    const plan = add(map.ground, "polyline", { class: "plan" });
    const dots = add(map.ground, "g", { class: "dots" });
    add(map.ground, "circle", { class: "target", cx: x, cy: y });
    map.write(words.target, x, y, { class: "name" });
    return (_, found) => {
      const planned = found.plan?.states ?? [];
      set(loop, { points: points(found.states) });
      set(plan, { points: points(planned) });
      dots.replaceChildren();
      for (const [cx, cy] of planned) add(dots, "circle", { cx, cy });
    };
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

  function arrow(map, read, move) {
    const turn = (angle) => {
      const heading = Math.atan2(Math.sin(angle), Math.cos(angle)); // the same, within half a turn
      move({ start: read().start.with(2, heading) });
    };
    const shaft = add(map.ground, "line", { class: "shaft" });
    const handle = map.handle({
      label: words.heading,
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

  function symbol(parent, name) {
    const [letter, ...subscripts] = words.symbols[name];
    const whole = add(parent, "span", { class: "symbol" }, letter);
    subscripts.reduce((above, text) => add(above, "sub", {}, text), whole);
  }

  function slider(group, name, data, read, move) {
    const k = data.names.indexOf(name); // -1 for the horizon
    const line = add(group, "label");
    symbol(line, name);
    const [min, max, step] = data.ranges[name];
    const input = add(line, "input", { type: "range", min, max, step, "aria-label": words.sliders[name] });
    const value = add(line, "span", { class: "value" });
    input.addEventListener("input", () => {
      const number = Number(input.value);
      move(k < 0 ? { horizon: number } : { theta: read().theta.with(k, number) });
    });
    return ({ theta, horizon }) => {
      input.value = k < 0 ? horizon : theta[k];
      value.textContent = words.number(name, k < 0 ? horizon : theta[k]);
      set(input, { "aria-valuetext": value.textContent });
    };
  }

  function sliders(parent, data, read, move) {
    const row = add(parent, "div", { class: "groups" });
    const all = Object.entries(words.groups).flatMap(([legend, names]) => {
      const group = add(row, "fieldset");
      add(group, "legend", {}, legend);
      return names.map((name) => slider(group, name, data, read, move));
    });
    return (given) => all.forEach((draw) => draw(given));
  }

  // A screen reader is given the results once nothing changes any more.
  function results(parent) {
    const all = add(parent, "div", { class: "results", role: "status" });
    let quiet = 0;
    return (lines) => {
      set(all, { "aria-busy": true });
      all.replaceChildren();
      for (const words of lines) {
        const line = add(all, "p");
        words.forEach((text, k) => {
          line.append(k && !text.startsWith(";") ? " " : "");
          if (k % 2) add(line, "b", {}, text);
          else line.append(text);
        });
      }
      clearTimeout(quiet);
      quiet = setTimeout(() => set(all, { "aria-busy": false }), QUIET);
    };
  }

  function questions(parent, reset) {
    const last = add(parent, "div", { class: "last" });
    const line = add(last, "p");
    for (const text of words.questions) {
      if (text in words.symbols) symbol(line, text);
      else line.append(text === "?" ? text : ` ${text} `);
    }
    add(last, "button", { type: "button" }, words.reset).addEventListener("click", reset);
  }

  async function start(figure) {
    figure.hidden = false;
    figure.querySelector("p").remove();
    const data = JSON.parse(figure.querySelector("script").textContent);
    let rollout;
    try {
      ({ rollout } = await solver(window.nmpcrl.module, data.problem));
    } catch { // no WebAssembly, or a page that forbids it
      add(figure, "p", {}, words.none);
      return;
    }
    const begin = { start: data.start, theta: data.theta, horizon: data.horizon, discs: data.problem.discs };
    let given = begin, due = false;
    const read = () => given;
    const move = (change) => {
      given = { ...given, ...change };
      if (!due) requestAnimationFrame(show);
      due = true;
    };

    set(figure, { "aria-label": words.map });
    add(figure, "p", { class: "title" }, words.title);
    add(figure, "p", { class: "hint" }, words.hint);
    const map = plane(figure, data.view, words.handles);
    background(map, data);
    const parts = [
      obstacles(map, data, read, move),
      robot(map, data, read, move),
      arrow(map, read, move),
      trajectories(map, data, rollout(begin, data.steps)),
    ];
    add(figure, "p", { class: "legend" }, words.legend(data.steps));
    const tell = results(figure);
    parts.push(sliders(figure, data, read, move));
    questions(figure, () => move(begin));

    function show() {
      due = false;
      const found = rollout(given, data.steps);
      if (found.plan) found.parts = shares(given, found.plan);
      tell(found.failed ? [[words.failed(found.states.length)]] : words.results(found));
      for (const draw of parts) draw(given, found);
      figure.shown = { given, found }; // for whoever asks; tests do
    }
    show();
  }

  for (const figure of document.querySelectorAll("figure.live[data-figure=controller][hidden]")) start(figure);
})();
