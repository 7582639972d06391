// Page: joins player, curves, selection, tables, and keys.
"use strict";

const at = (id) => document.getElementById(id);

async function startPage(data) {
  if (!("DecompressionStream" in window)) {
    at("status").textContent = "This page needs a browser of 2023 or later.";
    return;
  }
  await runLibrary("plotly");
  const curves = new Curves(data.palette);
  let player = null;
  try {
    await runLibrary("three");
    const drawn = Math.max(...data.results.map((result) => (result.player ? result.player.quads.shape[0] + result.player.creases.length : 0)));
    player = new Player(at("canvas"), data.palette, data.maps, drawn);
  } catch (error) {
    at("status").textContent = "This browser has no WebGL: the motion cannot be shown; the curves can.";
    at("stage").hidden = true;
  }
  return new Page(data, player, curves);
}

class Page {
  constructor(data, player, curves) {
    Object.assign(this, { data, player, curves, playing: false, cache: new Map() });
    fsmReport.page = this;
    document.title = data.title;
    at("title").textContent = data.title;
    at("version").textContent = `fsm ${data.version}`;
    const many = data.results.length > 1;
    at("result-label").hidden = !many;
    data.results.forEach((result, k) => at("result").append(element("option", { value: k, textContent: result.name })));
    at("result").onchange = () => this.choose(Number(at("result").value));
    this.wire();
    this.theme(matchMedia("(prefers-color-scheme: dark)").matches);
    if (data.compare) new Comparison(this, data.compare);
    this.started = this.choose(0).then(() => { fsmReport.ready = true; document.body.dataset.ready = "true"; });
  }

  async choose(number) {
    this.number = number;
    at("result").value = number;
    if (!this.cache.has(number)) this.cache.set(number, await unpackAll(this.data.results[number]));
    const result = this.result = this.cache.get(number);
    this.curves.clear();
    const shows = Boolean(this.player && result.player);
    at("motion").hidden = !shows;
    at("no-shape").hidden = Boolean(result.player);
    if (shows) {
      this.player.load(result.player);
      this.player.theme(document.documentElement.dataset.theme === "dark");
      const count = result.player.records.length;
      Object.assign(at("slider"), { min: 0, max: count - 1, step: count > 60 ? 1 : 0.1, value: 0 });
      this.fillOptions();
    }
    this.fillObjects();
    const choices = [...(result.travel ? ["travel"] : []), "time", "record"];
    at("over").replaceChildren(...choices.map((value) => element("option", { value, textContent: value === "record" ? "records (steps equally wide)" : value })));
    at("over").value = this.curves.over = result.over;
    this.curves.records = { time: result.time, steps: Array.from(result.steps, (k) => result.step_names[k]) };
    at("curves").replaceChildren();
    for (const plot of result.plots) this.curves.add(plot, at("curves"));
    fillSections(result, at("texts"), (time) => this.moveTo(time));
    at("notes").replaceChildren(...result.notes.map((text) => element("li", { textContent: text })));
    at("case").textContent = result.case;
    this.select(null);
    this.show(0);
  }

  // Show a result with more records in the place of the present one, from the same side.
  async renew(result) {
    await this.started;
    const { player } = this, kept = player && player.data && ["azimuth", "elevation", "distance", "target"].map((name) => [name, player[name]]);
    const { selected } = this, last = !this.result.player || this.frame >= this.result.player.records.length - 1.001 || this.frame === 0;
    const { frame } = this;
    this.data.results[this.number] = result;
    this.cache.delete(this.number);
    await this.choose(this.number);
    if (kept) Object.assign(player, Object.fromEntries(kept), { fitted: "" });
    this.show(last ? Infinity : frame);
    if (selected) this.select(this.objects.find((one) => one.name === selected.name) || null);
  }

  // ---------------------------------------------------------------------------------------------- motion

  // Show the shape with a broken number.
  show(number) {
    if (!this.player || !this.result.player) return;
    const { records } = this.result.player;
    this.frame = Math.max(0, Math.min(records.length - 1, number));
    if (!this.mode) this.player.show(this.frame);
    at("slider").value = this.frame;
    const record = between(records, this.frame), time = between(this.result.time, record);
    this.time = time;
    const travel = this.result.travel ? `, ${withUnit(this.result.travel_label, between(this.result.travel, record))}` : "";
    const step = this.result.step_names[this.result.steps[Math.round(record)] || 0];
    const text = `${shortNumber(time)} s${travel}${step ? `, step ${step}` : ""}`;
    at("now").textContent = text;
    at("slider").setAttribute("aria-valuetext", text);
    this.curves.cursor(time);
    this.legend();
  }

