'use strict';
// The images side by side or one at a time, under one exposure, one zoom and one difference scale.

const kModes = {
  image: {label: 'Image'},
  signed: {label: 'Difference', table: kDiverging, unit: 'signed difference, mean of R, G, B'},
  absolute: {label: '|Difference|', table: kHeat, unit: 'absolute difference, mean of R, G, B'},
  relative: {label: 'relMSE', table: kHeat, unit: 'squared difference / (reference² + 0.01), mean of R, G, B'},
};

class Viewer {
  /**
   * entries: [{name, key, image, label: element, note}], at least one; base: index of what differences are taken to.
   * All images have one size.
   */
  constructor(entries, base) {
    this.entries = entries;
    this.base = base;
    this.single = false;
    this.selected = 0;
    this.mode = 'image';
    this.exposure = 0;
    this.stops = {signed: 0, absolute: 0, relative: 0};
    this.autoScale = {};
    this.hover = null;
    const {width, height} = entries[0].image;
    this.size = {width, height};
    this.view = {x: width / 2, y: height / 2, zoom: 1};
    this.panels = entries.map((entry, index) => this.makePanel(entry, index));
    this.root = el('div', {class: 'viewer'}, this.makeToolbar(), this.legend = el('div', {class: 'legend'}),
                   this.grid = el('div', {class: 'panels', style: `--ratio:${width / height}`}, this.panels.map((panel) => panel.figure)));
    new ResizeObserver(() => this.draw()).observe(this.grid);
  }

  // -- What is shown ---------------------------------------------------------------------------------------------------------

  setMode(mode) {
    this.mode = mode;
    this.refresh();
  }

  setSingle(single) {
    this.single = single;
    this.refresh();
  }

  select(index, single = true) {
    this.selected = (index + this.entries.length) % this.entries.length;
    this.single = single;
    this.refresh();
  }

  setExposure(stops) {
    if (this.mode === 'image') this.exposure = Math.min(12, Math.max(-12, stops));
    else this.stops[this.mode] = Math.min(12, Math.max(-12, stops));
    this.refresh();
  }

  currentStops() {
    return this.mode === 'image' ? this.exposure : this.stops[this.mode];
  }

  /** exposure that brings the images' log-mean luminance to a middle grey */
  autoExposure() {
    if (this.mode !== 'image') return this.setExposure(0);
    const {halves} = this.entries[this.base].image;
    let sum = 0, count = 0;
    for (let i = 0; i < halves.length; i += 3) {
      const luminance = 0.2127 * kHalfToFloat[halves[i]] + 0.7152 * kHalfToFloat[halves[i + 1]] + 0.0722 * kHalfToFloat[halves[i + 2]];
      if (luminance > 1e-6 && luminance < Infinity) sum += Math.log2(luminance), ++count;
    }
    this.setExposure(count ? Math.round(2 * (Math.log2(0.18) - sum / count)) / 2 : 0);
  }

  /** the difference that has the scale's last colour */
  scale() {
    if (this.autoScale[this.mode] === undefined) {
      const values = [];
      this.entries.forEach((entry, index) => {
        if (index === this.base) return;
        const step = Math.max(1, Math.floor((this.size.width * this.size.height) / 20000));
        for (let i = 0; i < this.size.width * this.size.height; i += step) values.push(Math.abs(this.difference(entry, i)));
      });
      this.autoScale[this.mode] = percentile(values, 0.97) || 1;
    }
    return this.autoScale[this.mode] * 2 ** -this.stops[this.mode];
  }

  /** the current mode's difference of pixel i to the base image */
  difference(entry, i) {
    const a = entry.image.halves, b = this.entries[this.base].image.halves;
    let sum = 0;
    for (let c = 3 * i; c < 3 * i + 3; ++c) {
      const r = kHalfToFloat[b[c]], d = kHalfToFloat[a[c]] - r;
      sum += this.mode === 'signed' ? d : this.mode === 'absolute' ? Math.abs(d) : (d * d) / (r * r + 0.01);
    }
    return sum / 3;
  }

