// The map in metres with y upwards: handles that pointer, click and keys move, obstacles, the robot, its target, its plan.
(() => {
  "use strict";

  const { add, set, numbers: { clamp, points, fixed } } = window.nmpcrl;
  const ARROW = 1.0; // from the robot to the handle of its heading [m]
  const TURN = Math.PI / 3.6; // by an arrow key, for each metre that it would move a place [rad]
  const TICKS = 2; // [m]
  const STEP = { plain: 0.1, large: 0.5 }; // of an arrow key [m]
  const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

  const place = (x, y) => `x ${fixed(x, 2)} m, y ${fixed(y, 2)} m`;
  const obstacle = (number) => `Obstacle ${number}`;
  const tick = (metres, last) => fixed(metres, 0) + (last ? " m" : "");

  // `view` is [least x, least y, width, height].
  function plane(parent, view, label) {
    const [left, bottom, width, height] = view;
    const svg = add(parent, "svg", {
      viewBox: `${left} ${-bottom - height} ${width} ${height}`, role: "group", "aria-label": label,
    });
    const ground = add(svg, "g", { transform: "scale(1 -1)" });
    let chosen = null; // what has the focus, which a click on the ground moves

    const inside = ([x, y]) => [clamp(x, left, left + width), clamp(y, bottom, bottom + height)];
    const under = (event) => {
      const { x, y } = new DOMPoint(event.clientX, event.clientY)
        .matrixTransform(ground.getScreenCTM().inverse());
      return inside([x, y]);
    };
    const onGround = (event) => !event.target.closest(".handle");
    svg.addEventListener("mousedown", (event) => { // or the focus would be lost
      if (onGround(event)) event.preventDefault();
    });
    svg.addEventListener("click", (event) => {
      if (chosen && onGround(event)) chosen.to(under(event));
    });
    new ResizeObserver(() => { // letters and targets of a finger keep their size in pixels
      if (svg.clientWidth) svg.style.setProperty("--px", width / svg.clientWidth);
    }).observe(svg);

    // A text beside a point, which is not upside down.
    function write(text, x, y, attributes) {
      add(svg, "text", { x, y: -y, ...attributes }, text);
    }

    // Something to move: `to(point)` puts it somewhere, `by(dx, dy)` is an arrow key's step.
    function handle({ label: name, kind, range, to, by }) {
      const group = add(ground, "g", {
        class: `handle ${kind}`, role: "slider", tabindex: 0, "aria-label": name,
        "aria-valuemin": range[0].toFixed(2), "aria-valuemax": range[1].toFixed(2),
      });
      const body = add(group, "g");
      add(group, "circle", { class: "reach" });
      let grip = null; // from the pointer to the middle
      let middle = [0, 0];
      group.addEventListener("focus", () => { chosen = { to }; });
      group.addEventListener("blur", () => { chosen = null; });
      group.addEventListener("pointerdown", (event) => {
        const [x, y] = under(event);
        grip = [middle[0] - x, middle[1] - y];
        group.setPointerCapture(event.pointerId);
        group.focus({ preventScroll: true });
        event.preventDefault();
      });
      group.addEventListener("pointermove", (event) => {
        if (!grip) return;
        const [x, y] = under(event);
        to([x + grip[0], y + grip[1]]);
      });
      const drop = () => { grip = null; };
      group.addEventListener("pointerup", drop);
      group.addEventListener("pointercancel", drop);
      group.addEventListener("keydown", (event) => {
        const arrow = ARROWS[event.key];
        if (!arrow || event.altKey || event.ctrlKey || event.metaKey) return;
        const step = event.shiftKey ? STEP.large : STEP.plain;
        by(arrow[0] * step, arrow[1] * step);
        event.preventDefault();
        event.stopPropagation();
      });
      const put = (point, now, text) => {
        middle = point;
        set(group, {
          transform: `translate(${point[0]} ${point[1]})`, "aria-valuenow": now.toFixed(2), "aria-valuetext": text,
        });
      };
      return { body, put };
    }

    return { ground, range: [left, left + width], inside, write, handle };
  }

  function background(map, { view: [left, bottom, width, height], box: [lower, upper] }) {
    const [x, y] = lower;
    add(map.ground, "rect", { class: "box", x, y, width: upper[0] - x, height: upper[1] - y });
    const ticks = (from, to) => Array.from({ length: Math.ceil((to - from) / TICKS) }, (_, k) => from + TICKS * k);
    const first = (from) => Math.ceil(from / TICKS) * TICKS;
    for (const each of ticks(first(left + 0.6), left + width)) {
      map.write(tick(each, each + TICKS >= left + width), each, bottom, { class: "x tick" });
    }
    for (const each of ticks(first(bottom + 0.6), bottom + height)) {
      map.write(tick(each, each + TICKS >= bottom + height), left, each, { class: "y tick" });
    }
  }

  function obstacles(map, { problem, radii }, read, move) {
    const handles = radii.map((radius, k) => {
      const to = (point) => {
        const [, , clearance] = read().discs[k];
        move({ discs: read().discs.with(k, [...map.inside(point), clearance]) });
      };
      const by = (dx, dy) => to([read().discs[k][0] + dx, read().discs[k][1] + dy]);
      const handle = map.handle({ label: obstacle(k + 1), kind: "obstacle", range: map.range, to, by });
      add(handle.body, "circle", { class: "safety", r: problem.discs[k][2] / 2 });
      add(handle.body, "circle", { class: "disc", r: radius });
      return handle;
    });
    return ({ discs }) => discs.forEach(([x, y], k) => handles[k].put([x, y], x, place(x, y)));
  }

  function robot(map, { robot: radius, box: [lower, upper] }, read, move) {
    const to = (point) => {
      const [x, y] = map.inside(point);
      move({ start: [clamp(x, lower[0], upper[0]), clamp(y, lower[1], upper[1]), read().start[2]] });
    };
    const by = (dx, dy) => to([read().start[0] + dx, read().start[1] + dy]);
    const handle = map.handle({ label: "Robot, start", kind: "robot", range: map.range, to, by });
    add(handle.body, "circle", { class: "disc", r: radius });
    return ({ start: [x, y] }) => handle.put([x, y], x, place(x, y));
  }

  function arrow(map, read, move, label = "Robot, heading") {
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
      handle.put(end, heading, `${fixed((heading * 180) / Math.PI, 0)} degrees`);
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
    map.write("target", x, y, { class: "name" });
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

  window.nmpcrl = { ...window.nmpcrl, plane, mapParts: { background, handles, robot, arrow, circles, target, planned, place, obstacle } };
})();
