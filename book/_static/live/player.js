// What plays: a slider over steps, and buttons that move it. Nothing moves by itself; whoever asked for reduced motion
// has no Play where there is a button for one step.
(() => {
  "use strict";

  const { add, set, parts: { button }, words: { player: words } } = window.nmpcrl;
  const still = matchMedia("(prefers-reduced-motion: reduce)");

  // `read()` is the step now, `write(step)` moves it; `pace` is the time of a step [ms]; with `steps`, a button
  // makes one of them.
  function player(parent, { label, last, pace, text, steps = false }, { read, write }) {
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
    const play = button(row, words.play, () => {
      if (timer) return stop();
      if (read() === last) write(0);
      timer = setInterval(next, pace);
      play.textContent = words.pause;
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
    return { draw, stop };
  }

  window.nmpcrl = { ...window.nmpcrl, player };
})();
