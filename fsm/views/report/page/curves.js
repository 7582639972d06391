// Curves with plotly.js, and the cursor that follows the motion.
"use strict";

const DASHES = ["solid", "dash", "dot", "dashdot"];
const MODEBAR = [["zoom2d", "pan2d", "autoScale2d", "toImage"]];
const OBJECT_LIMIT = 4;  // curves of selected objects that are shown at the same time

class Curves {
  constructor(palette) {
    this.palette = palette;
    this.shown = [];      // {figure, plot, drawn}
    this.over = "travel";
    this.moved = () => {};  // called with a time that the user points at
    this.watcher = new IntersectionObserver((entries) => {
      for (const entry of entries) if (entry.isIntersecting) this.drawOnce(this.shown.find((one) => one.box === entry.target));
    }, { rootMargin: "200px" });
  }

  colours() {
    const style = getComputedStyle(document.documentElement);
    const of = (name) => style.getPropertyValue(name).trim();
    return { text: of("--text"), grid: of("--grid"), paper: of("--card"), faint: of("--faint") };
  }

  // Figure with caption and plot, added to a parent.
  add(plot, parent, options = {}) {
    const box = element("div", { className: "plot", role: "img", "aria-label": plot.alt || plot.title });
    const line = element("div", { className: "cursor", hidden: true });
    const frame = element("div", { className: "frame" }, box, line);
    const head = element("h3", { textContent: plot.title });
    const figure = element("figure", { className: "curve" }, head, frame, element("figcaption", { textContent: [plot.alt, plot.note].filter(Boolean).join(" ") }));
    figure.dataset.key = plot.key || "";
    if (options.close) head.append(element("button", { className: "close", textContent: "×", title: "Remove this plot", onclick: () => this.remove(figure) }));
    parent.append(figure);
    const one = { figure, box, line, plot, drawn: false };
    this.shown.push(one);
    this.watcher.observe(box);
    return one;
  }

  remove(figure) {
    const one = this.shown.find((item) => item.figure === figure);
    if (!one) return;
    if (one.drawn) one.ready.finally(() => Plotly.purge(one.box));  // plotly cannot be stopped while it draws
    this.watcher.unobserve(one.box);
    this.shown = this.shown.filter((item) => item !== one);
    figure.remove();
  }

  clear() {
    for (const one of [...this.shown]) this.remove(one.figure);
  }

  drawOnce(one) {
    if (one && !one.drawn) { one.drawn = true; this.draw(one); }
  }

  drawAll() {
    this.shown.forEach((one) => this.drawOnce(one));
  }

  redraw() {
    this.shown.filter((one) => one.drawn).forEach((one) => this.draw(one));
  }

  // Abscissa of a plot over time or travel: values and label.
  abscissa(plot) {
    if (plot.time === undefined) return null;
    if (this.over === "travel" && plot.travel) return [plot.travel, plot.travel_label];
    if (this.over === "record") return [plot.record ||= this.recordsOf(plot.time), "record"];
    return [plot.time, "time (s)"];
  }

  // Broken record numbers of times; in a step that takes no time, the first record.
  recordsOf(times) {
    const all = this.records.time;
    let k = 0;
    return Float64Array.from(times, (time) => {
      while (k + 2 < all.length && all[k + 1] < time) k++;
      const span = all[k + 1] - all[k];
      return span > 0 ? k + Math.max(0, Math.min(1, (time - all[k]) / span)) : k;
    });
  }

  // Begins of the steps of the run over time or records: [{at, name}]; empty for a single step.
  steps() {
    const { time, steps } = this.records, found = [];
    steps.forEach((name, k) => { if (k === 0 || name !== steps[k - 1]) found.push({ name, at: this.over === "record" ? Math.max(k - 0.5, 0) : time[Math.max(k - 1, 0)] }); });
    return found.length > 1 ? found : [];
  }