  moveTo(time) {
    if (!this.result.player || this.playing) return;
    const { records } = this.result.player, times = records.map((record) => this.result.time[record]);
    const k = nearestIndex(times, time), other = times[k] < time ? k + 1 : k - 1;
    const span = other >= 0 && other < times.length ? times[other] - times[k] : 0;
    this.show(k + (span ? ((time - times[k]) / span) * (other - k) : 0));
  }

  play(on) {
    this.playing = on;
    at("play").textContent = on ? "Pause" : "Play";
    at("play").setAttribute("aria-pressed", String(on));
    if (!on) return;
    let last = performance.now();
    const tick = (now) => {
      if (!this.playing) return;
      const passed = (now - last) / 1000, speed = Number(at("speed").value);
      last = now;
      if (this.mode) {
        this.phase = (this.phase || 0) + 6.28 * 0.5 * speed * passed;
        this.player.showMode(this.mode, this.phase);
      } else {
        const end = this.result.player.records.length - 1;
        let next = this.frame + (speed * passed * end) / 8;
        if (next >= end) next = at("loop").checked ? 0 : end;
        this.show(next);
        if (next >= end) { this.play(false); return; }
      }
      requestAnimationFrame(tick);
    };
    if (!this.mode && this.frame >= this.result.player.records.length - 1) this.frame = 0;
    requestAnimationFrame(tick);
  }

  // ---------------------------------------------------------------------------------------------- options

  fillOptions() {
    const { player } = this.result, colour = at("colour"), wanted = colour.value;
    const options = [["part", "parts"], ["displacement", "displacement (mm)"], ...player.colours.map((field) => [field.name, `${field.name} (${field.unit})`])];
    colour.replaceChildren(...options.map(([value, text]) => element("option", { value, textContent: text })));
    colour.value = options.some(([value]) => value === wanted) ? wanted : "part";
    this.player.options.colour = colour.value;
    at("mode").replaceChildren(element("option", { value: "", textContent: "run" }), ...player.modes.map((mode, k) => element("option", { value: k, textContent: `${mode.name}: ${shortNumber(mode.frequency)} Hz` })));
    at("mode-label").hidden = !player.modes.length;
    this.mode = null;
    at("joint-forces-label").hidden = !player.arrows.some((arrow) => arrow.kind === "joint");
    at("arrows-label").hidden = !player.arrows.length;
    at("contacts-label").hidden = !player.contacts.length;
    at("mesh-label").hidden = player.quads.length / 4 > 20000;
  }

  chooseMode(text) {
    this.mode = text === "" ? null : this.result.player.modes[Number(text)];
    at("mode").value = text;
    if (this.mode) this.player.showMode(this.mode, Math.PI / 2);
    else this.show(this.frame);
    this.legend();
  }

  legend() {
    const range = this.player.range(), bar = at("legend");
    bar.hidden = !range;
    if (!range) return;
    const field = this.player.field(), colours = this.data.maps[range[2]];
    const gradient = `linear-gradient(to right, ${colours.join(",")})`;
    if (at("legend-bar").style.background !== gradient) at("legend-bar").style.background = gradient;
    const ofMode = !field && this.mode;
    at("legend-name").textContent = field ? `${field.name} (${field.unit})` : ofMode ? "mode shape, largest 1" : "displacement (mm)";
    at("legend-low").textContent = shortNumber(range[0]);
    at("legend-high").textContent = ofMode ? "1" : shortNumber(range[1]);
  }

  // ---------------------------------------------------------------------------------------------- selection

