// Data of the page: arrays from base64 (see fsm/views/report/packing.py), and the embedded libraries.
"use strict";

const fsmReport = { errors: [], nonce: document.currentScript.nonce };  // state for tests and for the console
window.addEventListener("error", (event) => fsmReport.errors.push(String(event.message)));
window.addEventListener("unhandledrejection", (event) => fsmReport.errors.push(String(event.reason)));

function bytesOf(base64) {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return bytes;
}

async function inflated(base64) {
  const stream = new Blob([bytesOf(base64)]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const ARRAYS = { f4: Float32Array, f8: Float64Array, u4: Uint32Array, u2: Uint16Array };

// Array of a packed text, with `shape`; levels (type u2) also have `low` and `high`.
async function unpack(packed) {
  const bytes = await inflated(packed.data);
  const Kind = ARRAYS[packed.type];
  const width = Kind.BYTES_PER_ELEMENT;
  const count = bytes.length / width;
  const joined = new Uint8Array(bytes.length);
  for (let k = 0; k < width; k++) for (let i = 0, at = k * count; i < count; i++) joined[i * width + k] = bytes[at + i];
  const array = new Kind(joined.buffer);
  if (packed.type === "u2") {
    const row = packed.shape.slice(1).reduce((a, b) => a * b, 1);
    for (let i = row; i < count; i++) array[i] += array[i - row];  // modulo 2^16
  }
  return Object.assign(array, { shape: packed.shape, low: packed.low, high: packed.high });
}

// Unpack all packed arrays inside a tree of objects and lists.
async function unpackAll(item) {
  if (Array.isArray(item)) return Promise.all(item.map(unpackAll));
  if (item && typeof item === "object") {
    if (item.type in ARRAYS && typeof item.data === "string") return unpack(item);
    const pairs = await Promise.all(Object.entries(item).map(async ([key, value]) => [key, await unpackAll(value)]));
    return Object.fromEntries(pairs);
  }
  return item;
}

// Run an embedded library; its element holds it in gzip format.
async function runLibrary(id) {
  const text = new TextDecoder().decode(await inflated(document.getElementById(id).textContent.trim()));
  const script = document.createElement("script");
  script.nonce = fsmReport.nonce;
  script.textContent = text;
  document.head.append(script);
}

// Element with properties and children; texts are never read as HTML.
function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [key, value] of Object.entries(properties)) {
    if (key in made && key !== "list" && key !== "role") made[key] = value;
    else made.setAttribute(key, value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

// Text as plotly.js shows it: plotly reads a few HTML tags and entities.
function plain(text) {
  return String(text).replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;").replace(/\$/g, "&#36;");
}

function shortNumber(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "no value";
  const size = Math.abs(value);
  return size !== 0 && (size < 1e-3 || size >= 1e6) ? value.toExponential(3) : String(Number(value.toPrecision(4)));
}

// Text "travel 3.2 mm" from the label "travel (mm)".
function withUnit(label, value) {
  const [name, unit] = label.replace(")", "").split(" (");
  return `${name} ${shortNumber(value)} ${unit || ""}`.trim();
}

// Index of the entry of an increasing list that is nearest to a value.
function nearestIndex(list, value) {
  let low = 0, high = list.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (list[middle] <= value) low = middle; else high = middle;
  }
  return value - list[low] <= list[high] - value ? low : high;
}

// Value between the entries of a list at a broken index.
function between(list, at) {
  const i = Math.max(0, Math.min(list.length - 1, Math.floor(at)));
  const j = Math.min(i + 1, list.length - 1);
  return list[i] + (at - i) * (list[j] - list[i]);
}
