// The live figure of the gradient and its kink: the envelope theorem beside finite differences, and a walk of the robot over
// the boundary of the nearest obstacle, where the slope in theta_c jumps.
(() => {
  "use strict";

  const {
    add, set, plane, mapParts, slider, button, chart, extent, numbers: { clamp, fixed, sized, power }, parts: shared,
  } = window.nmpcrl;
  const LEAST = -2, DECADES = 6; // of a bar, which is logarithmic
  const IDLE = 120; // after the last change, before the curve of all steps is computed [ms]
  const REACH = 0.1; // of the walk, on either side of the boundary [m]
  const BESIDE = 3e-6; // how far beside the boundary its two slopes are read [m]
  const PLACES = 16; // of the walk, on either side
  const C = 8; // theta_c in theta
  const norm = (vector) => Math.hypot(...vector);

  function scientific(number) {
    const exponent = Math.floor(Math.log10(number) + 1e-9), factor = fixed(number / 10 ** exponent, 1);
    return (factor === "1.0" ? "" : `${factor} · `) + power(exponent);
  }

  // ---- Finite differences

  // V with one component of theta moved, all nine in turn; null if one cannot be solved.
  function moved(nmpc, given, h) {
    const plans = given.theta.map((each, k) => nmpc.solve({ ...given, theta: given.theta.with(k, each + h) }));
    return plans.every(Boolean) ? plans.map(({ value }) => value) : null;
  }

  function differences(nmpc, given, { value, features }, h) {
    const above = moved(nmpc, given, h), below = moved(nmpc, given, -h);
    if (!above || !below) return null;
    const central = above.map((each, k) => (each - below[k]) / (2 * h)), forward = above.map((each) => (each - value) / h);
    const error = (gradient) => norm(gradient.map((each, k) => each - features[k])) / norm(features);
    return { step: h, central, forward, errors: { central: error(central), forward: error(forward) } };
  }

  // ---- The walk

  // The nearest boundary: the way outwards from its obstacle's centre through the robot, and where on it the robot is,
  // negative inside. A plan keeps Xi + theta_c <= 0, by Eq. (19).
  function nearest({ start: [x, y], theta, discs }) {
    const all = discs.map(([cx, cy, clearance], k) => {
      const away = Math.hypot(x - cx, y - cy), radius = (clearance / 2) * Math.sqrt(Math.max(0, 1 + theta[C]));
      const out = away > 0 ? [(x - cx) / away, (y - cy) / away] : [1, 0];
      return { number: k + 1, centre: [cx, cy], out, radius, offset: away - radius };
    });
    return all.reduce((best, each) => (each.offset < best.offset ? each : best));
  }

  const placed = ({ centre, out, radius }, offset) => centre.map((c, k) => c + (radius + offset) * out[k]);

  function walkOver(nmpc, asked, boundary) {
    const at = (offset) => {
      const plan = nmpc.solve({ ...asked, state: [...placed(boundary, offset), asked.state[2]] });
      return plan && { offset, value: plan.value, slope: plan.features[C] };
    };
    const side = (sign) => Array.from({ length: PLACES + 1 }, (_, k) => (
      at(sign * (k ? (REACH * k) / PLACES : BESIDE))
    )).filter(Boolean);
    return { inside: side(-1).reverse(), outside: side(1) };
  }

  // ---- The figure

  function bars(parent, { names }) {
    const rows = names.map((name) => {
      const row = add(parent, "div", { class: "component" });
      shared.symbol(row, name);
      const pair = add(row, "div", { class: "pair", "aria-hidden": true });
      const both = { envelope: add(pair, "i", { class: "envelope" }), difference: add(pair, "i", { class: "difference" }) };
      return { both, number: add(row, "span", { class: "numbers" }) };
    });
    const share = (number) => clamp((Math.log10(Math.max(number, 1e-300)) - LEAST) / DECADES, 0, 1);
    return (_, { plan, chosen }) => rows.forEach(({ both, number }, k) => {
      const numbers = { envelope: plan?.features[k] ?? 0, difference: chosen?.central[k] ?? 0 };
      for (const [kind, bar] of Object.entries(both)) bar.style.width = `${100 * share(numbers[kind])}%`;
      number.textContent = `${fixed(numbers.envelope, 3)} | ${fixed(numbers.difference, 3)}`;
    });
  }

  function errors(parent, steps) {
    const { draw } = chart(parent, {
      label: "Distance of finite differences to the envelope gradient, relative, against their step",
      title: "Distance of finite differences to the gradient: dashed forward, solid central",
    });
    return (_, { chosen, all }) => {
      const known = (all ?? [chosen]).filter(Boolean), kinds = { forward: "6 4", central: "" };
      const points = (kind) => known.map((found) => [found.step, Math.max(found.errors[kind], 1e-14)]);
      draw({
        x: [steps[0], steps.at(-1)], y: [1e-10, 1], logs: "xy", across: "step h (no unit)",
        lines: Object.entries(kinds).map(([kind, dashes]) => ({ points: points(kind), dashes, look: kind })),
        dots: chosen ? Object.keys(kinds).map((kind) => [chosen.step, chosen.errors[kind]]) : [],
      });
    };
  }

  function slopes(parent) {
    const { draw } = chart(parent, {
      label: "The slope of the value in theta c along a walk over the nearest boundary",
      title: "Slope of V in θc on the way over the nearest boundary",
    });
    return (_, { plan, boundary, inside, outside }) => {
      const line = (look, side) => ({ look, points: side.map((each) => [each.offset, each.slope]) });
      const near = plan && Math.abs(boundary.offset) <= REACH;
      draw({
        x: [-REACH, REACH], y: extent([...inside, ...outside].map(({ slope }) => slope)), across: "d, from inside to outside [m]",
        lines: [line("central", inside), line("forward", outside)], cursor: 0,
        dots: near ? [[boundary.offset, plan.features[C]]] : [],
      });
    };
  }

  function sliders(parent, { steps }, read, move) {
    const row = add(parent, "div", { class: "groups wide" });
    const step = { name: "h", label: "h, step of the finite differences", range: [0, steps.length - 1, 1], text: (k) => scientific(steps[k]) };
    const walk = {
      name: "walk", label: "d, distance of the robot from the nearest boundary, negative inside", range: [-100, 100, 5],
      text: (millimetres) => `${fixed(millimetres, 0)} mm`,
    };
    const all = [
      slider(row, step, { read: (given) => given.step, write: (k) => move({ step: k }) }),
      slider(row, walk, {
        read: (given) => Math.round(1000 * nearest(given).offset),
        write: (millimetres) => move({ start: [...placed(nearest(read()), millimetres / 1000), read().start[2]] }),
      }),
    ];
    return (given) => all.forEach((draw) => draw(given));
  }

  function results({ plan, chosen: { step, errors: apart }, boundary: { number, offset }, inside, outside, jump }) {
    const distance = fixed(1000 * Math.abs(offset), 1), side = offset < 0 ? "inside" : "outside";
    const lines = [
      [
        `With h = ${scientific(step)}, central differences (18 more solves) are`, scientific(apart.central),
        "from the envelope gradient; forward differences (9 more)", scientific(apart.forward),
      ],
      [
        "The robot is", distance === "0.0" ? "on" : `${distance} mm ${side}`, `the boundary of obstacle ${number}; dV/d{c} =`,
        fixed(plan.features[C], 2),
      ],
    ];
    if (Number.isFinite(jump)) lines[1].push("; just inside it is", fixed(inside.at(-1).slope, 2), "; just outside", fixed(outside[0].slope, 2), "; the jump is", fixed(jump, 2));
    return lines;
  }

  function build(figure, data, nmpc) {
    const begin = { start: data.start, theta: data.theta, discs: data.problem.discs, step: data.step };
    const { read, move } = shared.state(begin, show);
    shared.heading(figure, {
      label: "Map of the robot, its plan and the obstacles, the gradient of the value, and finite differences",
      title: "Try it: the gradient of V, and where it jumps.",
      hint: "Drag the robot, the tip of its arrow or an obstacle, or reach it with Tab and press the arrow keys; move the step "
        + "{h} of the differences; walk the robot with {walk} over the boundary of the nearest obstacle.",
    });
    const map = plane(figure, data.view, "What can be moved on the map");
    mapParts.background(map, data);
    const line = add(map.ground, "line", { class: "shaft" });
    const way = (_, { boundary }) => {
      const [from, to] = [-REACH, REACH].map((offset) => placed(boundary, offset));
      set(line, { x1: from[0], y1: from[1], x2: to[0], y2: to[1] });
    };
    const parts = [...mapParts.handles(map, data, read, move), mapParts.planned(map, data), way];
    parts.push(sliders(figure, data, read, move));
    const tell = shared.results(figure), row = add(figure, "div", { class: "columns" });
    parts.push(errors(row, data.steps), slopes(row), bars(add(figure, "div", { class: "rows" }), data));
    add(figure, "p", { class: "legend" }, "Bars: dV/dθ of each weight, logarithmic from 0.01 to 10 000; filled by the envelope theorem, "
      + "striped by central differences with step h; the numbers are in this order.");
    button(add(figure, "div", { class: "last" }), "Reset all", () => move(begin));

    let known = {}, idle = 0; // the curve, which only another step leaves as it is
    function curveOf({ start, discs }, at) {
      if (known.start !== start || known.discs !== discs) {
        known = { start, discs, all: null };
        clearTimeout(idle);
        idle = setTimeout(() => {
          known.all = data.steps.map(at);
          move({});
        }, IDLE);
      }
      return known.all;
    }

    function show(given) {
      const asked = { state: given.start, theta: given.theta, discs: given.discs, horizon: data.horizon };
      const plan = nmpc.solve(asked), boundary = nearest(given);
      const at = (h) => plan && differences(nmpc, asked, plan, h);
      const found = { plan, boundary, chosen: at(data.steps[given.step]), all: curveOf(given, at), ...walkOver(nmpc, asked, boundary) };
      found.jump = found.inside.at(-1)?.slope - found.outside[0]?.slope;
      tell(found.chosen ? results(found) : [["The solver found no plan here, or none beside it."]]);
      for (const draw of parts) draw(given, found);
      figure.shown = { given, found }; // for whoever asks; tests do
    }
    show(begin);
  }

  shared.begin("gradient", build);
})();