  draw(one) {
    const { plot } = one, colours = this.colours(), axis = this.abscissa(plot);
    const traces = plot.kind === "map" ? this.map(plot, axis) : plot.kind === "bars" ? this.bars(plot) : plot.lines.flatMap((line, k) => this.line(plot, line, k, axis));
    const title = (text) => ({ text: plain(text || ""), font: { size: 12 } });
    const shapes = [], annotations = [];
    if (axis && axis[0] === plot.travel) {
      for (const stage of plot.stages || []) {
        shapes.push({ type: "rect", xref: "x", yref: "paper", x0: stage.from, x1: stage.to, y0: 0, y1: 1, fillcolor: stage.colour, opacity: stage.opacity, line: { width: 0 }, layer: "below" });
        annotations.push({ x: stage.from, y: 1, xref: "x", yref: "paper", text: plain(stage.name), showarrow: false, xanchor: "left", yanchor: "top", textangle: stage.to - stage.from < 0.2 * (plot.stages.at(-1).to || 1) ? 90 : 0, font: { size: 10, color: colours.faint } });
      }
      for (const mark of plot.marks || []) {
        traces.push({ x: [mark.x], y: [mark.y], mode: "markers+text", text: [(plot.marks.length < 6 || mark.name === "peak") ? plain(mark.text) : ""], hovertext: plain(mark.text), textposition: "top center", name: plain(mark.name), showlegend: false, marker: { size: 8, color: "#D55E00" }, textfont: { size: 11 }, hoverinfo: "text", cliponaxis: false });
      }
    }
    if (axis && axis[0] !== plot.travel && !plot.results) {
      for (const step of this.steps()) {
        shapes.push({ type: "line", xref: "x", yref: "paper", x0: step.at, x1: step.at, y0: 0, y1: 1, line: { color: colours.faint, width: 1, dash: "dot" } });
        annotations.push({ x: step.at, y: 1, xref: "x", yref: "paper", text: plain(step.name), showarrow: false, xanchor: "left", yanchor: "top", textangle: 90, font: { size: 10, color: colours.faint } });
      }
    }
    for (const x of plot.verticals || []) shapes.push({ type: "line", xref: "x", yref: "paper", x0: x, x1: x, y0: 0, y1: 0.05, line: { color: colours.faint, width: 1 } });
    const many = traces.filter((trace) => trace.showlegend !== false).length;
    const layout = {
      paper_bgcolor: colours.paper, plot_bgcolor: colours.paper, font: { color: colours.text, size: 11, family: "system-ui, sans-serif" },
      margin: { l: plot.kind === "map" ? 130 : 60, r: 12, t: 30, b: 44 }, shapes, annotations, hovermode: plot.kind === "map" ? "closest" : "x unified", showlegend: many > 1 && many < 25,
      legend: { orientation: "h", y: -0.22, font: { size: 10 } }, dragmode: "zoom", barmode: "group",
      hoverlabel: { bgcolor: colours.paper, bordercolor: colours.grid, font: { color: colours.text } },
      xaxis: { title: title(axis ? axis[1] : plot.xlabel), gridcolor: colours.grid, zerolinecolor: colours.grid, exponentformat: "power" },
      yaxis: { title: title(plot.kind === "map" ? "" : plot.ylabel), gridcolor: colours.grid, zerolinecolor: colours.grid, type: plot.log ? "log" : "linear", ...(plot.log ? { dtick: 1 } : {}), exponentformat: "power", automargin: true },
    };
    if (plot.limits && axis && axis[0] === plot.travel) {
      const margin = 0.25 * (plot.limits[1] - plot.limits[0]) || 1;
      layout.yaxis.range = [plot.limits[0] - margin, plot.limits[1] + margin];
    }
    if (plot.kind === "map") Object.assign(layout.yaxis, { autorange: "reversed", automargin: true, tickfont: { size: 10 }, tickvals: plot.names.map((name, k) => k), ticktext: plot.names.map((name) => plain(name.length > 34 ? `${name.slice(0, 31)}...` : name)) });
    one.box.style.height = plot.kind === "map" ? `${Math.min(640, 130 + 24 * plot.names.length)}px` : "300px";
    const config = { responsive: true, displaylogo: false, modeBarButtons: MODEBAR, toImageButtonOptions: { format: "svg", filename: plot.key || "curve" } };
    one.ready = Plotly.react(one.box, traces, layout, config).then(() => {
      if (!one.figure.isConnected) return;
      if (!one.wired) {
        one.wired = true;
        one.box.on("plotly_hover", (event) => this.pointed(one, event.points[0], false));
        one.box.on("plotly_click", (event) => this.pointed(one, event.points[0], true));
        one.box.on("plotly_relayout", () => this.place(one));
        one.box.on("plotly_afterplot", () => this.place(one));
      }
      this.place(one);
    });
  }

