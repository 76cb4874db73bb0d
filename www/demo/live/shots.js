// What pictures and recordings show: the canvases of the stage as they lie on the page.

/** @typedef {{ area: HTMLElement, canvases: HTMLCanvasElement[] }} Scene the lowest canvas first */

/**
 * Draws what is seen. What WebGL has drawn is there only until the browser shows it: call it right after drawing.
 *
 * @param {HTMLCanvasElement} canvas
 * @param {Scene} scene
 * @returns {HTMLCanvasElement} `canvas`
 */
export function drawScene(canvas, { area, canvases }) {
  const context = canvas.getContext("2d", { alpha: false });
  if (!context) throw new Error("This browser offers no canvas to draw a picture on.");
  const page = area.getBoundingClientRect();
  // The window may have turned since a recording began.
  const scale = Math.min(canvas.width / page.width, canvas.height / page.height);
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.clearRect(0, 0, canvas.width, canvas.height);
  context.translate((canvas.width - scale * page.width) / 2, (canvas.height - scale * page.height) / 2);
  context.scale(scale, scale);
  context.beginPath();
  context.rect(0, 0, page.width, page.height);
  context.clip();
  for (const drawn of canvases) {
    const box = drawn.getBoundingClientRect();
    if (box.width === 0 || drawn.width === 0) continue;
    const [x, y] = [box.left - page.left, box.top - page.top];
    const cover = getComputedStyle(drawn).objectFit === "cover" ? Math.max(box.width / drawn.width, box.height / drawn.height) : 0;
    const [width, height] = cover ? [cover * drawn.width, cover * drawn.height] : [box.width, box.height];
    context.drawImage(drawn, x + (box.width - width) / 2, y + (box.height - height) / 2, width, height);
  }
  return canvas;
}
