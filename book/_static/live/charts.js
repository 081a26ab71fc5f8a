// Small charts: lines over the episodes, and a cursor. Limits and titles are text beside the picture.
(() => {
  "use strict";

  const { add, set } = window.nmpcrl;

  // A path through [x, y] in shares of the chart; it is broken where y is not a number.
  function path(places) {
    let pen = "M";
    return places.map(([x, y]) => {
      if (!Number.isFinite(y)) {
        pen = "M";
        return "";
      }
      const stroke = `${pen}${x.toFixed(4)} ${(1 - y).toFixed(4)}`;
      pen = "L";
      return stroke;
    }).join("");
  }

  // A line in the colour and the dashes of a learner; pale if it stands behind.
  function trace(parent, name, attributes, { color, dashes, pale = false }) {
    const line = add(parent, name, { class: pale ? "learner pale" : "learner", "stroke-dasharray": dashes, ...attributes });
    line.style.setProperty("--learner", color);
  }

  // `draw(lines, [least, most], text)` with lines of { points, look }, then `point(x)`, which puts a dot on
  // each line that is there; x runs to `last`.
  function chart(parent, { label, last }) {
    const whole = add(parent, "div", { class: "chart" });
    const title = add(whole, "p");
    const svg = add(whole, "svg", { viewBox: "0 0 1 1", preserveAspectRatio: "none", role: "img", "aria-label": label });
    const cursor = add(svg, "line", { class: "cursor", y1: 0, y2: 1 });
    const drawn = add(svg, "g"), dots = add(svg, "g", { class: "points" });
    const top = add(whole, "span", { class: "top" }), bottom = add(whole, "span", { class: "bottom" });

    let shown = [];

    function draw(lines, [least, most], text) {
      const height = most - least || 1;
      shown = lines.map(({ points, look }) => ({ look, places: points.map(([x, y]) => [x / last, (y - least) / height]) }));
      drawn.replaceChildren();
      for (const { places, look } of shown) trace(drawn, "path", { d: path(places) }, look);
      top.textContent = text(most);
      bottom.textContent = text(least);
    }
    function point(x) {
      const at = x / last;
      set(cursor, { x1: at, x2: at });
      dots.replaceChildren();
      for (const { places, look } of shown.filter((one) => !one.look.pale)) {
        const place = places.find((one) => one[0] === at);
        if (place) trace(dots, "path", { d: path([place, place]) }, { ...look, dashes: "" });
      }
    }
    return { title, draw, point };
  }

  // What a line of a look is called.
  function key(parent, text, look) {
    const item = add(parent, "span");
    trace(add(item, "svg", { viewBox: "0 0 34 4", "aria-hidden": true }), "path", { d: "M0 2H34" }, look);
    item.append(text);
  }

  window.nmpcrl = { ...window.nmpcrl, chart, trace, key };
})();
