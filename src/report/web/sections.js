'use strict';
// The sections of the page, each made from the data alone; a section without data is null.

const kTimes = [
  ['candidate_seconds', 'candidates'],
  ['train_seconds', 'training'],
  ['warp_seconds', 'warping'],
  ['trace_seconds', 'tracing'],
];

function section(id, title, lead, ...children) {
  return el('section', {id}, el('h2', {}, title), lead && el('p', {class: 'lead'}, lead), ...children);
}

const runsOf = (data, method) => data.comparison.results.filter((run) => run.method === method);
const methodIndex = (data, method) => {
  // The baseline is series 0, which is grey; the others follow in their order.
  const {methods, baseline} = data.summary, i = methods.findIndex((m) => m.method === method);
  return i === baseline ? 0 : i < baseline ? i + 1 : i;
};

// -- Head ------------------------------------------------------------------------------------------------------------------------

function headSection(data) {
  const c = data.comparison, {methods, max_runs: runs} = data.summary;
  const parts = c.scene.split(/[\\/]/).filter(Boolean);
  const name = parts.length > 1 && /^scene(_v\d+)?\.xml$/.test(parts.at(-1)) ? parts.at(-2) : (parts.at(-1) ?? c.scene).replace(/\.xml$/, '');
  const spps = [...new Set(methods.map((m) => m.spp.text))];
  const facts = [
    [c.width && `${c.width} × ${c.height}`, 'pixels'],
    [spps.length === 1 ? spps[0] : spps.join(', '), 'samples per pixel'],
    [runs, runs === 1 ? 'run' : 'runs of each method'],
    [c.threads, c.threads === 1 ? 'thread' : 'threads'],
    [c.cpu, ''],
  ];
  const root = document.documentElement;
  const toggle = el('button', {class: 'theme', title: 'Light, dark, or as the system is', onclick: () => {
    const next = {auto: 'light', light: 'dark', dark: 'auto'}[root.dataset.theme ?? 'auto'];
    root.dataset.theme = next;
    toggle.textContent = {auto: '◐ auto', light: '○ light', dark: '● dark'}[next];
  }}, '◐ auto');
  return el('header', {id: 'head'}, el('p', {class: 'over'}, 'warpath · comparison', toggle), el('h1', {title: c.scene}, name),
            el('ul', {class: 'facts'}, facts.filter(([value]) => value).map(([value, unit]) =>
                el('li', {}, el('b', {}, value), unit && ` ${unit}`))),
            notices(data));
}

function notices(data) {
  const c = data.comparison, texts = [...c.warnings];
  if (!data.summary.has_errors)
    texts.unshift('No reference was given, so there are no errors and no gains here; differences are to the image of ' +
                  `${data.summary.methods[data.summary.baseline]?.method ?? 'the first method'}. Give one with --reference ref.exr.`);
  else if (!c.reference_has_variance)
    texts.push('The variance of the reference is not known: its own noise is part of every error here.');
  for (const m of data.summary.methods)
    if (m.non_finite) texts.push(`${m.method}: ${groupDigits(m.non_finite)} samples were not finite; they count as zero.`);
  return texts.length ? el('ul', {class: 'notices', role: 'note'}, texts.map((text) => el('li', {}, text))) : null;
}

const gainGrade = ({value}) => (value > 1.02 ? 'better' : value < 0.98 ? 'worse' : '');

