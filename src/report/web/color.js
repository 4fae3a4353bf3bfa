'use strict';
// Tone curve and colour scales. Colours between stops are mixed in Oklab, so that equal steps look equal.

/** sRGB byte of every half float times `scale`; NaN is not here: it is shown in magenta */
function srgbTable(scale) {
  const table = new Uint8Array(65536);
  for (let bits = 0; bits < 65536; ++bits) {
    const x = Math.min(1, Math.max(0, kHalfToFloat[bits] * scale || 0));
    table[bits] = Math.round(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055));
  }
  return table;
}

const srgbToLinear = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
const linearToSrgb = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);

/** Oklab (B. Ottosson, 2020) */
function toOklab(hex) {
  const [r, g, b] = [1, 3, 5].map((i) => srgbToLinear(parseInt(hex.slice(i, i + 2), 16) / 255));
  const l = Math.cbrt(0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b);
  const m = Math.cbrt(0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b);
  const s = Math.cbrt(0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b);
  return [0.2104542553 * l + 0.793617785 * m - 0.0040720468 * s, 1.9779984951 * l - 2.428592205 * m + 0.4505937099 * s,
          0.0259040371 * l + 0.7827717662 * m - 0.808675766 * s];
}

function fromOklab([L, a, b]) {
  const l = (L + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (L - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (L - 0.0894841775 * a - 1.291485548 * b) ** 3;
  return [4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s, -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
          -0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s]
      .map((x) => Math.round(255 * linearToSrgb(Math.min(1, Math.max(0, x)))));
}

/** 1024 RGB triples between evenly spaced stops */
function ramp(stops) {
  const labs = stops.map(toOklab);
  const table = new Uint8Array(3 * 1024);
  for (let i = 0; i < 1024; ++i) {
    const t = (i / 1023) * (labs.length - 1), k = Math.min(labs.length - 2, Math.floor(t)), w = t - k;
    table.set(fromOklab([0, 1, 2].map((c) => labs[k][c] * (1 - w) + labs[k + 1][c] * w)), 3 * i);
  }
  return table;
}

const kHeat = ramp(['#08060f', '#2a1154', '#6b1d74', '#b4305f', '#e9633a', '#f9ab3b', '#fbf3b8']);
const kDiverging = ramp(['#8fdcff', '#2f86e6', '#14407f', '#0c0d10', '#8a2f12', '#ea6a22', '#ffdc8a']);

/** puts the colour of t in [0,1] at data[at..at+3]; NaN is magenta */
function putColor(table, t, data, at) {
  if (Number.isNaN(t)) {
    data[at] = data[at + 2] = 255;
    data[at + 1] = 0;
  } else {
    const i = 3 * Math.round(1023 * Math.min(1, Math.max(0, t)));
    data[at] = table[i];
    data[at + 1] = table[i + 1];
    data[at + 2] = table[i + 2];
  }
  data[at + 3] = 255;
}

/** a canvas of width x height whose pixel i has the colour of t(i) */
function colorCanvas(width, height, table, t) {
  const canvas = el('canvas', {width, height});
  const context = canvas.getContext('2d');
  const pixels = context.createImageData(width, height);
  for (let i = 0; i < width * height; ++i) putColor(table, t(i), pixels.data, 4 * i);
  context.putImageData(pixels, 0, 0);
  return canvas;
}

/** a colour bar with labels: ticks are [position in 0..1, text] */
function colorBar(table, ticks) {
  const bar = colorCanvas(256, 1, table, (i) => i / 255);
  bar.className = 'bar';
  bar.setAttribute('aria-hidden', 'true');
  return el('div', {class: 'colorbar'}, bar,
            el('div', {class: 'ticks'}, ticks.map(([at, text]) => el('span', {style: `left:${100 * at}%`}, text))));
}
