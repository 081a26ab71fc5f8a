// A deck: formulas are typeset, those that are too wide and slides that are too full get smaller letters or a second
// slide, then it begins; a live figure gets letters with which it fits.
"use strict";

window.MathJax = {
  options: { menuOptions: { settings: { inTabOrder: false } } },
  startup: { pageReady: () => MathJax.startup.defaultPageReady().then(begin) },
};

const SIZE = { width: 1280, height: 720 };
const SMALLEST = 2 / 3; // of the letters of a slide: 20 px
const LARGEST = 150, LEAST = 125; // of the letters of a live figure, over those of a page, which has 16 px [%]

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
  Reveal.on("slidechanged", fitLive);
  const seen = new ResizeObserver(fitLive);
  document.querySelectorAll(".live-figure figure").forEach((figure) => seen.observe(figure));
  document.documentElement.dataset.ready = "";
}

// Smaller letters, as long as `tooLarge()`.
function shrink(element, tooLarge) {
  const whole = parseFloat(element.style.fontSize) || 100; // %
  for (let size = 1; tooLarge() && size > SMALLEST; size -= 0.02) element.style.fontSize = `${whole * size}%`;
}

function fit(slide) {
  Object.assign(slide.style, { display: "block", width: `${SIZE.width}px` });
  for (const formula of slide.querySelectorAll("mjx-container[display]")) {
    shrink(formula, () => formula.offsetWidth > formula.parentElement.clientWidth);
  }
  const tooLarge = () => slide.scrollHeight > SIZE.height || slide.scrollWidth > SIZE.width;
  shrink(slide, tooLarge);
  if (tooLarge()) divide(slide);
  slide.style.display = slide.style.width = "";
}

// Half of the rows of a table that is too long go to a slide after it.
function divide(slide) {
  const count = slide.querySelectorAll("tr:has(td)").length;
  if (count < 2) return;
  const next = slide.cloneNode(true);
  next.id += "-more";
  next.querySelectorAll("aside.notes, caption").forEach((part) => part.remove());
  for (const [part, goes] of [[slide, (k) => k >= count / 2], [next, (k) => k < count / 2]]) {
    [...part.querySelectorAll("tr:has(td)")].filter((_, k) => goes(k)).forEach((row) => row.remove());
    part.style.fontSize = "";
  }
  slide.after(next);
  [slide, next].forEach(fit);
}

// The largest letters with which the live figure that is seen fits; its sizes are in rem.
function fitLive() {
  const box = document.querySelector("section.present .live-figure");
  if (!box) return;
  const whole = document.documentElement.style;
  const tooLarge = () => box.scrollHeight > box.clientHeight || box.scrollWidth > box.clientWidth;
  for (let size = LARGEST; size === LARGEST || (tooLarge() && size >= LEAST); size -= 1) whole.fontSize = `${size}%`;
}
