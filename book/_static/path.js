/* Check marks for the steps of "Learn alone". A step is named by the address of its first link; the marks
   stay in this browser under KEY: [name, ...]. Without this script the steps are a plain list. */
(() => {
  const KEY = "nmpcrl.path";
  const words = {
    progress: (done, all) => `${done} of ${all} steps are done.`,
    kept: "Kept in this browser only.",
    unkept: "This browser keeps nothing: the marks are gone when the page closes.",
    reset: "Clear all marks",
  };

  let marks = new Set();
  let keeps = true;

  function recall() {
    try {
      const found = JSON.parse(localStorage.getItem(KEY) ?? "[]");
      if (Array.isArray(found)) marks = new Set(found.filter((one) => typeof one === "string"));
    } catch (error) {
      keeps = error instanceof SyntaxError;
    }
  }

  function keep() {
    try {
      localStorage.setItem(KEY, JSON.stringify([...marks]));
    } catch {
      keeps = false;
    }
  }

  /* A box before the words of a step; its name is the words. */
  function step(item, index, changed) {
    const link = item.querySelector("a");
    const words = item.querySelector(":scope > p") ?? item;
    const name = link ? link.getAttribute("href") : words.textContent.trim();
    const box = document.createElement("input");
    const label = document.createElement("span");
    label.id = `step-${index}`;
    label.append(...words.childNodes);
    Object.assign(box, { type: "checkbox", checked: marks.has(name) });
    box.setAttribute("aria-labelledby", label.id);
    words.append(box, label);
    box.addEventListener("change", () => {
      if (box.checked) marks.add(name);
      else marks.delete(name);
      keep();
      changed();
    });
    return { name, box };
  }

  function start() {
    const lists = [...document.querySelectorAll(".path > ul")];
    if (!lists.length) return;
    recall();
    const count = Object.assign(document.createElement("span"), { className: "path-count" });
    count.setAttribute("role", "status");
    const again = Object.assign(document.createElement("button"), { type: "button", textContent: words.reset });
    const changed = () => {
      const done = steps.filter(({ box }) => box.checked).length;
      count.textContent = `${words.progress(done, steps.length)} ${keeps ? words.kept : words.unkept}`;
    };
    const items = lists.flatMap((list) => [...list.children]);
    const steps = items.map((item, index) => step(item, index, changed));
    again.addEventListener("click", () => {
      marks.clear();
      steps.forEach(({ box }) => (box.checked = false));
      keep();
      changed();
    });
    const line = document.createElement("p");
    line.className = "path-progress";
    line.append(count, " ", again);
    lists[0].closest("section").before(line);
    document.body.classList.add("path-marked");
    changed();
  }

  document.addEventListener("DOMContentLoaded", start);
})();
