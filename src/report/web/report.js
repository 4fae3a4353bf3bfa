'use strict';
// Puts the page together, and leaves on the root element what a test asks for:
// data-ready when all is drawn, data-errors where something failed, and on each image its mean and its share of lit pixels.

(() => {
  const data = JSON.parse(document.getElementById('data').textContent);
  const images = imageSection(data);
  const sections = [headSection(data), gainCards(data), images, tableSection(data), errorSection(data), trainingSection(data), densitySection(data), provenanceSection(data)];
  document.getElementById('report').append(...sections.filter(Boolean));

  if (images) {
    const {viewer} = images;
    // Scenes in other units than "about 1 is white" would be black or white at 0 EV.
    viewer.autoExposure();
    if (Math.abs(viewer.exposure) < 4) viewer.exposure = 0;
    viewer.refresh();
    for (const panel of viewer.panels) checkPanel(panel);
  }
  document.documentElement.dataset.ready = 'true';

  function checkPanel({canvas, entry}) {
    const values = Array.from(entry.image.halves, (bits) => kHalfToFloat[bits]);
    canvas.dataset.mean = mean(values).toPrecision(5);
    const pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
    let lit = 0;
    for (let i = 0; i < pixels.length; i += 4) lit += pixels[i + 3] === 255 && pixels[i] + pixels[i + 1] + pixels[i + 2] > 0 ? 1 : 0;
    canvas.dataset.lit = (lit / (pixels.length / 4)).toFixed(3);
  }
})();
