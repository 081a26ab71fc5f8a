// The laboratory: place obstacles, choose a learner, train it here, and take the run along as a link or as Python.
//
// What the reader sets is `given`, as settings.js has it; runs.js trains it.
(() => {
  "use strict";

  const {
    add, set, settings, player, laboratoryMap, mapButtons, laboratoryRuns, laboratoryPlots, laboratoryLesson, takeAlong,
    parts: shared, words: { laboratory: words },
  } = window.nmpcrl;
  const { hasEnded, judged } = laboratoryRuns;
  const OTHERS = 3; // further seeds at a click
  const OFTEN = 100; // between two pictures of what is being trained [ms]
  const QUIET = 400; // after the last change, before the address changes [ms]
  const SPEEDS = [1, 2, 4, 8, 16], SPEED = 8; // of play, over the robot's own; and the one at first
  const REPLAYED = 160; // how long each policy of a run is seen when they follow each other [ms]
  const DESK = matchMedia("(min-width: 700px)"); // where all settings are seen from the beginning
  const STILL = matchMedia("(prefers-reduced-motion: reduce)");

  function menu(line, { name, choices }, move) {
    const input = add(line, "select", { "aria-label": words.names[name] });
    for (const each of choices) add(input, "option", { value: each }, words.learners[each] ?? each);
    input.addEventListener("change", () => move({ [name]: input.value }));
    return input;
  }

  // A number that is refused stays in its field, with a sentence, and changes nothing.
  function number(line, field, move, tell) {
    const input = add(line, "input", {
      type: "text", inputmode: "decimal", autocomplete: "off", "aria-label": shared.plain(words.names[field.name]),
    });
    input.addEventListener("change", () => {
      const value = settings.parsed(input.value, field);
      set(input, { "aria-invalid": value === undefined });
      tell(value === undefined ? [[words.refused(field.name, field)]] : []);
      if (value !== undefined) move(field.change(value));
    });
    return input;
  }

  // The learner, and everything else of a run, which folds.
  function form(parent, lead, data, { read, move, tell }) {
    const all = add(parent, "details", { class: "settings" });
    all.open = DESK.matches;
    add(all, "summary", {}, words.settings);
    const grid = add(all, "div", { class: "fields" });
    const value = (given, name) => given[name];
    const fields = data.fields.map((field) => ({ ...field, value, change: (to) => ({ [field.name]: to }) }));
    const thetaC = {
      name: "theta_c", least: data.theta_set[0], most: data.theta_set[1], whole: false, read_by: fields[0].choices,
      value: ({ theta }) => theta.at(-1), change: (to) => ({ theta: read().theta.with(-1, to) }),
    };
    const rows = [...fields, thetaC].map((field) => {
      const line = add(field.name === "learner" ? lead : grid, "label", { class: "field" });
      shared.write(add(line, "span"), words.names[field.name]);
      return { field, line, input: field.choices ? menu(line, field, move) : number(line, field, move, tell) };
    });
    return (given) => {
      for (const { field, line, input } of rows) {
        line.hidden = field.name !== "learner" && !field.read_by.includes(given.learner);
        const refused = input.getAttribute("aria-invalid") === "true";
        if (input !== document.activeElement && !refused) input.value = field.value(given, field.name);
      }
    };
  }

  function trainingButtons(parent, { train, seeds, stop }) {
    const row = add(parent, "div", { class: "buttons" });
    set(shared.button(row, words.train, train), { class: "main" });
    shared.button(row, words.seeds(OTHERS), seeds);
    const end = shared.button(row, words.stop, stop);
    const bar = add(row, "progress", { "aria-label": words.progress, value: 0 });
    const text = add(row, "span", { class: "hint doing" });
    return ({ runs, doing }, name) => {
      const now = doing();
      const waiting = runs.filter(({ state }) => state === "waiting").length;
      set(end, { "aria-disabled": !now });
      bar.style.visibility = now ? "visible" : "hidden";
      const done = now?.rows.at(-1)?.episode ?? 0, all = now?.run.given.episodes ?? 1;
      set(bar, { value: done, max: all });
      const what = now && (now.rows === now.run.rows ? name(now.run) : words.arm(name(now.run)));
      text.replaceChildren();
      shared.write(text, now ? words.training(what, done, all) + words.waiting(waiting) : "");
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
      // Not by location.hash, which is followed a task later, when something else may have been set.
      if (text !== now) due = setTimeout(() => { history.pushState(null, "", `#${text}`); }, QUIET);
    };
  }

  // What the run's name says besides its learner and seed: what differs from the defaults.
  const nameOf = (data) => ({ number: count, given }) => {
    const changed = settings.changed(given, data).filter((name) => name !== "learner" && name !== "seed");
    const short = changed.filter((name) => words.other[name]).map((name) => `${words.other[name]} ${given[name]}`);
    if (changed.includes("theta")) short.push(words.startingAt(given.theta.at(-1)));
    const place = changed.filter((name) => !words.other[name] && name !== "theta"), letter = settings.named(given, data);
    const where = place.length === 1 && place[0] === "layout" && letter ? words.layout(letter) : words.elsewhere;
    return words.run(count, given, [...short, ...(place.length ? [where] : [])]);
  };

  // Which policy of the chosen run is shown: that of the last episode that was judged, or an earlier one.
  function episodes(parent, write) {
    const line = add(parent, "label", { class: "player episodes" });
    add(line, "span", {}, words.policy);
    const range = add(line, "input", { type: "range", min: 0, step: 1, "aria-label": words.policy });
    const value = add(line, "span", { class: "value" });
    range.addEventListener("input", () => write(Number(range.value)));
    return (seen, at) => {
      line.hidden = seen.length < 2;
      if (line.hidden) return;
      set(range, { max: seen.length - 1 });
      range.value = at;
      value.textContent = words.afterEpisode(seen[at].episode);
      set(range, { "aria-valuetext": value.textContent });
    };
  }

  function build(figure, data, nmpc) {
    const { read, move } = shared.state(settings.defaults(data), show);
    const name = nameOf(data), problem = {}, end = data.steps - 1;
    let chosen = null, kept = null; // runs: the one that is shown, and the one that is laid over it
    let at = null; // which of its policies, by number; null is the last
    let time = end, due = false, drawn = null, found = null;
    let awaited = null; // { all, then }: runs that a find trains, and what follows
    let replaying = 0;
    const runs = laboratoryRuns.queue(data, () => {
      if (!due) setTimeout(() => { due = false; drawRuns(); }, OFTEN);
      due = true;
    });
    const change = (part) => {
      problem.lines = [];
      move(part);
    };
    const touch = (part) => { // by the reader
      awaited = null;
      still();
      leave();
      plots.lookAt([]);
      change(part);
    };
    const open = (given, run = null) => { // an example, a link, the beginning; or a run, to follow
      for (const input of figure.querySelectorAll("[aria-invalid=true]")) set(input, { "aria-invalid": false });
      still();
      [chosen, at] = [run, null];
      change(given);
      drawRuns();
    };
    const choose = (run) => {
      if (run === kept) kept = null;
      open(run.given, run);
    };
    const keep = (run) => {
      kept = run === kept || run === chosen ? null : run;
      drawRuns();
    };

    figure.classList.add("instrument");
    set(figure, { "aria-label": words.map });
    add(figure, "p", { class: "title" }, words.title);
    const finds = add(figure, "div"), bar = add(figure, "div", { class: "bar" }), lead = add(bar, "div", { class: "asked" });
    const desk = add(figure, "div", { class: "laboratory" });
    const leave = laboratoryLesson.lesson(finds, desk, data, showRuns);
    const tell = (lines) => say(lines);
    const drawForm = form(bar, lead, data, { read, move: touch, tell });
    const drawProgress = trainingButtons(lead, {
      train: () => train([read().seed]),
      seeds: () => train(Array.from({ length: OTHERS }, (_, k) => read().seed + k + 1)),
      stop: runs.stop,
    });
    const side = add(desk, "div", { class: "side" });
    const drawMap = laboratoryMap(side, data, read, touch);
    const play = player(side, {
      label: words.time, last: end, pace: 1000 * data.period, speeds: SPEEDS, speed: SPEED,
      text: (k) => words.seconds(k * data.period),
    }, {
      read: () => time,
      write: (k) => {
        time = k;
        drawTime();
      },
    });
    const drawEpisodes = episodes(side, (k) => {
      still();
      shift(k);
    });
    const drawButtons = mapButtons(side, data, read, touch, () => {
      kept = null;
      leave();
      open(settings.defaults(data));
    });
    const curves = add(desk, "div", { class: "curves" });
    const note = shared.results(curves);
    const plots = laboratoryPlots(curves, data);
    shared.write(add(figure, "p", { class: "legend" }), words.legend);
    add(figure, "p", { class: "plot-title" }, words.runs);
    const drawList = laboratoryRuns.list(figure, data, { choose, keep, remove: removed, name });
    const drawAlong = takeAlong(figure, data, tell);

    function say(lines) {
      problem.lines = lines;
      note([...lines, ...(problem.now ?? [])]);
    }

    function train(seeds) {
      still();
      awaited = null;
      const added = seeds.map((seed) => runs.add({ ...read(), seed }));
      [chosen, at] = [added[0], null];
      say([]);
    }

    // A run of these settings, which may be trained already.
    function trained(given) {
      const same = JSON.stringify(given); // all settings, in the order of the defaults
      const old = runs.runs.find((run) => JSON.stringify(run.given) === same && !["stopped", "failed"].includes(run.state));
      return old ?? runs.add(given);
    }

    // What a find, or a step of the lesson, is about: trained, chosen, laid over, and played.
    function showRuns({ settings: asked, against: other, learned, replay: again = false, panels }, then) {
      const [given, against] = [asked, other].map((each) => each && { ...settings.defaults(data), ...each });
      const wanted = [given, against].map((each) => JSON.stringify(each));
      if (runs.doing() && !wanted.includes(JSON.stringify(runs.doing().run.given))) runs.stop();
      const run = trained(given);
      kept = against ? trained(against) : null;
      open(given, run);
      if (!learned) at = 0;
      plots.lookAt(panels);
      awaited = {
        all: [run, kept].filter(Boolean),
        then: () => {
          if (again) replay();
          else if (learned) play.begin();
          then(run, kept);
        },
      };
      play.begin();
      drawRuns();
    }

    function shift(k) {
      at = k;
      drawRuns();
    }

    // The policies of the chosen run, one after the other.
    function replay() {
      const last = judged(chosen.rows).length - 1;
      if (STILL.matches) return;
      play.stop();
      time = end;
      shift(0);
      replaying = setInterval(() => {
        if (at >= last) still();
        else shift(at + 1);
      }, REPLAYED);
    }

    function still() {
      clearInterval(replaying);
      replaying = 0;
    }

    function removed(run) {
      if (run === chosen) chosen = null;
      if (run === kept) kept = null;
      if (awaited?.all.includes(run)) awaited = null;
      runs.remove(run);
    }

    // The policies of a run that were judged, and which is shown.
    function policies(run) {
      const seen = run ? judged(run.rows) : [];
      return [seen, Math.min(at ?? seen.length - 1, seen.length - 1)];
    }

    function learnt() {
      const [seen, k] = policies(chosen);
      return seen[k]?.theta;
    }

    function drawRuns() {
      drawList(runs.runs, chosen, kept);
      plots.draw(runs.runs, chosen, kept);
      drawProgress(runs, name);
      drawEpisodes(...policies(chosen));
      const over = kept && judged(kept.rows).at(-1);
      if (!drawn || drawn.theta !== learnt() || drawn.over !== over) drawPolicy(read());
      if (awaited?.all.every(hasEnded)) {
        const { then } = awaited;
        awaited = null;
        then();
      }
    }

    function drawTime() {
      play.draw(time);
      drawMap(read(), { ...found, time });
    }

    // Among these obstacles: what theta does at the start, what the chosen policy does, and from its own start the run
    // that is laid over it.
    function drawPolicy(given) {
      const among = ({ start, target, horizon }) => ({
        start, target, horizon, discs: given.layout.map((centre) => [...centre, data.clearance]),
      });
      const theta = learnt(), over = kept && judged(kept.rows).at(-1);
      drawn = { theta, over };
      const first = nmpc.rollout({ ...among(given), theta: given.theta }, data.steps);
      const last = theta ? nmpc.rollout({ ...among(given), theta }, data.steps) : null;
      const beside = over ? nmpc.rollout({ ...among(kept.given), theta: over.theta }, data.steps) : null;
      const color = (run) => (run ? data.looks[run.given.learner].color : "");
      found = { first, last, over: beside, colors: { loop: color(chosen), over: color(kept) }, thetaC: (theta ?? given.theta).at(-1) };
      drawTime();
      const [seen, k] = policies(chosen), who = theta ? words.ofRun(chosen.number, seen[k].episode) : words.atStart;
      problem.now = [...words.now(last ?? first, who), ...(beside ? words.now(beside, words.over(kept.number)).slice(0, 1) : [])];
      note([...(problem.lines ?? []), ...problem.now]);
      figure.shown = { given, runs: runs.runs, first, last, over: beside }; // for whoever asks; tests do
    }

    const follow = address(data, read, (given) => {
      leave();
      open(given);
    }, (damaged) => {
      change({}); // what is set stays, and the address says that again
      problem.lines = [[words.damaged(...damaged, data)]];
    });

    function show(given) {
      drawForm(given);
      drawButtons(given);
      drawAlong(given);
      drawPolicy(given);
      follow(given);
    }
    show(read());
    drawRuns();
  }

  shared.begin("laboratory", build);
})();
