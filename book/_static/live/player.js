// What plays: a slider over steps, and buttons that move it. Nothing moves by itself; whoever asked for reduced motion
// has no Play where there is a button for one step.
(() => {
  "use strict";

  const { add, set, parts: { button }, words: { player: words } } = window.nmpcrl;
  const still = matchMedia("(prefers-reduced-motion: reduce)");

  // `read()` is the step now, `write(step)` moves it; `pace` is the time of a step [ms]; with `steps`, a button
  // makes one of them; with `speeds`, a menu divides the pace by one of these, at first by `speed`. What comes back
  // draws, stops and, from the first step, begins: for those who want no motion, at the last.
  function player(parent, { label, last, pace, text, steps = false, speeds = [], speed = 1 }, { read, write }) {
    const row = add(parent, "div", { class: steps ? "stepped player" : "player" });
    let timer = 0;
    const stop = () => {
      clearInterval(timer);
      timer = 0;
      play.textContent = words.play;
    };
    const next = () => {
      write(Math.min(read() + 1, last));
      if (read() === last) stop();
    };
    const go = () => {
      timer = setInterval(next, pace / speed);
      play.textContent = words.pause;
    };
    const play = button(row, words.play, () => {
      if (timer) return stop();
      if (read() === last) write(0);
      go();
    });
    if (steps) {
      button(row, words.step, () => {
        stop();
        next();
      });
    }
    const range = add(row, "input", { type: "range", min: 0, max: last, step: 1, "aria-label": label });
    const value = add(row, "span", { class: "value" });
    range.addEventListener("input", () => {
      stop();
      write(Number(range.value));
    });
    if (speeds.length) {
      const menu = add(row, "select", { "aria-label": words.speed });
      for (const each of speeds) add(menu, "option", { value: each }, words.times(each));
      menu.value = speed;
      menu.addEventListener("change", () => {
        speed = Number(menu.value);
        if (timer) {
          stop();
          go();
        }
      });
    }
    const settle = () => {
      stop();
      play.hidden = steps && still.matches;
    };
    still.addEventListener("change", settle);
    settle();

    const draw = (now) => {
      range.value = now;
      value.textContent = text(now);
      set(range, { "aria-valuetext": value.textContent });
    };
    const begin = () => {
      stop();
      write(still.matches ? last : 0);
      if (!still.matches) go();
    };
    return { draw, stop, begin };
  }

  window.nmpcrl = { ...window.nmpcrl, player };
})();
