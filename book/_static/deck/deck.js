// A deck: formulas are typeset, those that are too wide and slides that are too full get smaller letters, then it begins.
"use strict";

window.MathJax = {
  options: { menuOptions: { settings: { inTabOrder: false } } },
  startup: { pageReady: () => MathJax.startup.defaultPageReady().then(begin) },
};

const SIZE = { width: 1280, height: 720 };
const SMALLEST = 0.5; // of the letters of a slide

const dark = matchMedia("(prefers-color-scheme: dark)").matches;
document.documentElement.dataset.theme = dark ? "dark" : "light"; // for live figures

async function begin() {
  if (location.search.includes("print-pdf")) {
    document.querySelectorAll("section:has(.live-figure)").forEach((slide) => slide.remove());
  }
  document.querySelectorAll("aside.notes mjx-assistive-mml").forEach((formula) => formula.remove()); // seen there
  await Promise.all([...document.images].map((image) => image.decode().catch(() => {})));
  document.querySelectorAll(".slides > section").forEach(fit);
  await Reveal.initialize({
    ...SIZE,
    margin: 0,
    center: false,
    hash: true,
    slideNumber: "c/t",
    transition: "none",
    pdfSeparateFragments: false,
    pdfMaxPagesPerSlide: 1,
    keyboardCondition: () => !document.activeElement.closest(".live-figure"),
    keyboard: { 78: () => Reveal.configure({ showNotes: !Reveal.getConfig().showNotes }) }, // N
    plugins: [RevealNotes],
  });
  document.documentElement.dataset.ready = "";
}

// Smaller letters, as long as `tooLarge()`.
function shrink(element, tooLarge) {
  const whole = parseFloat(element.style.fontSize) || 100; // %
  for (let size = 1; tooLarge() && size > SMALLEST; size -= 0.05) element.style.fontSize = `${whole * size}%`;
}

function fit(slide) {
  Object.assign(slide.style, { display: "block", width: `${SIZE.width}px` });
  for (const formula of slide.querySelectorAll("mjx-container[display]")) {
    shrink(formula, () => formula.offsetWidth > formula.parentElement.clientWidth);
  }
  shrink(slide, () => slide.scrollHeight > SIZE.height || slide.scrollWidth > SIZE.width);
  slide.style.display = slide.style.width = "";
}
