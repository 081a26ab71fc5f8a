// What a reader sets beside the map: sliders, the sliders of theta, and menus.
(() => {
  "use strict";

  const { add, set, parts: { symbol }, words: { parts: words } } = window.nmpcrl;

  // A finger that scrolls the page may begin on a slider, and leaves it as it was: the browser cancels its pointer.
  function keptWhileScrolling(input, moved) {
    let before = input.value;
    input.addEventListener("pointerdown", () => {
      before = input.value;
    });
    input.addEventListener("pointercancel", () => {
      input.value = before;
      moved();
    });
  }

  // A line of a group: a symbol, a range and its number. `given` is moved by `write(number)`.
  function slider(group, { name, label, range: [min, max, step], text }, { read, write }) {
    const line = add(group, "label");
    symbol(line, name);
    const input = add(line, "input", { type: "range", min, max, step, "aria-label": label });
    const value = add(line, "span", { class: "value" });
    const moved = () => write(Number(input.value));
    input.addEventListener("input", moved);
    keptWhileScrolling(input, moved);
    return (given) => {
      const number = read(given);
      input.value = number;
      value.textContent = text(number);
      set(input, { "aria-valuetext": value.textContent });
    };
  }

  // The slider of a component of theta, by its name.
  function weight(group, name, { names, ranges }, read, move) {
    const k = names.indexOf(name);
    const text = (number) => words.fixed(number, 3);
    return slider(group, { name, label: words.sliders[name], range: ranges[name], text }, {
      read: ({ theta }) => theta[k],
      write: (number) => move({ theta: read().theta.with(k, number) }),
    });
  }

  // A menu beside its name.
  function choice(row, { label, options, text }, { read, write }) {
    const line = add(row, "label", { class: "choice" });
    add(line, "span", {}, label);
    const select = add(line, "select", { "aria-label": label });
    for (const value of options) add(select, "option", { value }, text(value));
    select.addEventListener("change", () => write(options[select.selectedIndex]));
    return (given) => { select.value = read(given); };
  }

  window.nmpcrl = { ...window.nmpcrl, slider, weight, choice };
})();
