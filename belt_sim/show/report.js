"use strict";
const plots = JSON.parse(document.getElementById("plots").textContent);
const PRINTED_WIDTH = 630; // px between the margins of an A4 page
const config = { displaylogo: false, displayModeBar: false };
const dark = window.matchMedia("(prefers-color-scheme: dark)");
const drawn = new Map(); // place -> its figure

// A figure names colours of the style (--ink); here they become those of the scheme that the reader has.
function inked(x, style) {
  if (typeof x === "string") return x.startsWith("--") ? style.getPropertyValue(x).trim() : x;
  if (Array.isArray(x)) return x.map((v) => inked(v, style));
  if (x && typeof x === "object") return Object.fromEntries(Object.entries(x).map(([k, v]) => [k, inked(v, style)]));
  return x;
}

function draw(id, figure) {
  const place = document.getElementById(id);
  if (!place || !figure) return;
  drawn.set(id, figure);
  if (place.closest("details:not([open])")) return; // it has no width yet; drawn when it is opened
  const { data, layout } = inked(figure, getComputedStyle(document.documentElement));
  Plotly.react(place, data, layout, config);
}

function again() {
  for (const [id, figure] of drawn) draw(id, figure);
}

for (const [name, figures] of Object.entries(plots)) {
  if (Array.isArray(figures) && name !== "overlays") figures.forEach((figure, k) => draw(`${name}-${k}`, figure));
}

const chooser = document.getElementById("run");
if (chooser) {
  const show = () => draw("overlay", plots.overlays[chooser.selectedIndex]);
  const step = (by) => {
    const n = plots.overlays.length;
    chooser.selectedIndex = (chooser.selectedIndex + by + n) % n;
    show();
  };
  chooser.selectedIndex = plots.first;
  chooser.addEventListener("change", show);
  document.getElementById("earlier").addEventListener("click", () => step(-1));
  document.getElementById("later").addEventListener("click", () => step(1));
  show();
}

for (const cell of document.querySelectorAll("tr[data-run]")) {
  cell.addEventListener("click", () => {
    const names = [...chooser.options].map((o) => o.text);
    const k = names.findIndex((n) => n.split(/[\s,]+/).includes(cell.dataset.run) && n.split(/[\s,]+/).includes(cell.dataset.signal));
    if (k < 0) return;
    chooser.selectedIndex = k;
    chooser.dispatchEvent(new Event("change"));
    document.getElementById("error").scrollIntoView({ behavior: "smooth" });
  });
}

// The browser's own word that a place has another width; a window that is resized is only one of the reasons.
const widths = new ResizeObserver((entries) => {
  for (const { target } of entries) if (target.classList.contains("js-plotly-plot") && target.clientWidth) Plotly.Plots.resize(target);
});
for (const place of document.querySelectorAll(".plot")) widths.observe(place);

for (const fold of document.querySelectorAll("details")) fold.addEventListener("toggle", again);
dark.addEventListener("change", again);

window.addEventListener("beforeprint", () => {
  for (const fold of document.querySelectorAll("details")) fold.open = true;
  again();
  for (const place of document.querySelectorAll(".js-plotly-plot")) {
    const width = place.closest(".plots") ? PRINTED_WIDTH / 2 - 12 : PRINTED_WIDTH;
    Plotly.relayout(place, { width });
  }
});
window.addEventListener("afterprint", () => {
  for (const place of document.querySelectorAll(".js-plotly-plot")) Plotly.relayout(place, { width: null, autosize: true });
});