/** one card for each method beside the baseline: what it gained */
function gainCards(data) {
  const {methods, baseline, has_errors: hasErrors} = data.summary;
  if (!hasErrors || methods.length < 2) return null;
  const card = (m) => {
    const smaller = (name, gain) => [el('dt', {}, name), el('dd', {class: gainGrade(gain)}, estimate(gain), known(gain.value) && ' ×')];
    return el('article', {class: 'card'}, methodLabel(m.method, methodIndex(data, m.method)),
              el('p', {class: `big ${gainGrade(m.gain_mse)}`}, m.gain_mse.text, el('span', {class: 'times'}, ' ×'), m.gain_mse.error && el('span', {class: 'spread'}, ` ± ${m.gain_mse.error}`)),
              el('p', {class: 'what'}, 'gain in MSE over ', el('code', {}, methods[baseline].method)),
              el('dl', {}, smaller('relMSE', m.gain_relmse), smaller('MSE at equal time*', m.gain_equal_time)));
  };
  return el('div', {id: 'gains'}, el('div', {class: 'cards'}, methods.filter((m, i) => i !== baseline).map(card)),
            el('p', {class: 'fine'}, '* all training counted, if the error falls as 1 / time'));
}

// -- Images ----------------------------------------------------------------------------------------------------------------------

function imageSection(data) {
  const methods = data.summary.methods.filter((m) => data.images.some((image) => image.method === m.method));
  const entries = methods.map((m, i) => ({
    name: m.method,
    key: String(i + 1),
    image: decodeImage(data.images.find((image) => image.method === m.method)),
    label: methodLabel(m.method, methodIndex(data, m.method)),
    note: imageNote(data, m),
  }));
  if (data.reference)
    entries.unshift({name: 'reference', key: 'R', image: decodeImage(data.reference), label: el('span', {class: 'method'}, 'reference'),
                     note: data.comparison.reference.split(/[\\/]/).at(-1)});
  if (!entries.length) return null;
  const base = data.reference ? 0 : Math.max(0, methods.findIndex((m) => m.method === data.summary.methods[data.summary.baseline].method));
  const viewer = new Viewer(entries, base);
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.closest?.('input, select, textarea') && event.key.startsWith('Arrow')) return;
    if (viewer.onKey(event.key)) event.preventDefault();
  });
  const key = (keys, what) => el('span', {}, keys.map((k) => el('kbd', {}, k)), ` ${what}`);
  const help = el('p', {class: 'keys'}, key([methods.length > 1 ? `1…${Math.min(9, methods.length)}` : '1'], 'method'), data.reference && key(['R'], 'reference'),
                  key(['←', '→'], 'flip'), entries.length > 1 && key(['D'], 'difference'), key(['S'], 'side by side'), key(['F'], 'one'),
                  key(['E', 'W'], 'brighter, darker'), key(['A'], 'auto'), key(['Z'], 'fit'), el('span', {}, 'wheel: zoom · drag: move · double click: closer'));
  const node = section('images', 'Images', null, viewer.root, help);
  node.viewer = viewer;
  return node;
}

function imageNote(data, m) {
  const run = runsOf(data, m.method)[0];
  if (!known(run.mse)) return `${formatNumber(run.spp)} spp · ${formatSeconds(run.total_seconds)}`;
  return `MSE ${formatNumber(run.mse)} · relMSE ${formatNumber(run.relmse)}`;
}

// -- Table -----------------------------------------------------------------------------------------------------------------------

