'use strict';
// The page's data, and small helpers that every part uses.

/** Makes an element: el('td', {class: 'number', onclick: f}, child, ...). Text is always text, never markup. */
function el(tag, attributes = {}, ...children) {
  return build(document.createElement(tag), attributes, children);
}

function svg(tag, attributes = {}, ...children) {
  return build(document.createElementNS('http://www.w3.org/2000/svg', tag), attributes, children);
}

function build(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith('on')) node.addEventListener(name.slice(2), value);
    else node.setAttribute(name, value === true ? '' : value);
  }
  node.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined && child !== false));
  return node;
}

/** value of every half float, by its 16 bits */
const kHalfToFloat = (() => {
  const table = new Float32Array(65536);
  for (let bits = 0; bits < 65536; ++bits) {
    const exponent = (bits >> 10) & 31, mantissa = bits & 1023;
    let value;
    if (exponent === 0) value = mantissa * 2 ** -24;
    else if (exponent === 31) value = mantissa ? NaN : Infinity;
    else value = (1 + mantissa / 1024) * 2 ** (exponent - 15);
    table[bits] = bits & 0x8000 ? -value : value;
  }
  return table;
})();

/** base64 of little-endian half floats -> Uint16Array of their bits */
function decodeHalves(base64) {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return new Uint16Array(bytes.buffer);
}

function decodeImage(json) {
  return {width: json.width, height: json.height, halves: decodeHalves(json.halves)};
}

/** {width, height, values: Float32Array} */
function decodeGrid(json) {
  const halves = decodeHalves(json.halves);
  const values = new Float32Array(halves.length);
  for (let i = 0; i < halves.length; ++i) values[i] = kHalfToFloat[halves[i]];
  return {width: json.width, height: json.height, values};
}

const known = (x) => typeof x === 'number' && Number.isFinite(x);

function mean(values) {
  return values.reduce((sum, x) => sum + x, 0) / values.length;
}

/** standard error of the mean; null for a single value */
function standardError(values) {
  if (values.length < 2) return null;
  const m = mean(values);
  return Math.sqrt(values.reduce((sum, x) => sum + (x - m) ** 2, 0) / (values.length * (values.length - 1)));
}

/** the value below which the share p of the sorted, finite values lies */
function percentile(values, p) {
  const sorted = Float64Array.from(values.filter(Number.isFinite)).sort();
  return sorted.length ? sorted[Math.min(sorted.length - 1, Math.floor(p * sorted.length))] : 0;
}

/** three significant digits, without needless zeros: 0.0192, 12.3, 1.2 × 10⁻⁵ */
function formatNumber(x, digits = 3) {
  if (!known(x)) return '–';
  if (x === 0) return '0';
  const exponent = Math.floor(Math.log10(Math.abs(x)));
  if (exponent < -4 || exponent > 6) {
    const mantissa = +(x / 10 ** exponent).toPrecision(digits);
    return `${mantissa === 1 ? '' : `${mantissa} × `}10${superscript(exponent)}`;
  }
  return String(+x.toPrecision(digits)).replace('-', '−');
}

function superscript(integer) {
  return String(integer).replace(/[-0-9]/g, (c) => (c === '-' ? '⁻' : '⁰¹²³⁴⁵⁶⁷⁸⁹'[c]));
}

/** 1.84 M */
function formatCount(n) {
  if (!known(n) || n < 1e5) return groupDigits(n);
  return n < 1e6 ? `${+(n / 1e3).toPrecision(3)} k` : n < 1e9 ? `${+(n / 1e6).toPrecision(3)} M` : `${+(n / 1e9).toPrecision(3)} G`;
}

const groupDigits = (integer) => String(integer).replace(/\B(?=(\d{3})+(?!\d))/g, '\u202f');

function formatSeconds(s) {
  if (!known(s)) return '–';
  if (s < 10) return `${s.toFixed(2)} s`;
  if (s < 100) return `${s.toFixed(1)} s`;
  const whole = Math.round(s);
  const two = (n) => String(n).padStart(2, '0');
  return whole < 3600 ? `${Math.floor(whole / 60)} min ${two(whole % 60)} s`
                      : `${Math.floor(whole / 3600)} h ${two(Math.floor(whole / 60) % 60)} min`;
}

/** "0.0192 ± 0.0003" as an element; what the command line's table prints */
function estimate(e) {
  return el('span', {class: 'estimate'}, e.text, e.error && el('span', {class: 'spread'}, ` ± ${e.error}`));
}

/** A series has one colour and one mark wherever it is shown: the baseline is grey. */
const kMarks = ['circle', 'square', 'triangle', 'diamond', 'down', 'cross', 'star', 'bar'];
function seriesColor(index) {
  return `var(--series-${index % 8})`;
}

function markShape(index, x, y, size = 4) {
  const points = {
    square: [[-1, -1], [1, -1], [1, 1], [-1, 1]],
    triangle: [[0, -1.25], [1.2, 0.9], [-1.2, 0.9]],
    diamond: [[0, -1.4], [1.4, 0], [0, 1.4], [-1.4, 0]],
    down: [[0, 1.25], [1.2, -0.9], [-1.2, -0.9]],
    cross: [[-1.2, -0.4], [-0.4, -0.4], [-0.4, -1.2], [0.4, -1.2], [0.4, -0.4], [1.2, -0.4], [1.2, 0.4], [0.4, 0.4],
            [0.4, 1.2], [-0.4, 1.2], [-0.4, 0.4], [-1.2, 0.4]],
    star: [[0, -1.5], [0.4, -0.4], [1.5, 0], [0.4, 0.4], [0, 1.5], [-0.4, 0.4], [-1.5, 0], [-0.4, -0.4]],
    bar: [[-1.4, -0.5], [1.4, -0.5], [1.4, 0.5], [-1.4, 0.5]],
  }[kMarks[index % kMarks.length]];
  const fill = `fill:${seriesColor(index)}`;
  if (!points) return svg('circle', {cx: x, cy: y, r: size, style: fill});
  return svg('polygon', {points: points.map(([a, b]) => `${x + a * size},${y + b * size}`).join(' '), style: fill});
}

/** mark and name of a method; long names break after ":" and "+" */
function methodLabel(name, index) {
  const mark = svg('svg', {class: 'mark', viewBox: '0 0 14 14', 'aria-hidden': 'true'}, markShape(index, 7, 7));
  return el('span', {class: 'method'}, mark, el('code', {}, name.split(/(?<=[:+])/).map((part) => [part, el('wbr')]).flat()));
}