  // Objects that can be selected, with the owners of their channels.
  fillObjects() {
    const { player, channels } = this.result, owners = new Set(channels.map((channel) => channel.owner)), used = new Set();
    const groups = { "parts": [], "creases": [], "joints": [], "contacts": [], "other": [] };
    const put = (group, kind, index, name, list) => {
      list.forEach((owner) => used.add(owner));
      groups[group].push({ kind, index, name, owners: list.filter((owner) => owners.has(owner)) });
    };
    if (player) {
      player.parts.forEach((part, k) => put("parts", "part", k, part.name, part.owners));
      player.creases.forEach((crease, k) => put("creases", "crease", k, crease.name, [crease.name]));
      player.joints.forEach((joint, k) => put("joints", "joint", k, joint.name, [joint.name]));
      player.contacts.forEach((contact, k) => put("contacts", "contact", k, contact.title, [contact.name]));
    }
    for (const owner of owners) if (!used.has(owner)) put("other", "other", -1, owner, [owner]);
    this.objects = Object.values(groups).flat();
    const list = [element("option", { value: "", textContent: "nothing selected" })];
    let number = 0;
    for (const [label, items] of Object.entries(groups)) {
      if (!items.length) continue;
      const group = element("optgroup", { label });
      for (const item of items) group.append(element("option", { value: number++, textContent: item.name }));
      list.push(group);
    }
    at("object").replaceChildren(...list);
  }

  find(picked) {
    return picked ? this.objects.find((item) => item.kind === picked.kind && item.index === picked.index) || null : null;
  }

  // Select an object: list its channels, and plot the first one.
  select(object) {
    this.selected = object;
    at("object").value = object ? this.objects.indexOf(object) : "";
    if (this.player && this.player.data) {
      this.player.choose(object);
    }
    const list = at("channels");
    list.replaceChildren();
    at("object-name").textContent = object ? object.name : "Nothing selected";
    at("hint").hidden = Boolean(object);
    if (!object) return;
    const channels = this.channelsOf(object);
    for (const channel of channels) {
      list.append(element("li", {}, element("button", { textContent: `${object.owners.length > 1 ? channel.name : channel.quantity} (${channel.unit})`, title: channel.text, onclick: () => this.plotChannel(channel) })));
    }
    if (!channels.length) list.append(element("li", { textContent: "No channels of this object are in the result; [save] channels of the case records them." }));
    else this.plotChannel(channels[0]);
  }

  channelsOf(object) {
    const found = this.result.channels.filter((channel) => object.owners.includes(channel.owner));
    return object.kind === "part" ? [this.displacementOf(object.index), ...found] : found;
  }

  // Displacement of the middle of a part, from the shapes in the page.
  displacementOf(part) {
    const { positions, quads, of_quad: of, records } = this.result.player, n = positions.shape[1], rows = records.length;
    const values = Object.assign(new Float32Array(3 * rows), { shape: [rows, 3] });
    const vertices = [...new Set(Array.from(quads).filter((v, k) => of[k >> 2] === part))];
    for (let i = 0; i < rows; i++) for (let axis = 0; axis < 3; axis++) {
      let sum = 0;
      for (const v of vertices) sum += positions[3 * (i * n + v) + axis] - positions[3 * v + axis];
      values[3 * i + axis] = ((positions.high[axis] - positions.low[axis]) / 65534) * (sum / vertices.length);
    }
    const name = `${this.result.player.parts[part].name}.displacement`;
    return { name, quantity: "displacement", unit: "mm", factor: 1000, labels: ["x", "y", "z"], of: 3, text: "mean displacement since the start, from the saved shapes", values, records };
  }

  plotChannel(channel) {
    const box = at("object-plots"), same = this.curves.shown.find((one) => one.plot.key === channel.name && one.figure.parentElement === box);
    if (same) this.curves.remove(same.figure);
    const { time, travel, travel_label: label, channel_records: rows } = this.result;
    const one = this.curves.add(channelPlot(channel, time, travel, label, channel.records || rows), box, { close: true });
    box.prepend(one.figure);
    while (box.children.length > OBJECT_LIMIT) this.curves.remove(box.lastElementChild);
    this.curves.drawOnce(one);
  }

  pointed(picked, event, hover) {
    const object = this.find(picked), tip = at("tip");
    if (!hover) { this.select(object); return; }
    tip.hidden = !object;
    if (!object) return;
    const box = at("stage").getBoundingClientRect();
    tip.style.left = `${Math.min(event.clientX - box.left + 14, box.width - 200)}px`;
    tip.style.top = `${event.clientY - box.top + 14}px`;
    tip.textContent = object.name + this.valueAt(picked);
  }