function tableSection(data) {
  const {methods, baseline, has_errors: hasErrors, max_runs: runs} = data.summary;
  const longest = Math.max(...methods.map((m) => m.gain_mse.value || 0), 1);
  const number = (e) => el('td', {class: 'number'}, estimate(e));
  const count = (n) => el('td', {class: 'number', title: groupDigits(n)}, n ? formatCount(n) : '–');
  const gainCell = (e, isBaseline) => {
    if (isBaseline || !known(e.value)) return el('td', {class: 'number muted'}, isBaseline && known(e.value) ? '1' : '–');
    return el('td', {class: 'number gain'}, estimate(e),
              el('span', {class: `gainbar ${e.value < 1 ? 'worse' : ''}`, style: `width:${Math.min(100, (100 * e.value) / longest)}%`, 'aria-hidden': 'true'}));
  };
  const columns = [
    {head: 'method', cell: (m) => el('th', {scope: 'row'}, methodLabel(m.method, methodIndex(data, m.method)))},
    {head: 'spp', cell: (m) => number(m.spp)},
    {head: 'samples', cell: (m) => count(runsOf(data, m.method)[0].samples)},
    {head: 'to train', cell: (m) => count(runsOf(data, m.method)[0].train_samples)},
  ];
  if (hasErrors) {
    for (const [name, field] of [['MSE', 'mse'], ['relMSE', 'relmse'], ['relMSE, trimmed', 'relmse_trimmed']]) {
      columns.push({head: name, cell: (m) => number(m[field])});
      if (methods.length > 1) columns.push({head: 'gain', cell: (m) => gainCell(m[`gain_${field}`], m === methods[baseline])});
    }
  }
  columns.push({head: 'time', cell: (m) => el('td', {class: 'number'}, formatSeconds(mean(runsOf(data, m.method).map((run) => run.total_seconds))))});
  const table = el('table', {}, el('thead', {}, el('tr', {}, columns.map(({head}, i) => el('th', {scope: 'col', class: i && 'number'}, head)))),
                   el('tbody', {}, methods.map((m) => el('tr', {}, columns.map(({cell}) => cell(m))))));
  const words = [
    hasErrors && methods.length > 1 && `A gain is the error of ${methods[baseline].method} over the method’s.`,
    runs > 1 ? '± is the standard error of the mean over runs.' : hasErrors && 'One run each, so the spread over runs is not known.',
    hasErrors && data.comparison.reference_has_variance && 'The reference’s own noise is subtracted from MSE and relMSE.',
    hasErrors && 'relMSE = (I − R)² / (R² + 0.01); trimmed: without the worst 0.1 % of pixels.',
  ];
  return section('results', 'Results', words.filter(Boolean).join(' '), el('div', {class: 'scroll'}, table), timeBars(data), allRuns(data));
}

function timeBars(data) {
  const rows = data.summary.methods.map((m) => {
    const runs = runsOf(data, m.method), total = mean(runs.map((run) => run.total_seconds));
    const parts = kTimes.map(([field]) => mean(runs.map((run) => run[field])));
    return {m, total, parts: [...parts, Math.max(0, total - parts.reduce((a, b) => a + b, 0))]};
  });
  const longest = Math.max(...rows.map((row) => row.total));
  if (!(longest > 0)) return null;
  const names = [...kTimes.map(([, name]) => name), 'other'];
  const used = names.map((_, i) => rows.some((row) => row.parts[i] > 0.005 * longest));
  return el('div', {class: 'times', id: 'times'}, el('h3', {}, 'Where the time went'),
            el('ul', {class: 'timelegend'}, names.map((name, i) => used[i] && el('li', {}, el('i', {class: `time-${i}`}), name))),
            rows.map(({m, total, parts}) => el('div', {class: 'timerow'}, methodLabel(m.method, methodIndex(data, m.method)),
                el('div', {class: 'timebar', role: 'img', 'aria-label': names.map((name, i) => `${name} ${formatSeconds(parts[i])}`).join(', ')},
                   parts.map((seconds, i) => seconds > 0 && el('span', {class: `time-${i}`, style: `width:${(100 * seconds) / longest}%`, title: `${names[i]}: ${formatSeconds(seconds)}`}))),
                el('span', {class: 'number'}, formatSeconds(total)))));
}

function allRuns(data) {
  const fields = ['seed', 'spp', 'mse', 'relmse', 'relmse_trimmed', 'mape', 'mse_raw', 'relmse_raw', 'mse_rest', 'relmse_rest',
                  'candidate_seconds', 'train_seconds', 'warp_seconds', 'trace_seconds', 'total_seconds', 'non_finite'];
  const triple = (values) => values.map((v) => formatNumber(v, 4)).join(' ');
  return el('details', {}, el('summary', {}, 'Every run'), el('div', {class: 'scroll'}, el('table', {class: 'small'},
      el('thead', {}, el('tr', {}, el('th', {}, 'method'), fields.map((field) => el('th', {class: 'number'}, field.replaceAll('_', ' '))), el('th', {class: 'number'}, 'mean RGB'))),
      el('tbody', {}, data.comparison.results.map((run) => el('tr', {}, el('th', {scope: 'row'}, el('code', {}, run.method)),
          fields.map((field) => el('td', {class: 'number'}, field === 'seed' ? String(run.seed) : formatNumber(run[field], 4))),
          el('td', {class: 'number'}, triple(run.mean))))))));
}

