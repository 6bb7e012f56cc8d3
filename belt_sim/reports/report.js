"use strict";
const plots = JSON.parse(document.getElementById("plots").textContent);
const PRINTED_WIDTH = 630; // px between the margins of an A4 page
const config = { responsive: true, displaylogo: false, displayModeBar: "hover", modeBarButtonsToRemove: ["lasso2d", "select2d"] };

function draw(id, figure) {
  const place = document.getElementById(id);
  if (place && figure) Plotly.react(place, figure.data, figure.layout, config);
}

draw("where", plots.where);
draw("drift", plots.drift);

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
    document.getElementById("before-after").scrollIntoView({ behavior: "smooth" });
  });
}

window.addEventListener("beforeprint", () => {
  for (const place of document.querySelectorAll(".js-plotly-plot")) Plotly.relayout(place, { width: PRINTED_WIDTH });
});
window.addEventListener("afterprint", () => {
  for (const place of document.querySelectorAll(".js-plotly-plot")) Plotly.relayout(place, { width: null, autosize: true });
});
