// What the laboratory shows at a click: six finds, and the lesson on the trap in six steps. Each fills the form, trains,
// plays, and says what to look at.
(() => {
  "use strict";

  const { add, set, laboratoryRuns: { judged }, parts: shared, words: { laboratory: words } } = window.nmpcrl;

  // What became of a run: of what was judged, the first, where it first did not arrive, and the last; null of none. One
  // that diverged was stopped: in which episode, and which component of theta was the largest then.
  function account({ rows, given }, { arrived, names }) {
    const seen = judged(rows);
    if (!seen.length) return null;
    const told = ({ episode, theta, delta, judged: { states, cost, value, discounted } }) => ({
      episode, cost, delta, thetaC: theta.at(-1), error: Math.abs(value / discounted - 1),
      arrives: Number.isFinite(cost) && Math.hypot(...states.at(-1).map((each, k) => each - given.target[k])) <= arrived,
    });
    const all = seen.map(told), { episode, theta, diverged } = rows.at(-1);
    const k = theta.map(Math.abs).reduce((most, size, at, sizes) => (size > sizes[most] ? at : most), 0);
    const stopped = diverged ? { episode, name: names[k], value: theta[k] } : null;
    return { given, first: all[0], closed: all.find(({ arrives }) => !arrives) ?? null, last: all.at(-1), stopped };
  }

  // `show({ settings, against, learned, replay, panels }, then)` trains what is to be seen and plays it; `then(run,
  // other)` follows. What comes back ends the lesson: whoever changes the settings has left it.
  function lesson(parent, desk, data, show) {
    const row = add(parent, "div", { class: "buttons gallery", role: "group", "aria-label": words.gallery });
    const told = add(desk, "div", { class: "told" });
    const title = add(told, "p", { class: "plot-title" });
    const said = add(told, "div", { role: "status", class: "sentence" });
    const text = add(said, "p"), answer = add(said, "p", { class: "outcome" });
    const steps = add(told, "div", { class: "buttons" });
    const back = shared.button(steps, words.back, () => turn(-1));
    const next = shared.button(steps, words.next, () => turn(1));
    set(next, { class: "main" });
    let at = -1; // step of the lesson

    function say(paragraph, content) {
      paragraph.replaceChildren();
      shared.write(paragraph, content);
    }

    function tell(heading, sentence) {
      told.hidden = !sentence;
      title.textContent = heading;
      title.hidden = !heading;
      say(text, sentence);
      say(answer, "");
      steps.hidden = at < 0;
      set(back, { "aria-disabled": at <= 0 });
      set(next, { "aria-disabled": at === data.trap.length - 1 });
      lessonButton.setAttribute("aria-pressed", at >= 0);
    }

    function turn(by) {
      const to = at + by;
      if (to < 0 || to >= data.trap.length) return;
      at = to;
      const { heading, sentence, panels, replay = false, found } = words.trap[at];
      tell(words.step(at + 1, data.trap.length, heading), sentence);
      show({ ...data.trap[at], learned: true, replay, panels }, (run, other) => {
        if (at === to) say(answer, found(account(run, data), other && account(other, data)));
      });
    }

    function leave() {
      at = -1;
      tell("", "");
    }

    const lessonButton = shared.button(row, words.lesson, () => {
      at = -1;
      turn(1);
    });
    set(lessonButton, { class: "main" });
    for (const example of data.gallery) {
      shared.button(row, example.title, () => {
        at = -1;
        tell("", `${example.sentence} ${example.look}`);
        show({ ...example, panels: [] }, (run) => say(answer, words.outcome(account(run, data))));
      });
    }
    leave();
    return leave;
  }

  window.nmpcrl = { ...window.nmpcrl, laboratoryLesson: { lesson, account } };
})();