// -- Plots -----------------------------------------------------------------------------------------------------------------------

/** the runs' curves in one: means with standard errors, point by point */
function meanCurve(runs, field) {
  const curves = runs.map((run) => run.error_curve).filter((curve) => curve.length);
  const length = Math.min(...curves.map((curve) => curve.length));
  if (!curves.length) return [];
  return Array.from({length}, (_, i) => {
    const points = curves.map((curve) => curve[i]), values = points.map((p) => p[field]);
    return {spp: mean(points.map((p) => p.spp)), seconds: mean(points.map((p) => p.seconds)), y: mean(values), error: standardError(values)};
  });
}

function errorSection(data) {
  const plots = [];
  for (const [field, name] of [['mse', 'MSE'], ['relmse', 'relMSE']])
    for (const [x, label, base] of [['spp', 'samples per pixel', 2], ['seconds', 'seconds, training included', 10]]) {
      const series = data.summary.methods.map((m) => ({name: m.method, index: methodIndex(data, m.method),
          points: meanCurve(runsOf(data, m.method), field).map((p) => ({x: p[x], y: p.y, error: p.error}))}));
      plots.push(linePlot(series, {title: name, x: {label, log: true, base}, y: {log: true}, describe: `${name} of each method over ${label}`}));
    }
  if (!plots.some(Boolean)) return null;
  return section('errors', 'Error', data.summary.max_runs > 1 ? 'Means over runs; the bars are their standard errors.' : null, methodLegend(data), el('div', {class: 'charts two'}, plots));
}

function methodLegend(data) {
  return el('ul', {class: 'methodlegend'}, data.summary.methods.map((m) => el('li', {}, methodLabel(m.method, methodIndex(data, m.method)))));
}

function trainingSection(data) {
  const charts = data.summary.methods.map((m) => {
    const runs = runsOf(data, m.method), index = methodIndex(data, m.method);
    const series = runs.flatMap((run, i) => ['loss', 'held_out'].map((field) => ({
      name: `${field === 'loss' ? 'training' : 'held out'}${runs.length > 1 ? `, run ${i + 1}` : ''}`, index, dashed: field === 'loss', faint: i > 0, marks: false,
      points: run.training_curve.map((p) => ({x: p.seconds, y: p[field]})),
    })));
    if (!runs.some((run) => run.training_curve.length)) return null;
    const isCurve = runs.some((run) => run.training_curve.length > 1);
    const chart = isCurve && linePlot(series, {title: 'mean −ln q, nats', x: {label: 'seconds of training', fromZero: true}, y: {},
                                               describe: `Training of ${m.method}: loss on training and held-out examples over time`});
    const run = runs[0], last = run.training_curve.at(-1);
    const facts = [
      !isCurve && `built in one go in ${formatSeconds(last?.seconds)}, mean −ln q = ${formatNumber(last?.held_out)} nats over held-out examples`,
      run.candidates > 0 && `${groupDigits(run.candidates)} candidates${known(run.candidates_nonzero) ? `, ${(100 * run.candidates_nonzero).toFixed(1)} % of them above zero` : ''}`,
      last?.samples > 0 && `${groupDigits(last.samples)} examples seen`,
      run.training_stopped && `ended: ${run.training_stopped}`,
    ];
    return el('article', {class: 'training'}, el('h3', {}, methodLabel(m.method, index)), chart, el('p', {class: 'fine'}, facts.filter(Boolean).join(' · ')));
  });
  if (!charts.some(Boolean)) return null;
  return section('training', 'Training', 'Solid: examples held out. Dashed: training batches. Lower is a better fit; 0 is the uniform density.', el('div', {class: 'charts'}, charts));
}

