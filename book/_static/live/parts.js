// What live figures share: how one begins, its map's parts, sliders, and the line of results.
//
// What can be moved is `given`, for example { start, theta, horizon, discs }. A part takes what it needs,
// calls `move(change)` when the reader moves something, and returns what draws it: (given, found) => {}.
(() => {
  "use strict";

  const { add, set, plane, solver, words: { parts: words } } = window.nmpcrl;
  const ARROW = 1.0; // from the robot to the handle of its heading [m]
  const TURN = Math.PI / 3.6; // by an arrow key, for each metre that it would move a place [rad]
  const QUIET = 500; // after the last change, before a screen reader speaks [ms]
  const TICKS = 2; // [m]
  const OWN_KEYS = { "data-lm-suppress-shortcuts": true }; // or JupyterLab takes the arrow keys for its own

  const clamp = (number, least, most) => Math.min(Math.max(number, least), most);
  const points = (places) => places.map(([x, y]) => `${x},${y}`).join(" ");

  // Begins every figure of a name: `build(figure, data, nmpc)` draws it.
  function begin(name, build) {
    const fresh = document.querySelectorAll(`figure.live[data-figure=${name}][hidden]`);
    for (const figure of fresh) start(figure, build);
  }

  const runs = () => Boolean(self.WebAssembly && self.DecompressionStream);

  async function start(figure, build) {
    figure.hidden = false;
    figure.addEventListener("focusin", ({ target }) => set(target, OWN_KEYS));
    figure.querySelector("p").remove();
    const data = JSON.parse(figure.querySelector("script").textContent);
    let nmpc;
    try {
      nmpc = await solver(window.nmpcrl.module, data.problem);
    } catch (error) { // without WebAssembly, or in a page that forbids it
      if (runs() && !(error instanceof WebAssembly.CompileError)) throw error;
      add(figure, "p", {}, words.none);
      return;
    }
    build(figure, data, nmpc);
  }

  // What is given now, and what changes it; `show(given)` follows with the next frame.
  function state(given, show) {
    let due = false;
    const next = () => {
      due = false;
      show(given);
    };
    const move = (change) => {
      given = { ...given, ...change };
      if (!due) requestAnimationFrame(next);
      due = true;
    };
    return { read: () => given, move };
  }

  function heading(figure, { map, title, hint }) {
    set(figure, { "aria-label": map });
    add(figure, "p", { class: "title" }, title);
    add(figure, "p", { class: "hint" }, hint);
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

  function planned(map, { problem: { target: [x, y] } }) {
    const line = add(map.ground, "polyline", { class: "plan" });
    const dots = add(map.ground, "g", { class: "dots" });
    add(map.ground, "circle", { class: "target", cx: x, cy: y });
    map.write(words.target, x, y, { class: "name" });
    return (_, { plan }) => {
      const states = plan?.states ?? [];
      set(line, { points: points(states) });
      dots.replaceChildren();
      for (const [cx, cy] of states) add(dots, "circle", { cx, cy });
    };
  }

  function symbol(parent, name) {
    const [letter, ...subscripts] = words.symbols[name];
    const whole = add(parent, "span", { class: "symbol" }, letter);
    subscripts.reduce((above, text) => add(above, "sub", {}, text), whole);
  }

  // A finger that scrolls the page may begin on a slider, and leaves it as it was: the browser cancels its pointer.
  function keptWhileScrolling(input, moved) {
    let before = input.value;
    input.addEventListener("pointerdown", () => {
      before = input.value;
    });
    input.addEventListener("pointercancel", () => {
      input.value = before;
      moved();
    });
  }

  // A text in which {c} stands for the symbol of c.
  function write(parent, text) {
    text.split(/[{}]/).forEach((piece, k) => (k % 2 ? symbol(parent, piece) : parent.append(piece)));
  }

  // A line of a group: a symbol, a range and its number. `given` is moved by `write(number)`.
  function slider(group, { name, label, range: [min, max, step], text }, { read, write }) {
    const line = add(group, "label");
    symbol(line, name);
    const input = add(line, "input", { type: "range", min, max, step, "aria-label": label });
    const value = add(line, "span", { class: "value" });
    const moved = () => write(Number(input.value));
    input.addEventListener("input", moved);
    keptWhileScrolling(input, moved);
    return (given) => {
      const number = read(given);
      input.value = number;
      value.textContent = text(number);
      set(input, { "aria-valuetext": value.textContent });
    };
  }

  // The slider of a component of theta, by its name.
  function weight(group, name, { names, ranges }, read, move) {
    const k = names.indexOf(name);
    const text = (number) => words.fixed(number, 3);
    return slider(group, { name, label: words.sliders[name], range: ranges[name], text }, {
      read: ({ theta }) => theta[k],
      write: (number) => move({ theta: read().theta.with(k, number) }),
    });
  }

  // Lines of texts and numbers in turn. A screen reader is given them once nothing changes any more.
  function results(parent) {
    const all = add(parent, "div", { class: "results", role: "status" });
    let quiet = 0;
    return (lines) => {
      set(all, { "aria-busy": true });
      all.replaceChildren();
      for (const texts of lines) {
        const line = add(all, "p");
        texts.forEach((text, k) => {
          line.append(k && !text.startsWith(";") ? " " : "");
          write(k % 2 ? add(line, "b") : line, text);
        });
      }
      clearTimeout(quiet);
      quiet = setTimeout(() => set(all, { "aria-busy": false }), QUIET);
    };
  }

  function button(parent, text, press) {
    const element = add(parent, "button", { type: "button" }, text);
    element.addEventListener("click", press);
    return element;
  }

  window.nmpcrl.parts = {
    clamp, points, begin, state, heading, background, obstacles, robot, arrow, planned, symbol, write, slider, weight,
    results, button,
  };
})();