  // -- Elements ----------------------------------------------------------------------------------------------------------------

  makeToolbar() {
    const group = (label, buttons) => el('div', {class: 'segments', role: 'group', 'aria-label': label}, buttons);
    this.layoutButtons = [false, true].map((single) =>
        el('button', {onclick: () => this.setSingle(single), title: single ? 'One at a time (F)' : 'Side by side (S)'},
           single ? 'Flip' : 'Side by side'));
    this.modeButtons = this.entries.length < 2 ? {} : Object.fromEntries(Object.entries(kModes).map(([mode, {label, unit}]) =>
        [mode, el('button', {onclick: () => this.setMode(mode), title: unit ?? 'The image itself'}, label)]));
    this.slider = el('input', {type: 'range', min: -8, max: 8, step: 0.25, 'aria-label': 'Exposure in stops',
                               oninput: () => this.setExposure(+this.slider.value)});
    this.stopsText = el('output', {});
    this.zoomText = el('output', {});
    return el('div', {class: 'toolbar'}, group('Layout', this.layoutButtons),
              this.entries.length > 1 && group('What to show', Object.values(this.modeButtons)),
              el('label', {class: 'exposure'}, this.sliderName = el('span', {}), this.slider, this.stopsText),
              el('button', {onclick: () => this.autoExposure(), title: 'Exposure or scale that suits these images (A)'}, 'Auto'),
              el('button', {onclick: () => this.setExposure(0), title: 'Zero stops (0)'}, '0'),
              el('span', {class: 'zoom'}, 'Zoom ', this.zoomText),
              el('button', {onclick: () => this.resetView(), title: 'Whole image (Z)'}, 'Fit'));
  }

  makePanel(entry, index) {
    const canvas = el('canvas', {role: 'img', 'aria-label': `Rendered image: ${entry.name}`});
    const stage = el('div', {class: 'stage'}, canvas);
    const value = el('span', {class: 'value'});
    const title = el('button', {class: 'title', onclick: () => this.select(index, !(this.single && this.selected === index)),
                                title: 'Show this one alone, or all again'}, el('kbd', {}, entry.key), entry.label);
    const figure = el('figure', {}, title, stage, el('figcaption', {}, el('span', {}, entry.note), value));
    const panel = {entry, index, canvas, stage, value, figure, toned: el('canvas', {width: entry.image.width, height: entry.image.height})};
    this.listen(panel);
    return panel;
  }

  listen(panel) {
    const {stage} = panel;
    let drag = null;
    stage.addEventListener('wheel', (event) => {
      // At the whole image, scrolling on moves the page.
      if (event.deltaY > 0 && this.view.zoom <= 1) return;
      event.preventDefault();
      this.zoomAt(panel, event, 2 ** (-event.deltaY / (event.deltaMode ? 8 : 240)));
    }, {passive: false});
    stage.addEventListener('pointerdown', (event) => {
      drag = {x: event.clientX, y: event.clientY, view: {...this.view}};
      stage.setPointerCapture(event.pointerId);
    });
    stage.addEventListener('pointermove', (event) => {
      if (drag) {
        const s = this.pixelsPerPixel(panel);
        this.setView(drag.view.x - (event.clientX - drag.x) / s, drag.view.y - (event.clientY - drag.y) / s, drag.view.zoom);
      }
      const [x, y] = this.imagePoint(panel, event).map(Math.floor);
      const inside = x >= 0 && y >= 0 && x < this.size.width && y < this.size.height;
      this.hover = inside ? {x, y} : null;
      this.draw();
    });
    const end = () => { drag = null; };
    stage.addEventListener('pointerup', end);
    stage.addEventListener('pointercancel', end);
    stage.addEventListener('pointerleave', () => { this.hover = null; this.draw(); });
    stage.addEventListener('dblclick', (event) => (this.view.zoom > 1 ? this.resetView() : this.zoomAt(panel, event, 4)));
  }

