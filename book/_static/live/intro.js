// The introduction's live figure: move the obstacles, let it learn before your eyes, narrow a gap and see learning close it.
//
// `given`: { start, discs, horizon, narrow, theta, episode, learning, moved, said }: which layout the obstacles come
// from, theta after so many episodes, whether they go on, and whether something was moved since they began.
(() => {
  "use strict";

  const { add, set, plane, mapParts, trainer, button, numbers: { points, fixed }, parts: shared } = window.nmpcrl;
  const SAME = 5e-4; // a share of the cost that is called none

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

  function change(before, now) {
    const share = 1 - now / before, percent = `${fixed(100 * Math.abs(share), 1)} %`;
    if (!Number.isFinite(share)) return "";
    return Math.abs(share) < SAME ? "as much as" : `${percent} ${share > 0 ? "less" : "more"} than`;
  }

  function does({ failed, arrived, states }) {
    if (failed) return `has no plan at step ${states.length}`;
    return arrived ? "arrives" : "is stuck before the target";
  }

  // Texts and numbers in turn.
  function results({ episode, learning, moved }, episodes, { first, now }) {
    const cost = now.failed ? [] : ["; cost:", fixed(now.cost, 0)];
    if (!episode && !learning) return ["Before learning, the robot", does(now), ...cost];
    const when = learning ? `Episode ${episode} of ${episodes}` : `After ${episode} episodes`;
    const where = moved ? ", and moved since: the robot" : ": the robot", than = change(first.cost, now.cost);
    const beside = than ? [`; ${than} before learning`, `(${fixed(first.cost, 0)})`] : [];
    return [`${when}${where}`, does(now), ...cost, ...beside];
  }

  function buttons(parent, { episodes }, { learn, toggle }) {
    const row = add(parent, "div", { class: "buttons" });
    const start = button(row, "Learn", learn);
    set(start, { class: "main" });
    const gap = button(row, "Narrow a gap", toggle);
    const bar = add(row, "progress", { "aria-label": "Episodes learned", max: episodes, value: 0 });
    return ({ learning, narrow, episode }) => {
      start.textContent = learning ? "Stop" : "Learn";
      gap.textContent = narrow ? "Widen it again" : "Narrow a gap";
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
        module: window.nmpcrl.module, problem: data.problem,
        settings: { ...settings, start, discs, horizon },
      };
      const stop = trainer(given, {
        row: ({ episode, theta, diverged }) => {
          if (stopped !== stop) return; // what was on its way when it was stopped
          move(diverged ? { episode, said: "Learning diverged." } : { episode, theta });
        },
        end: (why) => { if (stopped === stop) end(why ? { said: `This browser could not train: ${why}.` } : {}); },
      });
      stopped = stop;
    }

    shared.heading(figure, {
      label: "The robot, its trajectory among obstacles that can be moved, and a learner",
      title: "Drag an obstacle, or press Learn; then narrow a gap, and learn again.",
    });
    const drawButtons = buttons(figure, settings, { learn, toggle });
    const map = plane(figure, data.view, "What can be moved on the map");
    mapParts.background(map, data);
    const drawn = [
      circles(map, { discs: layouts.wide }),
      ...mapParts.handles(map, data, read, moved),
      trajectories(map, data),
    ];
    mapParts.target(map, data);
    const tell = shared.results(figure);
    add(figure, "p", { class: "legend" }, "Line: the robot’s trajectory without noise; dotted: before learning. Dashed circles: "
      + "the distance from an obstacle that its plans keep, which learning changes; where two overlap, the gap between them is "
      + "closed. By keyboard: Tab to an obstacle, to the robot or to its arrow, then arrow keys, with Shift for larger steps.");

    function show(given) {
      const place = JSON.stringify([given.start, given.discs]);
      if (place !== seen) first = judge(nmpc, data, given, init);
      seen = place;
      const now = given.theta === init ? first : judge(nmpc, data, given, given.theta);
      tell([results(given, settings.episodes, { first, now }), ...(given.said ? [[given.said]] : [])]);
      drawButtons(given);
      for (const draw of drawn) draw(given, { first, now });
      figure.shown = { given, found: { first, now } }; // for whoever asks; tests do
    }
    show(read());
    replacePicture(figure);
  }

  shared.begin("intro", build);
})();
