// What a reader sets beside a map: buttons, sliders, menus, and what plays. Nothing moves by itself.
(() => {
  "use strict";

  const { add, set, numbers: { fixed }, parts: { symbol, WEIGHTS } } = window.nmpcrl;
  const still = matchMedia("(prefers-reduced-motion: reduce)");

  function button(parent, text, press) {
    const element = add(parent, "button", { type: "button" }, text);
    element.addEventListener("click", press);
    return element;
  }

  // A symbol, a range and its number. A finger that scrolls the page may begin on a slider, and leaves it as it was: the
  // browser cancels its pointer.
  function slider(group, { name, label, range: [min, max, step], text }, { read, write }) {
    const line = add(group, "label");
    symbol(line, name);
    const input = add(line, "input", { type: "range", min, max, step, "aria-label": label });
    const value = add(line, "span", { class: "value" });
    const moved = () => write(Number(input.value));
    let before = input.value;
    input.addEventListener("input", moved);
    input.addEventListener("pointerdown", () => { before = input.value; });
    input.addEventListener("pointercancel", () => {
      input.value = before;
      moved();
    });
    return (given) => {
      const number = read(given);
      input.value = number;
      value.textContent = text(number);
      set(input, { "aria-valuetext": value.textContent });
    };
  }

  // The slider of a component of theta, by its name.
  function weight(group, name, { names, ranges }, read, move) {
    const k = names.indexOf(name), text = (number) => fixed(number, 3);
    return slider(group, { name, label: WEIGHTS[name], range: ranges[name], text }, {
      read: ({ theta }) => theta[k],
      write: (number) => move({ theta: read().theta.with(k, number) }),
    });
  }

  // A menu beside its name.
  function choice(row, { label, options, text = String }, { read, write }) {
    const line = add(row, "label", { class: "choice" });
    add(line, "span", {}, label);
    const select = add(line, "select", { "aria-label": label });
    for (const value of options) add(select, "option", { value }, text(value));
    select.addEventListener("change", () => write(options[select.selectedIndex]));
    return (given) => { select.value = read(given); };
  }

  // A slider over steps, and a button that plays them: `read()` is the step now, `write(step)` moves it, `pace` is the
  // time of a step [ms]. With `steps`, a button makes one of them, and whoever asked for reduced motion has it alone.
  function player(parent, { label, last, pace, text, steps = false }, { read, write }) {
    const row = add(parent, "div", { class: steps ? "stepped player" : "player" });
    let timer = 0;
    const stop = () => {
      clearInterval(timer);
      timer = 0;
      play.textContent = "Play";
    };
    const next = () => {
      write(Math.min(read() + 1, last));
      if (read() === last) stop();
    };
    const play = button(row, "Play", () => {
      if (timer) return stop();
      if (read() === last) write(0);
      timer = setInterval(next, pace);
      play.textContent = "Pause";
    });
    if (steps) {
      button(row, "Step", () => {
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

  window.nmpcrl = { ...window.nmpcrl, button, slider, weight, choice, player };
})();