  // -- The view: the image point at the middle of every panel, and the zoom -----------------------------------------------------

  /** screen pixels (of CSS) for one pixel of the image */
  pixelsPerPixel(panel) {
    return (panel.stage.clientWidth / this.size.width) * this.view.zoom;
  }

  imagePoint(panel, event) {
    const box = panel.stage.getBoundingClientRect(), s = this.pixelsPerPixel(panel);
    return [this.view.x + (event.clientX - box.left - box.width / 2) / s,
            this.view.y + (event.clientY - box.top - box.height / 2) / s];
  }

  zoomAt(panel, event, factor) {
    const [x, y] = this.imagePoint(panel, event);
    const zoom = Math.min(64, Math.max(1, this.view.zoom * factor)), ratio = this.view.zoom / zoom;
    this.setView(x + (this.view.x - x) * ratio, y + (this.view.y - y) * ratio, zoom);
  }

  setView(x, y, zoom) {
    const clamp = (value, size) => Math.min(size - size / (2 * zoom), Math.max(size / (2 * zoom), value));
    this.view = {x: clamp(x, this.size.width), y: clamp(y, this.size.height), zoom};
    this.draw();
  }

  resetView() {
    this.setView(this.size.width / 2, this.size.height / 2, 1);
  }

  // -- Drawing -----------------------------------------------------------------------------------------------------------------

  /** after a change of mode, exposure or layout */
  refresh() {
    const differing = this.mode !== 'image', stops = this.currentStops();
    this.layoutButtons.forEach((button, i) => button.setAttribute('aria-pressed', String(this.single === (i === 1))));
    for (const [mode, button] of Object.entries(this.modeButtons)) button.setAttribute('aria-pressed', String(mode === this.mode));
    this.slider.value = stops;
    this.sliderName.textContent = differing ? 'Gain' : 'Exposure';
    this.slider.setAttribute('aria-label', differing ? 'Gain of the difference in stops' : 'Exposure in stops');
    this.stopsText.textContent = `${stops > 0 ? '+' : stops < 0 ? '−' : ''}${Math.abs(stops)} EV`;
    const columns = this.single ? 1 : this.entries.length <= 3 ? this.entries.length : this.entries.length === 4 ? 2 : 3;
    this.grid.style.setProperty('--columns', columns);
    this.grid.classList.toggle('single', this.single);
    for (const panel of this.panels) {
      panel.figure.hidden = this.single && panel.index !== this.selected;
      panel.figure.classList.toggle('selected', this.single && panel.index === this.selected);
      panel.stale = true;
    }
    this.refreshLegend(differing);
    this.draw();
  }

  refreshLegend(differing) {
    if (!differing) return this.legend.replaceChildren('linear values × 2^EV, under the sRGB curve; magenta: not a number');
    const {table, unit} = kModes[this.mode], s = this.scale(), signed = this.mode === 'signed';
    const ticks = signed ? [[0, `−${formatNumber(s, 2)}`], [0.5, '0'], [1, `+${formatNumber(s, 2)}`]]
                         : [[0, '0'], [0.5, formatNumber(s / 2, 2)], [1, formatNumber(s, 2)]];
    this.legend.replaceChildren(colorBar(table, ticks), el('span', {}, `${unit}; to `, el('code', {}, this.entries[this.base].name)));
  }

