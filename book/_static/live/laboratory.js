// The laboratory: place obstacles, choose a learner, train it here, and take the run along as a link or as Python.
//
// What the reader sets is `given`, as settings.js has it; runs.js trains it.
(() => {
  "use strict";

  const {
    add, set, settings, laboratoryMap, laboratoryRuns, laboratoryPlots, laboratoryAlong,
    parts: shared, words: { laboratory: words },
  } = window.nmpcrl;
  const OTHERS = 3; // further seeds at a click
  const OFTEN = 100; // between two pictures of what is being trained [ms]
  const QUIET = 400; // after the last change, before the address changes [ms]

  function menu(line, { name, choices }, move) {
    const input = add(line, "select", { "aria-label": words.names[name] });
    for (const each of choices) add(input, "option", { value: each }, words.learners[each] ?? each);
    input.addEventListener("change", () => move({ [name]: input.value }));
    return input;
  }

  // A number that is refused stays in its field, with a sentence, and changes nothing.
  function number(line, field, move, tell) {
    const input = add(line, "input", {
      type: "text", inputmode: "decimal", autocomplete: "off", "aria-label": words.names[field.name],
    });
    input.addEventListener("change", () => {
      const value = settings.parsed(input.value, field);
      set(input, { "aria-invalid": value === undefined });
      tell(value === undefined ? [[words.refused(field.name, field)]] : []);
      if (value !== undefined) move({ [field.name]: value });
    });
    return input;
  }

  function form(parent, data, move, tell) {
    const rows = data.fields.map((field) => {
      const line = add(parent, "label", { class: "field" });
      add(line, "span", {}, words.names[field.name]);
      return { field, line, input: field.choices ? menu(line, field, move) : number(line, field, move, tell) };
    });
    return (given) => {
      for (const { field: { name, read_by: readBy }, line, input } of rows) {
        line.hidden = name !== "learner" && !readBy.includes(given.learner);
        const refused = input.getAttribute("aria-invalid") === "true";
        if (input !== document.activeElement && !refused) input.value = given[name];
      }
    };
  }

  function trainingButtons(parent, { train, seeds, stop }) {
    const row = add(parent, "div", { class: "buttons" });
    set(shared.button(row, words.train, train), { class: "main" });
    shared.button(row, words.seeds(OTHERS), seeds);
    const end = shared.button(row, words.stop, stop);
    const bar = add(parent, "progress", { "aria-label": words.progress, value: 0 });
    const text = add(parent, "p", { class: "hint doing" });
    return ({ runs, doing }, name) => {
      const now = doing();
      const waiting = runs.filter(({ state }) => state === "waiting").length;
      set(end, { "aria-disabled": !now });
      bar.style.visibility = now ? "visible" : "hidden";
      const done = now?.rows.at(-1)?.episode ?? 0, all = now?.run.given.episodes ?? 1;
      set(bar, { value: done, max: all });
      const what = now && (now.rows === now.run.rows ? name(now.run) : words.arm(name(now.run)));
      text.textContent = now ? words.training(what, done, all) + words.waiting(waiting) : "";
    };
  }

  // The address follows what is set once nothing changes any more, and what is set follows the address.
  function address(data, read, open, refuse) {
    let due = 0;
    const follow = () => {
      const fragment = location.hash.slice(1);
      if (fragment === settings.written(read(), data)) return;
      const found = settings.read(fragment, data) ?? (fragment ? null : settings.defaults(data));
      if (found?.damaged !== undefined) refuse(found.damaged);
      else if (found) open(found);
    };
    window.addEventListener("hashchange", follow);
    follow();
    return (given) => {
      clearTimeout(due);
      const text = settings.written(given, data), first = settings.written(settings.defaults(data), data);
      const now = location.hash.slice(1) || first;
      if (text !== now) due = setTimeout(() => { location.hash = text; }, QUIET);
    };
  }

  // What the run's name says besides its learner and seed: what differs from the defaults.
  const nameOf = (data) => ({ number: count, given }) => {
    const changed = settings.changed(given, data).filter((name) => name !== "learner" && name !== "seed");
    const short = changed.filter((name) => words.other[name]).map((name) => `${words.other[name]} ${given[name]}`);
    const place = changed.filter((name) => !words.other[name]), letter = settings.named(given, data);
    const where = place.length === 1 && place[0] === "layout" && letter ? words.layout(letter) : words.elsewhere;
    return words.run(count, given, [...short, ...(place.length ? [where] : [])]);
  };

  function build(figure, data, nmpc) {
    const { read, move } = shared.state(settings.defaults(data), show);
    const name = nameOf(data), problem = {};
    let chosen = null, due = false, drawn = null;
    const runs = laboratoryRuns.queue(data, () => {
      if (!due) setTimeout(() => { due = false; drawRuns(); }, OFTEN);
      due = true;
    });
    const change = (part) => {
      problem.lines = [];
      move(part);
    };
    const open = (given, run = null) => { // an example, a link, the beginning; or a run, to follow
      for (const input of figure.querySelectorAll("[aria-invalid=true]")) set(input, { "aria-invalid": false });
      chosen = run;
      change(given);
      drawRuns();
    };
    const choose = (run) => open(run.given, run);

    shared.heading(figure, words);
    const top = add(figure, "div", { class: "laboratory" });
    const drawMap = laboratoryMap(top, data, read, change, () => open(settings.defaults(data)));
    const side = add(top, "div", { class: "side" });
    const tell = (lines) => say(lines);
    const drawForm = form(side, data, change, tell);
    const drawProgress = trainingButtons(side, {
      train: () => train([read().seed]),
      seeds: () => train(Array.from({ length: OTHERS }, (_, k) => read().seed + k + 1)),
      stop: runs.stop,
    });
    const note = shared.results(side);
    laboratoryAlong.gallery(figure, data, open);
    add(figure, "p", { class: "plot-title" }, words.runs);
    const drawList = laboratoryRuns.list(figure, data, { choose, remove: removed, name });
    const drawPlots = laboratoryPlots(figure, data);
    const drawAlong = laboratoryAlong.takeAlong(figure, data, tell);

    function say(lines) {
      problem.lines = lines;
      note([...lines, ...(problem.now ?? [])]);
    }

    function train(seeds) {
      for (const seed of seeds) runs.add({ ...read(), seed });
      chosen = runs.runs.at(-seeds.length);
      say([]);
    }

    function removed(run) {
      if (run === chosen) chosen = null;
      runs.remove(run);
    }

    function drawRuns() {
      drawList(runs.runs, chosen);
      drawPlots(runs.runs, chosen);
      drawProgress(runs, name);
      if (drawn !== learnt()) drawPolicy(read());
    }

    // The last theta of the chosen run that was judged.
    const learnt = () => chosen?.rows.findLast(({ judged }) => judged)?.theta;

    function drawPolicy(given) {
      const where = {
        start: given.start, target: given.target, horizon: given.horizon,
        discs: given.layout.map((centre) => [...centre, data.clearance]),
      };
      const theta = learnt();
      drawn = theta;
      const first = nmpc.rollout({ ...where, theta: given.theta }, data.steps);
      const last = theta ? nmpc.rollout({ ...where, theta }, data.steps) : null;
      const color = chosen ? data.looks[chosen.given.learner].color : "";
      drawMap(given, { first, last, color });
      problem.now = words.now(last ?? first, last ? words.ofRun(chosen.number) : words.atStart);
      note([...(problem.lines ?? []), ...problem.now]);
      figure.shown = { given, runs: runs.runs, first, last }; // for whoever asks; tests do
    }

    const follow = address(data, read, open, (damaged) => {
      change({}); // what is set stays, and the address says that again
      problem.lines = [[words.damaged(...damaged, data)]];
    });

    function show(given) {
      drawForm(given);
      drawAlong(given);
      drawPolicy(given);
      follow(given);
    }
    show(read());
    drawRuns();
  }

  shared.begin("laboratory", build);
})();