// -- Densities -------------------------------------------------------------------------------------------------------------------

function densitySection(data) {
  if (!data.densities.length) return null;
  const methods = [...new Set(data.densities.map((d) => d.method))];
  return section('densities', 'Where samples went',
                 'Left: the candidates, weighted by the target. Right: the density that was learned from them. 1 is the uniform density; overlap is the share that the two have in common.',
                 methods.map((method) => el('article', {class: 'density'}, el('h3', {}, methodLabel(method, methodIndex(data, method))),
                     el('div', {class: 'pairs'}, data.densities.filter((d) => d.method === method).map((d) => densityPair(d, data.comparison))))));
}

function densityPair(d, {width, height}) {
  const candidates = decodeGrid(d.candidates), learned = decodeGrid(d.learned);
  // One scale for both; the root makes the faint parts seen beside the peaks.
  const top = Math.max(1, percentile([...candidates.values, ...learned.values], 0.995));
  const down = d.y_dimension.startsWith('film'), isFilm = down && d.x_dimension.startsWith('film') && width > 0 && height > 0;
  const draw = (grid, name) => {
    const canvas = colorCanvas(grid.width, grid.height, kHeat, (i) => {
      const row = Math.floor(i / grid.width), j = down ? row : grid.height - 1 - row;
      return Math.sqrt(Math.max(0, grid.values[j * grid.width + (i % grid.width)]) / top);
    });
    build(canvas, {role: 'img', 'aria-label': `${name}: density over ${d.x_dimension} and ${d.y_dimension}`,
                   style: isFilm && `aspect-ratio:${width / height}`}, []);
    return el('div', {class: 'cell'}, el('span', {class: 'fine'}, name), canvas);
  };
  const ticks = [[0, '0'], ...(top > 2 ? [[Math.sqrt(1 / top), '1']] : []), ...(top > 12 ? [[0.5, formatNumber(top / 4, 2)]] : []), [1, `≥ ${formatNumber(top, 2)}`]];
  return el('figure', {class: 'pair'}, el('figcaption', {}, el('b', {}, d.x_dimension, ' → ', d.y_dimension, down ? ' ↓' : ' ↑'), ` ${d.slice || 'marginal'}`),
            el('div', {class: 'cells'}, draw(candidates, 'candidates'), draw(learned, 'learned')), colorBar(kHeat, ticks),
            el('p', {class: 'fine'}, `overlap ${(100 * overlap(candidates.values, learned.values)).toFixed(0)} %`));
}

/** sum of min(p, q) of two histograms, each normalised to 1 */
function overlap(p, q) {
  const total = (values) => values.reduce((sum, v) => sum + v, 0) || 1;
  const a = total(p), b = total(q);
  return p.reduce((sum, v, i) => sum + Math.min(v / a, q[i] / b), 0);
}

// -- Provenance ------------------------------------------------------------------------------------------------------------------

function provenanceSection(data) {
  const c = data.comparison;
  const facts = [['scene', c.scene], ['reference', c.reference], ['command', c.command], ['warpath', [c.version, c.commit].filter(Boolean).join(', commit ')],
                 ['date', c.date], ['processor', c.cpu], ['threads', c.threads], ['seed', c.seed], ...Object.entries(c.settings)];
  return section('provenance', 'How this was made', null,
                 el('dl', {class: 'provenance'}, facts.filter(([, value]) => value || value === 0).map(([name, value]) =>
                     [el('dt', {}, name), el('dd', {}, el('code', {}, String(value)))])),
                 el('p', {class: 'fine'}, 'All numbers: results.json, beside this page.'));
}
