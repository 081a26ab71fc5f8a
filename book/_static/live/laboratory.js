// The laboratory: place obstacles, choose a learner, train it here, and take the settings along as a link or a command.
//
// What the reader sets is `given`: { learner, alpha, beta, beta_tdc, zeta, decay, decay_rate, horizon, seed, episodes, layout,
// start, target, theta }, under the names of `Experiment`; `layout` holds centres [m].
(() => {
  "use strict";

  const {
    add, set, plane, mapParts, button, chart, extent, trainer, numbers: { clamp, points, fixed }, parts: shared,
  } = window.nmpcrl;
  const BASELINE = "frozen", POSES = ["start", "target"], TURN = 2 * Math.PI; // a heading, to either side [rad]
  const GRID = 100; // places of a metre, and of a radian: short numbers in links and commands
  const SEEDS = 3; // further ones at a click
  const OFTEN = 100; // between two pictures of what is being trained [ms]
  const QUIET = 400; // after the last change, before the address changes [ms]
  const NAMED = 4; // components of theta with a name in their chart
  const NAMES = {
    learner: "Learner", alpha: "Step size α", beta: "Step size β", beta_tdc: "Step size β", zeta: "Learning rate ζ",
    decay: "Decay per", decay_rate: "Decay factor c", horizon: "Horizon N", seed: "Seed", episodes: "Episodes", theta_c: "{c} at the start",
  };
  const LEARNERS = {
    ES: "ES: Expected Sarsa", DES: "DES: network of (s, a)", RDES: "RDES: network of (s, a, θ)", GES: "GES: gradient Expected Sarsa",
    TDC: "TDC: exact gradient TD", QL: "QL: Q-learning", frozen: "no learning: θ never moves",
  };
  const CHARTS = {
    judged: "Cost without noise", cost: "Cost of a training episode", theta: "θ of the chosen run", value: "V and discounted cost of the start",
    delta: "TD error, root mean square", step: "Largest α‖φ‖² (limit: 2)",
  };
  const DIVERGED = "diverged: θ left the numbers that a solver is given, or ten episodes in a row ended in a failed solve";

  // ---- Settings, and the link that restores them

  function defaults({ fields, layouts, start, target, theta }) {
    return { ...Object.fromEntries(fields.map((one) => [one.name, one.default])), layout: layouts.A, start, target, theta };
  }

  // The value that a text stands for; undefined if it may not be that.
  function parsed(text, { choices, least, most, whole }) {
    if (choices) return choices.includes(text) ? text : undefined;
    const number = Number(text);
    return text.trim() !== "" && number >= least && number <= most && (!whole || Number.isInteger(number)) ? number : undefined;
  }

  const allowed = ({ name, choices, least, most, whole }) => (choices ? `one of ${choices.join(", ")}`
    : `a ${whole ? "whole " : ""}number ${least > 0 && least < 1e-300 ? "above 0 and at most" : `from ${least} to`} ${most}`);

  // The layout, a pose or theta of a link; undefined if it is none.
  function place(name, text, { most, view: [left, bottom, width, height], box, theta, limits }) {
    const rows = text.split(";").map((row) => row.split(",").map((word) => (word.trim() ? Number(word) : NaN))), [first] = rows;
    const within = ([x, y], [low, high]) => x >= low[0] && x <= high[0] && y >= low[1] && y <= high[1];
    if (!rows.flat().every(Number.isFinite)) return undefined;
    if (name === "layout") {
      const map = [[left, bottom], [left + width, bottom + height]];
      return rows.length <= most && rows.every((row) => row.length === 2 && within(row, map)) ? rows : undefined;
    }
    if (name === "theta") return first.length === theta.length && first.every((one) => Math.abs(one) <= limits.absurd) ? first : undefined;
    return first.length === 3 && within(first, box) && Math.abs(first[2]) <= TURN ? first : undefined;
  }

  // What a link's fragment says; the sentence of what makes no sense; null if it is no link of ours.
  function linked(fragment, data) {
    if (!fragment.includes("=")) return null;
    const given = defaults(data);
    for (const [name, text] of new URLSearchParams(fragment.replaceAll("+", "%2B"))) {
      const field = data.fields.find((one) => one.name === name), known = field || ["layout", "theta", ...POSES].includes(name);
      const value = field ? parsed(text, field) : known ? place(name, text, data) : undefined;
      if (value === undefined) return `This link is not read, and what is set stays: it says “${name}=${text.slice(0, 60)}”. `
        + (field ? `Allowed is ${allowed(field)}.` : known ? "The numbers do not fit the map." : "No setting has this name.");
      given[name] = value;
    }
    return given;
  }

  const fragmentOf = (given, data) => [
    ...data.fields.map(({ name }) => `${name}=${given[name]}`), `layout=${given.layout.join(";")}`, ...POSES.map((name) => `${name}=${given[name]}`),
    ...(String(given.theta) === String(data.theta) ? [] : [`theta=${given.theta}`]),
  ].join("&");

  // What differs from the defaults and is read by the learner, by name.
  function changed(given, data) {
    const before = defaults(data), read = data.fields.filter((one) => one.read_by.includes(given.learner) || one.name === "learner");
    return [...read.map(({ name }) => name), "layout", ...POSES, "theta"].filter((name) => String(given[name]) !== String(before[name]));
  }

  // The same settings as a command of the library.
  function command(given, data) {
    const letter = Object.keys(data.layouts).find((name) => String(data.layouts[name]) === String(given.layout));
    const options = changed(given, data).map((name) => {
      const value = name === "layout" ? letter ?? `"${given.layout.join(" ")}"` : given[name];
      return ` \\\n  --${name.replaceAll("_", "-")} ${value}`;
    });
    return `nmpcrl train${options.join("")}`;
  }

  // ---- The map

  const gridded = (numbers) => numbers.map((number) => Math.round(number * GRID) / GRID + 0); // no -0

  // As many handles as there may be obstacles; those that are not there are not shown.
  function obstacles(map, { most, radius, clearance }, read, move) {
    const handles = Array.from({ length: most }, (_, k) => {
      const to = (point) => move({ layout: read().layout.with(k, gridded(map.inside(point))) });
      const by = (dx, dy) => to([read().layout[k][0] + dx, read().layout[k][1] + dy]);
      const handle = map.handle({ label: mapParts.obstacle(k + 1), kind: "obstacle", range: map.range, to, by });
      const safety = add(handle.body, "circle", { class: "safety" }), group = handle.body.parentNode;
      add(handle.body, "circle", { class: "disc", r: radius });
      group.addEventListener("keydown", (event) => {
        if (!["Delete", "Backspace"].includes(event.key)) return;
        event.preventDefault();
        if (read().layout.length === 1) return;
        move({ layout: read().layout.toSpliced(k, 1) });
        handles[Math.max(0, k - 1)].group.focus({ preventScroll: true });
      });
      return { ...handle, group, safety };
    });
    return ({ layout }, { theta }) => handles.forEach(({ group, put, safety }, k) => {
      group.style.display = k < layout.length ? "" : "none";
      set(safety, { r: (clearance / 2) * Math.sqrt(Math.max(0, 1 + theta.at(-1))) }); // where Xi + theta_c = 0
      if (k < layout.length) put(layout[k], layout[k][0], mapParts.place(...layout[k]));
    });
  }

  // Start or target: a handle for its place, and one for its heading.
  function pose(map, { robot, box: [lower, upper] }, name, [kind, label, turned], read, move) {
    const to = ([x, y]) => move({ [name]: [...gridded([clamp(x, lower[0], upper[0]), clamp(y, lower[1], upper[1])]), read()[name][2]] });
    const by = (dx, dy) => to([read()[name][0] + dx, read()[name][1] + dy]);
    const handle = map.handle({ label, kind, range: map.range, to, by });
    add(handle.body, "circle", { class: "disc", r: robot });
    const turn = ({ start }) => move({ [name]: [...start.slice(0, 2), ...gridded(start.slice(2))] });
    const arrow = mapParts.arrow(map, () => ({ start: read()[name] }), turn, turned);
    return (given) => {
      const [x, y] = given[name];
      handle.put([x, y], x, mapParts.place(x, y));
      arrow({ start: given[name] });
    };
  }

  function trajectories(map) {
    const [before, loop, plan] = ["before", "loop", "plan"].map((kind) => add(map.ground, "polyline", { class: kind }));
    return (_, { first, last, color }) => {
      set(before, { points: points(last ? first.states : []) });
      set(loop, { points: points((last ?? first).states) });
      loop.style.setProperty("--look", color);
      set(plan, { points: points((last ?? first).plan?.states ?? []) });
    };
  }

  // Somewhere on the map where no obstacle is: the farthest of some places from all others.
  function free({ layout, start, target }, [lower, upper]) {
    const away = ([x, y]) => Math.min(...[...layout, start, target].map(([a, b]) => Math.hypot(x - a, y - b)));
    const tenth = (k, low, high) => low + ((k + 0.5) * (high - low)) / 10;
    const all = Array.from({ length: 100 }, (_, k) => gridded([tenth(k % 10, lower[0], upper[0]), tenth(Math.floor(k / 10), lower[1], upper[1])]));
    const near = all.filter(([, y]) => Math.abs(y - (start[1] + target[1]) / 2) < 4);
    return near.reduce((best, one) => (away(one) > away(best) ? one : best));
  }

  // ---- The form: a number that is refused stays in its field, with a sentence, and changes nothing

  function form(parent, data, read, move, tell) {
    const grid = add(parent, "div", { class: "fields" });
    const thetaC = { name: "theta_c", least: data.theta_set[0], most: data.theta_set[1], read_by: data.fields[0].choices };
    const rows = [...data.fields, thetaC].map((field) => {
      const { name, choices } = field, line = add(grid, "label", { class: "field" });
      shared.write(add(line, "span"), NAMES[name]);
      const input = add(line, choices ? "select" : "input", { "aria-label": NAMES[name].replace("{c}", "theta c"), ...(choices ? {} : { inputmode: "decimal", autocomplete: "off" }) });
      for (const one of choices ?? []) add(input, "option", { value: one }, name === "learner" ? LEARNERS[one] : one);
      input.addEventListener("change", () => {
        const value = parsed(input.value, field);
        set(input, { "aria-invalid": value === undefined });
        tell(value === undefined ? [[`${NAMES[name]}: ${allowed(field)}, please.`]] : []);
        if (value !== undefined) move(name === "theta_c" ? { theta: read().theta.with(-1, value) } : { [name]: value });
      });
      return { field, line, input };
    });
    return (given) => rows.forEach(({ field: { name, read_by: readBy }, line, input }) => {
      line.hidden = name !== "learner" && !readBy.includes(given.learner);
      if (input !== document.activeElement && input.getAttribute("aria-invalid") !== "true") input.value = name === "theta_c" ? given.theta.at(-1) : given[name];
    });
  }

  // ---- Runs: one after the other, each followed by the run without learning under the same noise

  function learned(given, data) {
    return {
      learner: given.learner, alpha: given.alpha, beta: given.learner === "TDC" ? given.beta_tdc : given.beta, zeta: given.zeta,
      decay: given.decay, decayRate: given.decay_rate, episodes: given.episodes, seed: given.seed, theta: given.theta,
      start: given.start, target: given.target, horizon: given.horizon, discs: given.layout.map((centre) => [...centre, data.clearance]),
      steps: data.steps, w: data.w, thetaSet: data.theta_set, evaluateEvery: data.evaluate_every, limits: data.limits,
      network: data.network, deviation: data.deviation,
    };
  }

  function queue(data, changes) {
    const baselines = new Map(), runs = []; // rows without learning, by what they depend on
    let doing = null, count = 0; // { run, rows, stop }

    function begin(run, settings, rows, end) {
      const row = (one) => {
        rows.push(one);
        changes();
      };
      doing = { run, rows, stop: trainer({ module: window.nmpcrl.module, problem: data.problem, settings }, { row, end }) };
    }

    function next() {
      doing = null;
      const run = runs.find(({ state }) => state === "waiting");
      changes();
      if (!run) return;
      run.state = "training";
      const settings = learned(run.given, data);
      begin(run, settings, run.rows, (why) => {
        run.state = why ? `this browser could not train: ${why}` : run.rows.at(-1).diverged ? DIVERGED : "";
        if (why) return next();
        const still = { ...settings, learner: BASELINE, alpha: 0, beta: 0, zeta: 0 }, same = JSON.stringify(still);
        if (run.given.learner === BASELINE) baselines.set(same, run.rows);
        const known = baselines.has(same);
        run.baseline = baselines.get(same) ?? [];
        baselines.set(same, run.baseline);
        return known ? next() : begin(run, still, run.baseline, next);
      });
    }

    function stop() {
      doing?.stop();
      doing = null;
      for (const run of runs) if (["training", "waiting"].includes(run.state)) run.state = "stopped";
      changes();
    }

    function addRun(given) {
      runs.push({ number: ++count, given, rows: [], baseline: [], state: "waiting" });
      if (!doing) next();
      return runs.at(-1);
    }

    function remove(run) {
      runs.splice(runs.indexOf(run), 1);
      if (doing?.run === run) doing.stop();
      if (doing?.run === run) next();
      changes();
    }
    return { runs, doing: () => doing, add: addRun, stop, remove };
  }

  const judged = (rows) => rows.filter((row) => row.judged);

  // How a run has done: its cost without noise at the end, the mean of the last rollouts, and at the start.
  function verdict({ rows, state }, { last }) {
    const [before, ...costs] = judged(rows).map(({ judged: { cost } }) => cost), ends = costs.slice(-last);
    const after = ends.reduce((sum, one) => sum + one, 0) / ends.length, share = 1 - after / before;
    const than = Math.abs(share) < 5e-4 ? "as at" : `${fixed(100 * Math.abs(share), 1)} % ${share > 0 ? "less than" : "more than"} at`;
    const said = state === "" && Number.isFinite(after) ? [`cost without noise ${fixed(after, 1)}, ${than} the start (${fixed(before, 1)})`] : [];
    return [...said, ...(state ? [state] : [])].join("; ");
  }

  function list(parent, data, name, { choose, remove }) {
    const all = add(parent, "ul", { class: "runs", "aria-label": "Runs" }), items = new Map();
    function item(run) {
      const line = add(all, "li"), label = add(line, "label"), input = add(label, "input", { type: "radio", name: "nmpcrl-run" });
      add(label, "span", { class: "swatch" }).style.setProperty("--look", data.looks[run.given.learner].color);
      add(label, "span", {}, name(run));
      input.addEventListener("change", () => choose(run));
      const found = add(line, "span", { class: "found" });
      set(button(line, "Remove", () => remove(run)), { "aria-label": `Remove ${name(run)}` });
      return { line, input, found };
    }
    return (runs, chosen) => {
      for (const [run, { line }] of items) {
        if (runs.includes(run)) continue;
        line.remove();
        items.delete(run);
      }
      for (const run of runs) {
        if (!items.has(run)) items.set(run, item(run));
        const { input, found } = items.get(run), text = verdict(run, data);
        input.checked = run === chosen;
        if (found.textContent !== text) found.textContent = text;
      }
    };
  }

  // ---- The curves: of the runs in the chosen one's place, for costs among other obstacles cannot be compared

  function curves(parent, data) {
    const none = add(parent, "p", { class: "hint" }, "Press Train: then six curves grow here with every episode.");
    const grid = add(parent, "div", { class: "plots" });
    const draw = Object.fromEntries(Object.entries(CHARTS).map(([name, label]) => [name, chart(grid, { label, height: 140, ticks: 3 }).draw]));
    const where = ({ given: { layout, start, target } }) => JSON.stringify([layout, start, target]);
    return (all, chosen) => {
      const runs = all.filter((run) => !chosen || where(run) === where(chosen)), looks = ({ given }) => data.looks[given.learner];
      [none.hidden, grid.hidden] = [Boolean(runs.length), !runs.length];
      const x = [0, Math.max(...runs.map(({ given }) => given.episodes), 1)], after = (rows) => rows.filter(({ episode }) => episode);
      const lines = (read, rows = after) => runs.map((run) => ({
        ...looks(run), name: [`${run.number}`], look: run === chosen ? "chosen" : "", points: rows(run.rows).map((row) => [row.episode, read(row)]),
      }));
      const content = (drawn, linear = false) => {
        const heights = drawn.flatMap(({ points: all }) => all.map(([, y]) => y)).filter(Number.isFinite), low = Math.min(...heights);
        const log = !linear && low > 0 && Math.max(...heights) > 20 * low;
        return { x, lines: drawn, logs: log ? "y" : "", y: log ? [0.9 * low, 1.1 * Math.max(...heights)] : extent(heights) };
      };
      const still = { ...data.looks[BASELINE], points: [] };
      const level = runs.flatMap(({ rows }) => judged(rows).slice(0, 1)).map(({ judged: { cost } }) => ({ ...still, points: x.map((at) => [at, cost]) }));
      draw.judged(content([...level, ...lines(({ judged: { cost } }) => cost, judged)]));
      const baselines = runs.map(({ baseline }) => ({ ...still, points: after(baseline).map(({ episode, cost }) => [episode, cost]) }));
      draw.cost(content([...baselines, ...lines(({ cost }) => cost)]));
      draw.delta(content(lines(({ delta }) => delta)));
      draw.step(content([{ look: "level", points: x.map((at) => [at, data.overshoot]) }, ...lines(({ alphaPhi2 }) => alphaPhi2)]));
      const known = chosen?.rows.filter(({ diverged }) => !diverged) ?? [], color = chosen ? looks(chosen).color : "";
      const moved = data.names.map((_, k) => Math.max(...known.map(({ theta }) => theta[k])) - Math.min(...known.map(({ theta }) => theta[k])));
      const most = [...moved].sort((a, b) => b - a)[NAMED - 1];
      draw.theta(content(data.names.map((name, k) => ({
        color, points: known.map(({ episode, theta }) => [episode, theta[k]]), pale: moved[k] < most || !moved[k],
        ...(moved[k] >= most && moved[k] > 0 ? { name: shared.SYMBOLS[name] } : {}),
      })), true));
      const worth = (name, dashes) => ({ color, dashes, name: [name === "value" ? "V" : "cost"], points: judged(known).map((row) => [row.episode, row.judged[name]]) });
      draw.value(content([worth("discounted", "2 3"), worth("value", "")], true));
    };
  }

  // ---- What is taken along: a text, with a button that copies it

  function copied(parent, title, name, tell) {
    add(parent, "p", { class: "caption" }, title);
    const box = add(parent, "textarea", { readonly: "", "aria-label": title, spellcheck: false, rows: 2 });
    button(parent, name, async () => {
      box.select();
      const done = Boolean(navigator.clipboard) && await navigator.clipboard.writeText(box.value).then(() => true, () => false);
      tell([[done ? "Copied." : "This browser does not copy; the text is selected."]]);
    });
    return (text) => {
      if (box.value === text) return;
      box.value = text;
      set(box, { rows: Math.max(2, text.split("\n").length) });
    };
  }

  function build(figure, data, nmpc) {
    const { read, move } = shared.state(defaults(data), show);
    let chosen = null, due = false, lines = [], found = null, later = 0;
    const runs = queue(data, () => {
      if (!due) setTimeout(() => { due = false; drawRuns(); }, OFTEN);
      due = true;
    });
    const touch = (change) => {
      lines = [];
      move(change);
    };
    const open = (given, run = null) => {
      for (const input of figure.querySelectorAll("[aria-invalid=true]")) set(input, { "aria-invalid": false });
      chosen = run;
      touch(given);
      drawRuns();
    };
    const train = (seeds) => {
      chosen = seeds.map((seed) => runs.add({ ...read(), seed }))[0];
      drawRuns();
    };
    const name = ({ number, given }) => {
      const others = changed(given, data).filter((one) => NAMES[one] && !["learner", "seed"].includes(one));
      return [`${number}: ${given.learner}, seed ${given.seed}`, ...others.map((one) => `${NAMES[one]} ${given[one]}`)].join(", ");
    };

    figure.classList.add("instrument");
    shared.heading(figure, {
      label: "Laboratory: a map of obstacles, start and target, the settings of a run, and its training",
      title: "Place the obstacles, choose a learner, and train.",
    });
    const tell = (said) => {
      lines = said;
      drawPolicy();
    };
    const drawForm = form(figure, data, read, touch, tell);
    const row = add(figure, "div", { class: "buttons" });
    set(button(row, "Train", () => train([read().seed])), { class: "main" });
    button(row, `${SEEDS} other seeds`, () => train(Array.from({ length: SEEDS }, (_, k) => read().seed + k + 1)));
    const end = button(row, "Stop", runs.stop), bar = add(row, "progress", { "aria-label": "Episodes trained", value: 0 });
    const doing = add(row, "span", { class: "hint" });
    const desk = add(figure, "div", { class: "laboratory" }), side = add(desk, "div"), right = add(desk, "div", { class: "curves" });
    const map = plane(side, data.view, "What can be moved on the map");
    mapParts.background(map, data);
    const parts = [
      obstacles(map, data, read, touch),
      pose(map, data, "target", ["goal", "Target", "Target, heading"], read, touch),
      pose(map, data, "start", ["robot", "Robot, start", "Robot, heading"], read, touch),
      trajectories(map),
    ];
    const under = add(side, "div", { class: "buttons" });
    const more = button(under, "Add an obstacle", () => {
      if (read().layout.length < data.most) touch({ layout: [...read().layout, free(read(), data.box)] });
    });
    const less = button(under, "Remove the last one", () => {
      if (read().layout.length > 1) touch({ layout: read().layout.slice(0, -1) });
    });
    button(under, "Reset all", () => open(defaults(data)));
    const note = shared.results(side), drawCurves = curves(right, data);
    shared.write(add(figure, "p", { class: "legend" }), "Line: trajectory without noise, of the chosen run, or of θ at the start, which is "
      + "dotted beside a run. Thick line: first plan. Dashed circles: what plans keep away from at this {c}; where two overlap, the "
      + "gap is closed. Drag an obstacle, the robot, the target or the tip of an arrow; or click one and then its new place; or "
      + "reach it with Tab and press the arrow keys, with Shift for larger steps. Delete removes an obstacle. Grey curves: the "
      + "same noise, and θ never moves.");
    const drawList = list(figure, data, name, {
      choose: (run) => open(run.given, run),
      remove: (run) => {
        if (run === chosen) chosen = null;
        runs.remove(run);
      },
    });
    const along = add(figure, "div");
    const drawLink = copied(along, "A link to these settings", "Copy link", tell);
    const drawCommand = copied(along, "The same settings in Python, which draws other noise", "Copy command", tell);

    const learnt = () => judged(chosen?.rows ?? []).at(-1);

    function drawRuns() {
      const now = runs.doing(), done = now?.rows.at(-1)?.episode ?? 0;
      drawList(runs.runs, chosen);
      drawCurves(runs.runs, chosen);
      set(end, { "aria-disabled": !now });
      bar.style.visibility = now ? "visible" : "hidden";
      set(bar, { value: done, max: now?.run.given.episodes ?? 1 });
      doing.textContent = now ? `Run ${now.run.number}${now.rows === now.run.rows ? "" : ", without learning"}: episode ${done} of ${now.run.given.episodes}` : "";
      if (found?.theta !== (learnt()?.theta ?? read().theta)) drawPolicy();
      figure.shown = { ...figure.shown, runs: runs.runs };
    }

    // Among these obstacles: what theta does at the start, and what the chosen run's last theta does.
    function drawPolicy() {
      const given = read(), { start, target, horizon } = given, row = learnt(), theta = row?.theta ?? given.theta;
      const among = { start, target, horizon, discs: given.layout.map((centre) => [...centre, data.clearance]) };
      const first = nmpc.rollout({ ...among, theta: given.theta }, data.steps);
      const last = row ? nmpc.rollout({ ...among, theta }, data.steps) : null, now = last ?? first;
      found = { first, last, theta, color: chosen ? data.looks[chosen.given.learner].color : "" };
      for (const draw of parts) draw(given, found);
      const who = row ? `with θ of run ${chosen.number} after episode ${row.episode}` : "with θ at the start";
      note([...lines, ...(now.failed ? [[`The solver found no plan at step ${now.states.length}; the closed loop ${who} ends there.`]] : [
        [`Closed loop ${who}: cost`, fixed(now.cost, 1)],
        ["Its start: V", fixed(now.plan.value, 1), "; discounted cost", fixed(now.discounted, 1), "; slope of V in {c}", fixed(now.plan.features.at(-1), 1)],
      ])]);
      figure.shown = { given, runs: runs.runs, first, last }; // for whoever asks; tests do
    }

    // The address follows what is set once nothing changes any more, and what is set follows the address.
    function follow() {
      const fragment = location.hash.slice(1), asked = fragment === fragmentOf(read(), data) ? null : linked(fragment, data);
      if (typeof asked === "string") return tell([[asked]]);
      return asked && open(asked);
    }

    function show(given) {
      const fragment = fragmentOf(given, data), usual = fragmentOf(defaults(data), data);
      drawForm(given);
      set(more, { "aria-disabled": given.layout.length === data.most });
      set(less, { "aria-disabled": given.layout.length === 1 });
      drawLink(`${location.href.split("#")[0]}#${fragment}`);
      drawCommand(command(given, data));
      drawPolicy();
      clearTimeout(later);
      later = setTimeout(() => {
        if (fragment !== (location.hash.slice(1) || usual)) history.replaceState(null, "", `#${fragment}`);
      }, QUIET);
    }
    window.addEventListener("hashchange", () => { // a link of the text below
      follow();
      figure.scrollIntoView();
    });
    show(read());
    drawRuns();
    follow();
  }

  shared.begin("laboratory", build);
})();