  valueAt(picked) {
    const field = this.player.field(), colour = this.player.options.colour;
    if (picked.kind === "part" && colour === "displacement" && this.mode) return "";
    if (picked.kind === "part" && colour === "displacement") return `: ${shortNumber(this.player.displacement(picked.quad))} mm`;
    if (picked.kind === "contact") return `: ${shortNumber(between(this.result.player.contacts[picked.index].force, this.player.at))} N`;
    const on = { part: "quads", crease: "creases" }[picked.kind];
    if (!field || field.on !== on) return "";
    return `: ${shortNumber(this.player.fieldValue(field, picked.kind === "part" ? picked.quad : picked.index))} ${field.unit}`;
  }

  // ---------------------------------------------------------------------------------------------- wiring

  theme(dark) {
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    at("theme").textContent = dark ? "Light" : "Dark";
    if (this.player) this.player.theme(dark);
    this.curves.redraw();
    if (this.comparison) this.comparison.draw();
  }

  // Light colours, all curves, and a picture of the motion for paper; afterwards the colours as before.
  paper(on) {
    if (on && this.before === undefined) {
      this.before = document.documentElement.dataset.theme === "dark";
      if (this.before) this.theme(false);
      this.curves.drawAll();
      if (this.player && this.player.data) { this.player.drawn = -Infinity; this.player.render(); at("still").src = at("canvas").toDataURL(); }
    } else if (!on && this.before !== undefined) {
      if (this.before) this.theme(true);
      this.before = undefined;
    }
  }

  wire() {
    const { player, curves } = this;
    at("theme").onclick = () => this.theme(document.documentElement.dataset.theme !== "dark");
    at("print").onclick = async () => {
      this.paper(true);
      await Promise.all(curves.shown.map((one) => one.ready));
      window.print();
    };
    at("over").onchange = () => { curves.over = at("over").value; curves.redraw(); };
    at("follow").onchange = () => { curves.follow = at("follow").checked; };
    curves.follow = true;
    curves.moved = (time) => { if (!this.mode) this.moveTo(time); };
    curves.modeChosen = (line, k) => { if (line === 0 && this.player && this.result.player.modes[k]) this.chooseMode(String(k)); };
    curves.pairChosen = (pair) => { const found = this.objects.find((item) => item.owners.includes(`contact.${pair}`)); if (found) this.select(found); };
    at("object").onchange = () => this.select(at("object").value === "" ? null : this.objects[Number(at("object").value)]);
    window.addEventListener("beforeprint", () => this.paper(true));
    window.addEventListener("afterprint", () => this.paper(false));
    if (!player) return;
    const redraw = () => { if (this.mode) player.showMode(this.mode, this.phase || Math.PI / 2); else this.show(this.frame); };
    at("slider").oninput = () => { this.play(false); this.mode = null; at("mode").value = ""; this.show(Number(at("slider").value)); };
    at("play").onclick = () => this.play(!this.playing);
    at("colour").onchange = () => { player.options.colour = at("colour").value; redraw(); };
    at("rest").onchange = () => { player.options.rest = at("rest").value; redraw(); };
    at("mode").onchange = () => { this.chooseMode(at("mode").value); };
    for (const [id, name] of [["arrows", "arrows"], ["joint-forces", "jointForces"], ["contacts", "contacts"], ["mesh", "mesh"]]) at(id).onchange = () => { player.options[name] = at(id).checked; redraw(); };
    at("arrow-length").oninput = () => { player.options.arrowLength = Number(at("arrow-length").value); redraw(); };
    const section = () => { player.section = { axis: at("section").value, at: Number(at("section-at").value), flip: at("section-flip").checked }; at("section-more").hidden = !at("section").value; player.applySection(); };
    for (const id of ["section", "section-at", "section-flip"]) at(id).oninput = section;
    for (const button of document.querySelectorAll("[data-view]")) button.onclick = () => player.view(button.dataset.view);
    player.connect((picked, event, hover) => this.pointed(picked, event, hover));
    document.addEventListener("keydown", (event) => {
      if (/^(INPUT|SELECT|TEXTAREA|BUTTON|SUMMARY|A)$/.test(event.target.tagName) || event.ctrlKey || event.metaKey || event.altKey) return;
      const end = this.result.player ? this.result.player.records.length - 1 : 0;
      const keys = { " ": () => this.play(!this.playing), ",": () => this.show(Math.ceil(this.frame) - 1), ".": () => this.show(Math.floor(this.frame) + 1), Home: () => this.show(0), End: () => this.show(end), Escape: () => this.select(null) };
      if (keys[event.key]) { keys[event.key](); event.preventDefault(); }
    });
  }
}