  tone(panel) {
    const {width, height, halves} = panel.entry.image;
    const context = panel.toned.getContext('2d');
    const pixels = context.createImageData(width, height), data = pixels.data;
    if (this.mode === 'image' || panel.index === this.base) {
      const table = srgbTable(2 ** this.exposure);
      for (let i = 0, j = 0; i < data.length; i += 4, j += 3) {
        const a = halves[j], b = halves[j + 1], c = halves[j + 2];
        const nan = (a & 0x7fff) > 0x7c00 || (b & 0x7fff) > 0x7c00 || (c & 0x7fff) > 0x7c00;
        data[i] = nan ? 255 : table[a];
        data[i + 1] = nan ? 0 : table[b];
        data[i + 2] = nan ? 255 : table[c];
        data[i + 3] = 255;
      }
    } else {
      const {table} = kModes[this.mode], s = this.scale(), signed = this.mode === 'signed';
      for (let i = 0; i < width * height; ++i) {
        const d = this.difference(panel.entry, i) / s;
        putColor(table, signed ? 0.5 + 0.5 * d : d, data, 4 * i);
      }
    }
    context.putImageData(pixels, 0, 0);
    panel.stale = false;
  }

  draw() {
    this.zoomText.textContent = `${formatNumber(this.view.zoom, 2)} ×`;
    for (const panel of this.panels) {
      if (panel.figure.hidden) continue;
      if (panel.stale) this.tone(panel);
      this.drawPanel(panel);
    }
  }

  drawPanel(panel) {
    const {canvas, stage} = panel, ratio = window.devicePixelRatio || 1;
    const width = Math.max(1, Math.round(stage.clientWidth * ratio)), height = Math.max(1, Math.round(stage.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    const context = canvas.getContext('2d'), s = (width / this.size.width) * this.view.zoom;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, width, height);
    context.imageSmoothingEnabled = s < 1;  // pixels are shown as such, unless there are fewer on the screen
    context.setTransform(s, 0, 0, s, width / 2 - this.view.x * s, height / 2 - this.view.y * s);
    context.drawImage(panel.toned, 0, 0);
    this.drawHover(panel, context, ratio / s);
  }

  /** frames the pixel under the pointer in every panel and tells its value; `unit` is a screen pixel in pixels of the image */
  drawHover(panel, context, unit) {
    panel.value.textContent = '';
    if (!this.hover) return;
    const {x, y} = this.hover, side = Math.max(1, 9 * unit), i = y * this.size.width + x;
    const box = [x + 0.5 - side / 2, y + 0.5 - side / 2, side, side];
    context.lineWidth = 3 * unit;
    context.strokeStyle = '#000a';
    context.strokeRect(...box);
    context.lineWidth = 1.25 * unit;
    context.strokeStyle = '#fff';
    context.strokeRect(...box);
    const rgb = [0, 1, 2].map((c) => formatNumber(kHalfToFloat[panel.entry.image.halves[3 * i + c]])).join('  ');
    const isDifference = this.mode !== 'image' && panel.index !== this.base;
    panel.value.textContent = `(${x}, ${y})  ${isDifference ? formatNumber(this.difference(panel.entry, i)) : rgb}`;
  }

  // -- Keys --------------------------------------------------------------------------------------------------------------------

  /** true if the key meant something */
  onKey(key) {
    const index = this.entries.findIndex((entry) => entry.key.toLowerCase() === key.toLowerCase());
    if (index >= 0) return this.select(index), true;
    const actions = {
      ArrowRight: () => this.select(this.single ? this.selected + 1 : this.selected),
      ArrowLeft: () => this.select(this.single ? this.selected - 1 : this.selected),
      s: () => this.setSingle(false),
      Escape: () => this.setSingle(false),
      f: () => this.setSingle(true),
      d: () => this.entries.length > 1 && this.setMode(Object.keys(kModes)[(Object.keys(kModes).indexOf(this.mode) + 1) % 4]),
      e: () => this.setExposure(this.currentStops() + 0.5),
      w: () => this.setExposure(this.currentStops() - 0.5),
      a: () => this.autoExposure(),
      0: () => this.setExposure(0),
      z: () => this.resetView(),
    };
    const action = actions[key] ?? actions[key.toLowerCase()];
    if (action) action();
    return Boolean(action);
  }
}
