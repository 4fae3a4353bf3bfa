'use strict';
// Small line plots in SVG: logarithmic or linear axes, error bars, labels with units.

const kPlot = {width: 460, height: 290, left: 58, right: 16, top: 16, bottom: 46};

function axis(lo, hi, log, from, to) {
  const f = log ? Math.log : (x) => x;
  const a = f(lo), b = f(hi);
  return (x) => from + ((f(x) - a) / (b - a)) * (to - from);
}

/** {lo, hi, ticks: [value], minor: [value]} around the values */
function logRange(values, base) {
  let lo = Math.min(...values), hi = Math.max(...values);
  const pad = Math.max(1.06, (hi / lo) ** 0.05);
  lo /= pad;
  hi *= pad;
  if (hi / lo < 1.5) lo /= 1.3, hi *= 1.3;
  const power = (x) => Math.log(x) / Math.log(base);
  const range = (step, factors) => {
    const ticks = [];
    for (let e = Math.floor(power(lo)); e <= Math.ceil(power(hi)); ++e)
      if (((e % step) + step) % step === 0)
        for (const k of factors) if (k * base ** e >= lo && k * base ** e <= hi) ticks.push(k * base ** e);
    return ticks;
  };
  if (base === 2) {
    const step = Math.max(1, Math.ceil((power(hi) - power(lo)) / 8));
    const ticks = range(step, [1]);
    return {lo, hi, ticks: ticks.length > 1 ? ticks : linearRange([lo, hi]).ticks, minor: []};
  }
  const decades = power(hi) - power(lo);
  const choices = decades > 2.2 ? [[1], [1, 3]] : [[1, 3], [1, 2, 5], [1, 2, 3, 5, 7], [1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9]];
  let ticks = range(Math.max(1, Math.ceil(decades / 6)), choices[0]);
  for (const factors of choices) if (ticks.length < 3) ticks = range(1, factors);
  return {lo, hi, ticks, minor: decades < 4 ? range(1, [1, 2, 3, 4, 5, 6, 7, 8, 9]) : []};
}

function linearRange(values, fromZero = false) {
  let lo = fromZero ? Math.min(0, ...values) : Math.min(...values), hi = Math.max(...values);
  if (hi === lo) lo -= 0.5, hi += 0.5;
  const raw = (hi - lo) / 5, power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 2.5, 5, 10].find((k) => k * power >= raw * 0.999);
  if (!fromZero) lo = Math.floor(lo / step + 0.2) * step;
  hi = Math.max(hi + 0.04 * (hi - lo), lo + step);
  const ticks = [];
  for (let k = Math.ceil(lo / step - 1e-9); k * step <= hi * (1 + 1e-9) + 1e-12; ++k) ticks.push(+(k * step).toPrecision(12));
  return {lo, hi, ticks, minor: []};
}

/**
 * series: [{name, index (colour and mark), points: [{x, y, error?}], dashed?, faint?, marks?}]
 * options: {title, x: {label, log, base, fromZero}, y: {log}, describe}
 */
