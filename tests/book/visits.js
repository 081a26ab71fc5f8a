// What `visits.py` asks of a page, in the browser.
{
const figures = [...document.querySelectorAll("figure.live")]

// Elements of the article wider than their place, but not what is only heard (MathML) or drawn.
const wide = () => [...document.querySelectorAll(".bd-article *")]
  .filter(one => one.clientWidth > 1 && one.scrollWidth > one.clientWidth + 1)
  .filter(one => !one.closest("mjx-assistive-mml, svg"))

// What begins left of what it scrolls in, where nobody can scroll to.
const left = () => [...document.querySelectorAll(".scrolls > *, .math > *")].filter(one =>
  one.getBoundingClientRect().left < one.parentElement.getBoundingClientRect().left - 1)

const beginnings = all => all.map(one => one.outerHTML.slice(0, 200))

window.visit = {
  begun: () => figures.every(one => one.querySelector("[role=status][aria-busy=false]")),
  width: () => document.documentElement.scrollWidth,
  figuresWidth: () => Math.max(...figures.map(one => one.scrollWidth)),
  open: () => document.querySelectorAll("details").forEach(box => (box.open = true)),
  settled: () => new Promise(done => {  // a browser may stop drawing
    requestAnimationFrame(() => requestAnimationFrame(done))
    setTimeout(done, 5000)
  }),

  // A page repeats formulas, words of code and signatures by the thousand: the first of each kind
  // stands for all.
  thin() {
    const seen = new Set()
    const many = ":is(pre, code, dt.sig) span[class], mjx-container"
    for (const one of document.querySelectorAll(many)) {
      const within = one.closest("a, code, dt, pre")?.className
      const kind = [one.className, one.getAttribute("display"), within].join()
      if (!seen.has(kind)) seen.add(kind)
      else if (one.matches("span")) one.replaceWith(...one.childNodes)
      else one.querySelectorAll("svg > *, math > *").forEach(part => part.remove())
    }
    document.body.normalize()
  },

  // In a view, text of one look stands for all text that has it: the same element and class in the
  // same, in the same colour and size, above the same backgrounds.
  firstOfEachLook() {
    const beneath = new Map([[null, ""]]), seen = new Set()
    for (const one of document.querySelectorAll("*")) {
      const style = getComputedStyle(one), parent = one.parentElement
      const own = [style.backgroundColor, style.backgroundImage, style.opacity, style.position]
      const plain = own.join() === "rgba(0, 0, 0, 0),none,1,static"
      beneath.set(one, beneath.get(parent) + (plain ? "" : own.join()))
      delete one.dataset.first
      const said = [...one.childNodes].some(node => node.nodeType === 3 && node.data.trim())
      if (!said || !one.checkVisibility({ visibilityProperty: true })) continue
      const look = [one.localName, one.className, parent.localName, parent.className, style.color,
        style.fontSize, style.fontWeight, style.textShadow, beneath.get(one)].join()
      if (!seen.has(look)) one.dataset.first = ""
      seen.add(look)
    }
    axe.configure({ rules: [{ id: "color-contrast", selector: "[data-first]" }] })
  },

  cut: () => beginnings(wide()
    .filter(one => ["hidden", "clip"].includes(getComputedStyle(one).overflowX))
    .concat(left())),
  stops: () => beginnings([...document.querySelectorAll(".math, .math *")]
    .filter(one => one.tabIndex === 0 && !one.matches("a"))),
  small: () => beginnings(
    [...document.querySelectorAll(".bd-article :is(summary, button, .download a)")]
      .filter(one => one.checkVisibility())
      .filter(one => Math.min(one.offsetWidth, one.offsetHeight) < 24)),
}
}
