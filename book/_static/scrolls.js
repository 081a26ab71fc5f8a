/* What is too wide for its place scrolls by itself: then the keyboard reaches it, it has a name, and
   `data-more` says at which of its edges something is hidden (nmpcrl.css draws a shadow there).
   It is a group, no region: no list of landmarks should hold every listing of a page. */
(() => {
  function name(box) {
    if (box.matches("pre")) return "Code";
    if (box.matches(".scrolls")) return ["Table", first(box, "caption")].filter(Boolean).join(": ");
    return ["Formula", first(box.closest(".math"), ".eqno")].filter(Boolean).join(" ");
  }

  const first = (box, selector) => box.querySelector(selector)?.firstChild?.textContent.trim();

  function look(box) {
    const hidden = box.scrollWidth - box.clientWidth;
    const edges = { left: box.scrollLeft > 1, right: box.scrollLeft < hidden - 1 };
    const more = Object.keys(edges).filter((edge) => edges[edge]).join(" ");
    const said = { tabindex: "0", role: "group", "aria-label": name(box), "data-more": more };
    for (const [attribute, value] of Object.entries(said)) {
      if (hidden > 1) box.setAttribute(attribute, value);
      else box.removeAttribute(attribute);
    }
  }

  const resized = new ResizeObserver((entries) => entries.forEach(({ target }) => look(target)));

  function watch(selector) {
    for (const box of document.querySelectorAll(selector)) {
      box.addEventListener("scroll", () => look(box), { passive: true });
      resized.observe(box); // looks at once, and again when what is folded opens
    }
  }

  document.addEventListener("DOMContentLoaded", () => {
    watch(".bd-article :is(.scrolls, pre)");
    window.MathJax?.startup?.promise?.then(() => watch(".bd-article :is(div.math mjx-container, span.math)"));
  });
})();