function linePlot(series, {title, x, y, describe}) {
  const {width, height, left, right, top, bottom} = kPlot;
  const usable = (p) => known(p.x) && known(p.y) && (!x.log || p.x > 0) && (!y.log || p.y > 0);
  const shown = series.map((s) => ({...s, points: s.points.filter(usable)})).filter((s) => s.points.length);
  const xs = shown.flatMap((s) => s.points.map((p) => p.x));
  const ys = shown.flatMap((s) => s.points.flatMap((p) => [p.y, p.y + (p.error ?? 0), p.y - (p.error ?? 0)]))
                 .filter((v) => !y.log || v > 0);
  if (!xs.length) return null;
  const xr = x.log ? logRange(xs, x.base ?? 10) : linearRange(xs, x.fromZero), yr = y.log ? logRange(ys, 10) : linearRange(ys);
  const px = axis(xr.lo, xr.hi, x.log, left, width - right), py = axis(yr.lo, yr.hi, y.log, height - bottom, top);

  const root = svg('svg', {viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': describe ?? `${title} over ${x.label}`, class: 'plot'});
  const grid = svg('g', {class: 'grid'});
  for (const v of yr.minor) grid.append(svg('line', {x1: left, x2: width - right, y1: py(v), y2: py(v), class: 'minor'}));
  for (const v of xr.minor) grid.append(svg('line', {x1: px(v), x2: px(v), y1: top, y2: height - bottom, class: 'minor'}));
  for (const v of yr.ticks) {
    grid.append(svg('line', {x1: left, x2: width - right, y1: py(v), y2: py(v)}),
                svg('text', {x: left - 8, y: py(v) + 4, 'text-anchor': 'end'}, formatNumber(v)));
  }
  for (const v of xr.ticks) {
    grid.append(svg('line', {x1: px(v), x2: px(v), y1: top, y2: height - bottom}),
                svg('text', {x: px(v), y: height - bottom + 18, 'text-anchor': 'middle'}, formatNumber(v)));
  }
  grid.append(svg('line', {x1: left, x2: width - right, y1: height - bottom, y2: height - bottom, class: 'base'}),
              svg('text', {x: (left + width - right) / 2, y: height - 8, 'text-anchor': 'middle', class: 'label'}, x.label));
  root.append(grid);

  const spots = [];
  for (const s of shown) {
    const group = svg('g', {class: `series${s.faint ? ' faint' : ''}`});
    const color = `stroke:${seriesColor(s.index)}`;
    group.append(svg('polyline', {points: s.points.map((p) => `${px(p.x).toFixed(2)},${py(p.y).toFixed(2)}`).join(' '),
                                  style: color, 'stroke-dasharray': s.dashed && '5 4'}));
    for (const p of s.points) {
      if (known(p.error) && p.error > 0) {
        const low = y.log && p.y - p.error <= 0 ? yr.lo : p.y - p.error;
        const [a, b] = [py(Math.max(low, yr.lo)), py(p.y + p.error)];
        group.append(svg('path', {d: `M${px(p.x)} ${a}V${b}m-3 0h6M${px(p.x) - 3} ${a}h6`, class: 'error', style: color}));
      }
      if (s.marks !== false) group.append(markShape(s.index, px(p.x), py(p.y), 3.4));
      spots.push({x: px(p.x), y: py(p.y), p, s});
    }
    root.append(group);
  }
  root.append(tooltip(root, spots, x.label, title));
  return el('figure', {class: 'chart'}, el('figcaption', {}, title), root);
}

/** tells the point nearest to the pointer */
function tooltip(root, spots, xLabel, yLabel) {
  const ring = svg('circle', {r: 7, class: 'ring'});
  const text = svg('text', {class: 'tip'});
  const group = svg('g', {visibility: 'hidden', 'aria-hidden': 'true'}, ring, text);
  root.addEventListener('pointermove', (event) => {
    const box = root.getBoundingClientRect();
    const at = [((event.clientX - box.left) / box.width) * kPlot.width, ((event.clientY - box.top) / box.height) * kPlot.height];
    const distance = (spot) => Math.hypot(spot.x - at[0], spot.y - at[1]);
    const nearest = spots.reduce((best, spot) => (distance(spot) < distance(best) ? spot : best), spots[0]);
    if (!nearest || distance(nearest) > 40) return group.setAttribute('visibility', 'hidden');
    const {p, s} = nearest, atRight = nearest.x > kPlot.width * 0.55;
    ring.setAttribute('cx', nearest.x);
    ring.setAttribute('cy', nearest.y);
    const error = known(p.error) ? ` ± ${formatNumber(p.error, 1)}` : '';
    const lines = [s.name, `${yLabel} ${formatNumber(p.y)}${error}`, `${xLabel}: ${formatNumber(p.x)}`];
    const y = Math.max(kPlot.top + 12, nearest.y - 34);
    text.replaceChildren(...lines.map((line, i) =>
        svg('tspan', {x: nearest.x + (atRight ? -12 : 12), y: y + 14 * i, 'text-anchor': atRight ? 'end' : 'start'}, line)));
    group.setAttribute('visibility', 'visible');
  });
  root.addEventListener('pointerleave', () => group.setAttribute('visibility', 'hidden'));
  return group;
}
