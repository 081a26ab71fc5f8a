// A map in metres with y upwards, and handles on it that pointer, click and keys move.
(() => {
  "use strict";

  const { add, set, parts: { clamp } } = window.nmpcrl;
  const STEP = { plain: 0.1, large: 0.5 }; // of an arrow key [m]
  const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

  // `view` is [least x, least y, width, height].
  function plane(parent, view, label) {
    const [left, bottom, width, height] = view;
    const svg = add(parent, "svg", {
      viewBox: `${left} ${-bottom - height} ${width} ${height}`, role: "group", "aria-label": label,
    });
    const ground = add(svg, "g", { transform: "scale(1 -1)" });
    let chosen = null; // what has the focus, which a click on the ground moves

    const inside = ([x, y]) => [clamp(x, left, left + width), clamp(y, bottom, bottom + height)];
    const under = (event) => {
      const { x, y } = new DOMPoint(event.clientX, event.clientY)
        .matrixTransform(ground.getScreenCTM().inverse());
      return inside([x, y]);
    };
    const onGround = (event) => !event.target.closest(".handle");
    svg.addEventListener("mousedown", (event) => { // or the focus would be lost
      if (onGround(event)) event.preventDefault();
    });
    svg.addEventListener("click", (event) => {
      if (chosen && onGround(event)) chosen.to(under(event));
    });
    new ResizeObserver(() => { // letters and targets of a finger keep their size in pixels
      if (svg.clientWidth) svg.style.setProperty("--px", width / svg.clientWidth);
    }).observe(svg);

    // A text beside a point, which is not upside down.
    function write(text, x, y, attributes) {
      add(svg, "text", { x, y: -y, ...attributes }, text);
    }

    // Something to move: `to(point)` puts it somewhere, `by(dx, dy)` is an arrow key's step.
    function handle({ label: name, kind, range, to, by }) {
      const group = add(ground, "g", {
        class: `handle ${kind}`, role: "slider", tabindex: 0, "aria-label": name,
        "aria-valuemin": range[0].toFixed(2), "aria-valuemax": range[1].toFixed(2),
      });
      const body = add(group, "g");
      add(group, "circle", { class: "reach" });
      let grip = null; // from the pointer to the middle
      let middle = [0, 0];
      group.addEventListener("focus", () => { chosen = { to }; });
      group.addEventListener("blur", () => { chosen = null; });
      group.addEventListener("pointerdown", (event) => {
        const [x, y] = under(event);
        grip = [middle[0] - x, middle[1] - y];
        group.setPointerCapture(event.pointerId);
        group.focus({ preventScroll: true });
        event.preventDefault();
      });
      group.addEventListener("pointermove", (event) => {
        if (!grip) return;
        const [x, y] = under(event);
        to([x + grip[0], y + grip[1]]);
      });
      const drop = () => { grip = null; };
      group.addEventListener("pointerup", drop);
      group.addEventListener("pointercancel", drop);
      group.addEventListener("keydown", (event) => {
        const arrow = ARROWS[event.key];
        if (!arrow || event.altKey || event.ctrlKey || event.metaKey) return;
        const step = event.shiftKey ? STEP.large : STEP.plain;
        by(arrow[0] * step, arrow[1] * step);
        event.preventDefault();
        event.stopPropagation();
      });
      const put = (point, now, text) => {
        middle = point;
        set(group, {
          transform: `translate(${point[0]} ${point[1]})`, "aria-valuenow": now.toFixed(2), "aria-valuetext": text,
        });
      };
      return { body, put };
    }

    return { ground, range: [left, left + width], inside, write, handle };
  }

  window.nmpcrl = { ...window.nmpcrl, plane };
})();
