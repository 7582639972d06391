// Texts and tables of a result, and the comparison of several results.
"use strict";

function fillSections(result, parent, moveTo) {
  parent.replaceChildren();
  for (const section of result.sections) {
    const box = element("section", { className: `card ${section.kind || ""}` }, element("h2", { textContent: section.title }));
    if (section.rows) box.append(element("dl", {}, ...section.rows.flatMap(([label, text], k) => [
      element("dt", { textContent: k && section.rows[k - 1][0] === label ? "" : label }), element("dd", { textContent: text }),
    ])));
    if (section.lines) box.append(element("ul", {}, ...section.lines.map((text) => element("li", { textContent: text }))));
    if (section.table) box.append(table(section.head, section.table, section.times && ((row) => moveTo(section.times[row]))));
    parent.append(box);
  }
}

function table(head, rows, chosen) {
  const body = element("tbody");
  rows.forEach((row, k) => {
    const cells = row.map((text) => element("td", { textContent: text }));
    if (chosen && row.length) cells[0].replaceChildren(element("button", { className: "link", textContent: row[0], title: "Show this in the motion", onclick: () => chosen(k) }));
    body.append(element("tr", {}, ...cells));
  });
  const top = element("thead", {}, element("tr", {}, ...head.map((text) => element("th", { scope: "col", textContent: text }))));
  return element("div", { className: "wide" }, element("table", {}, top, body));
}

const AXES = 9;  // largest number of axes with parallel coordinates

// Several results: overlaid curves, scatter, parallel coordinates, and a table.
class Comparison {
  constructor(page, data) {
    Object.assign(this, { page, data });
    page.comparison = this;
    at("compare").hidden = false;
    const label = (column) => `${column.name}${column.unit ? ` (${column.unit})` : ""}`;
    this.numbers = data.columns.filter((column) => column.values.filter((value) => typeof value === "number").length > 1);
    if (this.numbers.every((column) => column.counter)) this.numbers = [];
    for (const id of ["scatter-x", "scatter-y", "scatter-colour"]) {
      at(id).append(...this.numbers.map((column, k) => element("option", { value: k, textContent: label(column) })));
      at(id).onchange = () => this.draw();
    }
    const outputs = this.numbers.flatMap((column, k) => (column.input ? [] : [k])), input = this.numbers.findIndex((column) => column.input);
    const [x, y, colour] = input < 0 ? outputs : [input, ...outputs];
    at("scatter-x").value = x;
    at("scatter-y").value = y ?? x;
    at("scatter-colour").value = colour ?? y ?? x;
    const rows = data.names.map((name, k) => [name, ...data.columns.map((column) => typeof column.values[k] === "number" ? shortNumber(column.values[k]) : column.values[k] ?? "")]);
    at("compare-table").append(table(["result", ...data.columns.map(label)], rows, (k) => page.choose(k)));
    page.curves.resultChosen = (k) => page.choose(k);
    this.ready = unpackAll(data.overlay).then((overlay) => { this.overlay = overlay; this.draw(); });
  }

  draw() {
    if (!this.overlay) return;
    const colours = this.page.curves.colours(), { palette, maps } = this.page.data;
    const font = { color: colours.text, size: 11, family: "system-ui, sans-serif" };
    const base = { paper_bgcolor: colours.paper, plot_bgcolor: colours.paper, font, margin: { l: 60, r: 12, t: 34, b: 46 } };
    const axis = (text) => ({ title: { text: plain(text) }, gridcolor: colours.grid, zerolinecolor: colours.grid, automargin: true });
    const config = { responsive: true, displaylogo: false, modeBarButtons: MODEBAR };
    const label = (column) => `${column.name}${column.unit ? ` (${column.unit})` : ""}`;
    const choose = (box, of) => {
      if (box.dataset.wired) return;
      box.dataset.wired = "true";
      box.on("plotly_click", (event) => { const k = of(event.points[0]); if (k !== undefined) this.page.choose(k); });
    };

    at("overlay-box").hidden = !this.overlay.length;
    if (this.overlay.length) {
      const traces = this.overlay.map((one, k) => ({
        x: Array.from(one.travel), y: Array.from(one.y), name: plain(one.name), mode: "lines", hovertemplate: "%{y:.4g}", meta: one.result,
        line: { width: 1.6, dash: DASHES[Math.floor(k / 7) % 4], color: palette[k % 7] === "#000000" ? colours.text : palette[k % 7] },
      }));
      const first = this.overlay[0];
      Plotly.react(at("overlay"), traces, { ...base, xaxis: axis(first.travel_label), yaxis: axis(first.turns ? "moment (N m)" : "force (N)"), showlegend: traces.length < 25, legend: { font: { size: 10 } }, hovermode: "closest" }, config)
        .then((box) => choose(box, (point) => point.data.meta));
    }
    if (this.numbers.length) {
      const [x, y, c] = ["scatter-x", "scatter-y", "scatter-colour"].map((id) => this.numbers[Number(at(id).value)]);
      const scatter = [{ x: x.values, y: y.values, text: this.data.names.map(plain), mode: "markers", hovertemplate: "%{text}<br>%{x:.5g}, %{y:.5g}<extra></extra>", marker: { size: 10, color: c.values, colorscale: "Viridis", showscale: true, colorbar: { title: { text: plain(label(c)), side: "right" }, thickness: 12 } } }];
      Plotly.react(at("scatter"), scatter, { ...base, xaxis: axis(label(x)), yaxis: axis(label(y)), hovermode: "closest" }, config).then((box) => choose(box, (point) => point.pointIndex));
      const varies = (column) => new Set(column.values).size > 1;
      const chosen = this.numbers.filter((column) => varies(column) && !column.counter).slice(0, AXES);
      const complete = this.data.names.flatMap((name, k) => (chosen.every((column) => typeof column.values[k] === "number") ? [k] : []));
      const dimensions = (complete.length > 1 ? chosen : []).map((column) => {
        const values = complete.map((k) => column.values[k]), low = Math.min(...values), high = Math.max(...values);
        return { label: plain(label(column)), values, range: high > low ? [low, high] : [low - 1, high + 1] };
      });
      at("parallel-note").textContent = complete.length < this.data.names.length ? `${complete.length} of ${this.data.names.length} results have all of these numbers.` : "";
      const shades = document.documentElement.dataset.theme === "dark" ? maps.viridis.slice(8) : maps.viridis.slice(0, -4);
      const line = { color: complete.map((k) => c.values[k] ?? 0), colorscale: shades.map((colour, k) => [k / (shades.length - 1), colour]) };
      at("parallel-box").hidden = dimensions.length < 2;
      if (dimensions.length > 1) Plotly.react(at("parallel"), [{ type: "parcoords", dimensions, line, labelfont: { size: 11, color: colours.text }, tickfont: { size: 9, color: colours.text }, rangefont: { size: 9, color: colours.text }, labelangle: -18 }], { ...base, margin: { l: 70, r: 100, t: 110, b: 20 } }, config);
    }
    else at("parallel-box").hidden = true;
    at("scatter-box").hidden = !this.numbers.length;
  }
}
