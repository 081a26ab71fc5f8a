// The introduction's live figure: move the obstacles, let it learn before your eyes, narrow a gap and see learning close it.
//
// `given`: { start, discs, horizon, narrow, theta, episode, learning, moved, said }: which layout the obstacles come
// from, theta after so many episodes, whether they go on, and whether something was moved since they began.
(() => {
  "use strict";

  const { add, set, plane, mapParts, trainer, parts: shared, words: { intro: words } } = window.nmpcrl;
  const { points } = shared;

  // The distance of each obstacle's centre at which the tightened constraint is met, as `problem.boundaries` has it.
  const kept = ([, , clearance], theta) => (clearance / 2) * Math.sqrt(Math.max(0, 1 + theta.at(-1)));

  function circles(map, { discs: begin }) {
    const all = begin.map(() => add(map.ground, "circle", { class: "kept" }));
    return ({ discs, theta }) => discs.forEach((disc, k) => (
      set(all[k], { cx: disc[0], cy: disc[1], r: kept(disc, theta) })
    ));
  }

  function trajectories(map, { robot }) {
    const before = add(map.ground, "polyline", { class: "before" });
    const loop = add(map.ground, "polyline", { class: "loop" });
    const end = add(map.ground, "circle", { class: "end", r: robot });
    return (_, { first, now }) => {
      set(before, { points: first === now ? "" : points(first.states) });
      set(loop, { points: points(now.states) });
      const [cx, cy] = now.states.at(-1) ?? [NaN, NaN];
      set(end, Number.isFinite(cx) ? { cx, cy, visibility: "visible" } : { visibility: "hidden" });
    };
  }

  function buttons(parent, { episodes }, { learn, toggle }) {
    const row = add(parent, "div", { class: "buttons" });
    const start = shared.button(row, words.learn, learn);
    set(start, { class: "main" });
    const gap = shared.button(row, words.narrow, toggle);
    const bar = add(row, "progress", { "aria-label": words.progress, max: episodes, value: 0 });
    return ({ learning, narrow, episode }) => {
      start.textContent = learning ? words.stop : words.learn;
      gap.textContent = narrow ? words.widen : words.narrow;
      set(bar, { value: episode });
      bar.style.visibility = learning ? "visible" : "hidden";
    };
  }

  // What a theta does from the start without noise, and whether that is at the target.
  function judge(nmpc, { arrived, steps, problem: { target } }, { start, discs, horizon }, theta) {
    const found = nmpc.rollout({ start, discs, horizon, theta }, steps);
    const away = found.failed ? Infinity : Math.hypot(...found.states.at(-1).map((each, k) => each - target[k]));
    return { ...found, cost: found.failed ? Infinity : found.cost, arrived: away <= arrived };
  }

  // The picture for those who have no script is for them alone.
  function replacePicture(figure) {
    const before = [...document.querySelectorAll("article img")].filter((one) => (
      one.compareDocumentPosition(figure) & Node.DOCUMENT_POSITION_FOLLOWING
    )).at(-1);
    before?.closest("p, figure").classList.add("pictured");
  }

  function build(figure, data, nmpc) {
    const { layouts, settings, theta: init } = data;
    const fresh = { theta: init, episode: 0, learning: false, moved: false, said: "" };
    const { read, move } = shared.state(
      { start: data.start, horizon: data.horizon, discs: layouts.wide, narrow: false, ...fresh }, show,
    );
    let stopped = () => {};
    let first = null, seen = ""; // before learning, and where that was

    function end(change) {
      stopped();
      stopped = () => {};
      move({ learning: false, ...change });
    }

    const moved = (change) => end({ ...change, moved: read().episode > 0, said: "" });
    const toggle = () => {
      const narrow = !read().narrow;
      end({ ...fresh, narrow, start: data.start, discs: narrow ? layouts.narrow : layouts.wide });
    };

    function learn() {
      if (read().learning) return end({});
      const { start, discs, horizon } = read();
      move({ ...fresh, learning: true });
      const given = {
        module: window.nmpcrl.module, problem: data.problem, widths: data.widths,
        settings: { ...settings, start, discs, horizon },
      };
      const stop = trainer(given, {
        row: ({ episode, theta, diverged }) => {
          if (stopped !== stop) return; // what was on its way when it was stopped
          move(diverged ? { episode, said: words.diverged } : { episode, theta });
        },
        end: (why) => { if (stopped === stop) end(why ? { said: words.failed(why) } : {}); },
      });
      stopped = stop;
    }

    set(figure, { "aria-label": words.map });
    add(figure, "p", { class: "title" }, words.title);
    const drawButtons = buttons(figure, settings, { learn, toggle });
    const map = plane(figure, data.view, words.handles);
    mapParts.background(map, data);
    const drawn = [
      circles(map, { discs: layouts.wide }),
      ...mapParts.handles(map, data, read, moved),
      trajectories(map, data),
    ];
    mapParts.target(map, data);
    const tell = shared.results(figure);
    add(figure, "p", { class: "legend" }, words.legend);

    function show(given) {
      const place = JSON.stringify([given.start, given.discs]);
      if (place !== seen) first = judge(nmpc, data, given, init);
      seen = place;
      const now = given.theta === init ? first : judge(nmpc, data, given, given.theta);
      const lines = words.now({ ...given, episodes: settings.episodes, rollout: now, first });
      tell(given.said ? [...lines, [given.said]] : lines);
      drawButtons(given);
      for (const draw of drawn) draw(given, { first, now });
      figure.shown = { given, found: { first, now } }; // for whoever asks; tests do
    }
    show(read());
    replacePicture(figure);
  }

  shared.begin("intro", build);
})();