  line(plot, line, k, axis) {
    const colour = line.css || (line.thin ? "#888888" : this.palette[(line.colour ?? k) % (this.palette.length - 1)]);
    const dash = line.dash ? "dash" : DASHES[Math.floor((line.colour ?? 0) / (this.palette.length - 1)) % DASHES.length];
    const trace = {
      x: Array.from(line.x || axis[0]), y: Array.from(line.y), name: plain(line.name), mode: plot.dots ? "markers" : "lines", connectgaps: false,
      line: { color: colour === "#000000" ? this.colours().text : colour, width: line.thin ? 1 : 1.8, dash }, hovertemplate: "%{y:.4g}",
    };
    if (plot.cursor || !line.x) trace.customdata = Array.from(plot.cursor ? plot.cursor.time : plot.time);
    if (line.stack) Object.assign(trace, { stackgroup: line.stack, line: { width: 0.5, color: colour }, fillcolor: colour, legendgroup: line.name, showlegend: line.stack === "gain" });
    if (line.dash && plot.key === "energy") trace.line.color = this.colours().text;
    if (line.result !== undefined) trace.meta = { result: line.result };
    return [trace];
  }

  map(plot, axis) {
    const columns = plot.time.length;
    const rows = plot.names.map((name, k) => Array.from(plot.values.subarray(k * columns, (k + 1) * columns), (value) => (value > 0 ? value : null)));
    return [{
      type: "heatmap", x: Array.from(axis[0]), y: plot.names.map((name, k) => k), z: rows, colorscale: "Viridis", reversescale: true, customdata: rows.map(() => Array.from(plot.time)),
      text: plot.names.map((name) => new Array(columns).fill(plain(name))), hovertemplate: "%{text}<br>%{x:.4g}: %{z:.4g} N<extra></extra>",
      colorbar: { title: { text: plain(plot.ylabel), side: "right", font: { size: 11 } }, thickness: 12 }, showlegend: false,
    }];
  }

  bars(plot) {
    return plot.lines.map((line, k) => ({ type: "bar", x: Array.from(line.x), y: Array.from(line.y), name: plain(line.name), marker: { color: this.palette[k % 7] }, hovertemplate: "mode %{x}: %{y:.5g} Hz<extra></extra>" }));
  }

  pointed(one, point, click) {
    if (!point) return;
    let time = point.customdata;
    if (one.plot.kind === "map" && point.pointIndex) time = one.plot.time[point.pointIndex[1]];
    if (one.plot.kind === "bars" && click) this.modeChosen(point.curveNumber, point.pointIndex);
    if (one.plot.kind === "map" && click) this.pairChosen(one.plot.names[point.pointIndex[0]]);
    if (one.plot.results && click) this.resultChosen(point.data.meta.result);
    if (typeof time === "number" && (click || this.follow) && !one.plot.results) this.moved(time);
  }

  // Cursor at a time, in every plot over time or travel.
  cursor(time) {
    this.time = time;
    this.shown.forEach((one) => this.place(one));
  }

  place(one) {
    const { plot, line, box } = one, layout = box._fullLayout;
    const time = plot.cursor ? plot.cursor.time : plot.time;
    if (!one.drawn || !layout || !layout.xaxis || time === undefined || plot.results || this.time === undefined) { line.hidden = true; return; }
    const values = plot.cursor ? plot.cursor.x : this.abscissa(plot)[0];
    const k = nearestIndex(time, this.time), other = time[k] <= this.time ? Math.min(k + 1, values.length - 1) : Math.max(k - 1, 0);
    const span = time[other] - time[k], w = span ? Math.max(0, Math.min(1, (this.time - time[k]) / span)) : 0;
    const at = layout.xaxis.d2p(values[k] + w * (values[other] - values[k])), size = layout.xaxis._length;
    line.hidden = !(at >= -1 && at <= size + 1);
    line.style.left = `${layout.xaxis._offset + at}px`;
    line.style.top = `${layout.yaxis._offset}px`;
    line.style.height = `${layout.yaxis._length}px`;
  }
}

// Plot of a channel: its components over time or travel.
function channelPlot(channel, time, travel, label, records) {
  const [rows, count] = channel.values.shape;
  const pick = (list) => Float64Array.from(records, (k) => list[k]);
  const lines = channel.labels.map((name, c) => {
    const y = new Float32Array(rows);
    for (let i = 0; i < rows; i++) y[i] = channel.factor * channel.values[i * count + c];
    return { name: name || channel.quantity, y, colour: c };
  });
  const part = channel.of > count ? ` ${count} of ${channel.of} components.` : "";
  const plot = { key: channel.name, title: channel.name, alt: `${channel.text}.${part}`, ylabel: `${channel.quantity} (${channel.unit})`, time: pick(time), lines };
  if (travel) Object.assign(plot, { travel: pick(travel), travel_label: label });
  return plot;
}
