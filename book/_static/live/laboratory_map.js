// The laboratory's map: obstacles that come and go, the robot's start, its target, closed loops, and robots that drive them.
(() => {
  "use strict";

  const { add, set, plane, mapParts, parts: shared, words: { parts: common, laboratory: words } } = window.nmpcrl;
  const { clamp, points } = shared;
  const GRID = 100; // places of a metre, and of a radian: short numbers in links and commands

  const onGrid = (number) => Math.round(number * GRID) / GRID + 0; // no -0
  const gridded = (numbers) => numbers.map(onGrid);

  // As many handles as there may be obstacles; those that are not there are not shown.
  function obstacles(map, { most, radius, clearance }, read, move) {
    const handles = Array.from({ length: most }, (_, k) => {
      const to = (point) => move({ layout: read().layout.with(k, gridded(map.inside(point))) });
      const by = (dx, dy) => to([read().layout[k][0] + dx, read().layout[k][1] + dy]);
      const handle = map.handle({ label: common.obstacle(k + 1), kind: "obstacle", range: map.range, to, by });
      const safety = add(handle.body, "circle", { class: "safety" });
      add(handle.body, "circle", { class: "disc", r: radius });
      const group = handle.body.parentNode;
      group.addEventListener("keydown", (event) => {
        if (event.key !== "Delete" && event.key !== "Backspace") return;
        event.preventDefault();
        if (read().layout.length === 1) return;
        move({ layout: read().layout.toSpliced(k, 1) });
        handles[Math.max(0, k - 1)].group.focus({ preventScroll: true });
      });
      return { ...handle, group, safety };
    });
    return ({ layout }, { thetaC }) => handles.forEach(({ group, put, safety }, k) => {
      group.style.display = k < layout.length ? "" : "none";
      set(safety, { r: (clearance / 2) * Math.sqrt(Math.max(0, 1 + thetaC)) }); // where Xi + theta_c = 0
      if (k < layout.length) put(layout[k], layout[k][0], common.place(...layout[k]));
    });
  }

  // Start or target: a handle for its place, and one for its heading.
  function pose(map, { robot, box: [lower, upper] }, name, { kind, label, turned }, read, move) {
    const to = ([x, y]) => {
      const place = gridded([clamp(x, lower[0], upper[0]), clamp(y, lower[1], upper[1])]);
      move({ [name]: [...place, read()[name][2]] });
    };
    const by = (dx, dy) => to([read()[name][0] + dx, read()[name][1] + dy]);
    const handle = map.handle({ label, kind, range: map.range, to, by });
    add(handle.body, "circle", { class: "disc", r: robot });
    const turn = ({ start }) => move({ [name]: [...start.slice(0, 2), onGrid(start[2])] });
    const arrow = mapParts.arrow(map, () => ({ start: read()[name] }), turn, turned);
    return (given) => {
      const [x, y] = given[name];
      handle.put([x, y], x, common.place(x, y));
      arrow({ start: given[name] });
    };
  }

  // Each a closed loop with its robot, that of theta at the start, that of a run laid over, and the one that is shown.
  function trajectories(map, { robot }) {
    const kinds = ["before", "over", "loop"];
    const lines = Object.fromEntries(kinds.map((kind) => [kind, add(map.ground, "polyline", { class: kind })]));
    const plan = add(map.ground, "polyline", { class: "plan" });
    const robots = Object.fromEntries(kinds.map((kind) => [kind, add(map.ground, "g", { class: `driven ${kind}` })]));
    for (const each of Object.values(robots)) {
      add(each, "circle", { r: robot });
      add(each, "line", { x1: 0, y1: 0, x2: robot, y2: 0 });
    }
    return (_, { first, last, over, colors, time }) => {
      const loops = { before: last && first, over, loop: last ?? first };
      set(plan, { points: points(loops.loop.plan?.states ?? []) });
      for (const kind of kinds) {
        const states = loops[kind]?.states ?? [], [x, y, heading] = states[Math.min(time, states.length - 1)] ?? [];
        set(lines[kind], { points: points(states) });
        robots[kind].style.display = states.length ? "" : "none";
        set(robots[kind], { transform: `translate(${x ?? 0} ${y ?? 0}) rotate(${((heading ?? 0) * 180) / Math.PI})` });
        for (const each of [lines[kind], robots[kind]]) each.style.setProperty("--look", colors[kind] ?? "");
      }
    };
  }

  // Somewhere on the map where no obstacle is: the farthest of some places from all others.
  function free({ layout, start, target }, [lower, upper]) {
    const others = [...layout, start, target];
    const away = ([x, y]) => Math.min(...others.map(([a, b]) => Math.hypot(x - a, y - b)));
    const places = Array.from({ length: 100 }, (_, k) => [
      onGrid(lower[0] + ((k % 10) + 0.5) * (upper[0] - lower[0]) / 10),
      onGrid(lower[1] + (Math.floor(k / 10) + 0.5) * (upper[1] - lower[1]) / 10),
    ]).filter(([, y]) => Math.abs(y - (start[1] + target[1]) / 2) < 4);
    return places.reduce((best, place) => (away(place) > away(best) ? place : best));
  }

  function buttons(parent, data, read, move, restore) {
    const row = add(parent, "div", { class: "buttons" });
    const more = shared.button(row, words.add, () => {
      if (read().layout.length < data.most) move({ layout: [...read().layout, free(read(), data.box)] });
    });
    const less = shared.button(row, words.remove, () => {
      if (read().layout.length > 1) move({ layout: read().layout.slice(0, -1) });
    });
    shared.button(row, words.reset, restore);
    return ({ layout }) => {
      set(more, { "aria-disabled": layout.length === data.most });
      set(less, { "aria-disabled": layout.length === 1 });
    };
  }

  // What draws the map: (given, { first, last, over, colors, time, thetaC }), rollouts of which the last two may be
  // null, with their colours, the step at which their robots are, and what the circles show.
  function laboratoryMap(side, data, read, move) {
    const map = plane(side, data.view, words.handles);
    mapParts.background(map, data);
    const start = { kind: "robot", label: common.robot, turned: common.heading };
    const target = { kind: "goal", label: words.target, turned: words.targetHeading };
    const parts = [
      obstacles(map, data, read, move),
      pose(map, data, "target", target, read, move),
      pose(map, data, "start", start, read, move),
      trajectories(map, data),
    ];
    return (given, found) => parts.forEach((draw) => draw(given, found));
  }

  window.nmpcrl = { ...window.nmpcrl, laboratoryMap, mapButtons: buttons };
})();
