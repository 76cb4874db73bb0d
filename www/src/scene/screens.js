// What a scene says over its picture: that it starts, asks for the camera, looks for the print, was interrupted, or failed.

/** @import { Target } from "../targets/target.js" */

/**
 * What is said, and when: while the engine loads, while the camera is asked for, while no print is found, while the system has the
 * camera, and when something is in the way.
 *
 * @typedef {"loading" | "asking" | "scanning" | "interrupted" | "failed"} ScreenName
 */

/**
 * What a screen may tell: what is looked for, what went wrong, and what tries again, where that can help.
 *
 * @typedef {{ targets: Target[], error: Error | null, retry: (() => void) | null }} ScreenContents
 */

/**
 * Screens of one's own in place of those of the package, by name; null shows nothing. An element is shown where it lies in the page, by its
 * `hidden`; what a function makes is laid over the picture.
 *
 * @typedef {Partial<Record<ScreenName, HTMLElement | ((contents: ScreenContents) => HTMLElement) | null>>} OwnScreens
 */

const WORDS = {
  loading: "Starting",
  asking: "Allow the camera: what it sees stays on this device.",
  scanning: "Hold the whole print in view, nearly flat at first.",
  interrupted: "The camera is interrupted.",
  failed: "",
};
/** Longest side of the picture of what is looked for, CSS pixels. */
const THUMBNAIL = 96;

/** One screen at a time over a scene. */
export class Screens {
  #over;
  #own;
  /** @type {HTMLElement | null} */
  #shown = null;

  /**
   * @param {HTMLElement} over the scene
   * @param {OwnScreens | false} own false for none at all
   */
  constructor(over, own) {
    this.#over = over;
    this.#own = own;
    // Elements of the page wait until their time has come.
    for (const screen of Object.values(own || {})) if (screen instanceof HTMLElement) screen.hidden = true;
  }

  /**
   * @param {ScreenName | null} name null for none
   * @param {Partial<ScreenContents>} [contents]
   */
  show(name, { targets = [], error = null, retry = null } = {}) {
    const state = name ?? "running";
    if (state === this.#over.dataset.deepsft) return;
    this.#over.dataset.deepsft = state;
    if (this.#shown?.parentNode === this.#over) this.#shown.remove();
    else if (this.#shown) this.#shown.hidden = true;
    this.#shown = null;
    if (name === null || this.#own === false) return;
    const own = this.#own[name];
    if (own === null) return;
    const contents = { targets, error, retry };
    this.#shown = own instanceof HTMLElement ? own : own ? own(contents) : screenOf(name, contents);
    if (own instanceof HTMLElement) own.hidden = false;
    else this.#over.append(this.#shown);
  }
}

/**
 * The screen of the package.
 *
 * @param {ScreenName} name
 * @param {ScreenContents} contents
 */
function screenOf(name, { targets: [target], error, retry }) {
  const screen = document.createElement("div");
  screen.setAttribute("role", error ? "alert" : "status");
  Object.assign(screen.style, {
    ...{ position: "absolute", left: "50%", bottom: "24px", transform: "translateX(-50%)", boxSizing: "border-box" },
    ...{ display: "flex", alignItems: "center", gap: "12px", width: "max-content", maxWidth: "calc(100% - 32px)", padding: "12px 16px" },
    ...{ borderRadius: "14px", pointerEvents: "auto", background: "rgb(16 19 22 / 0.85)", color: "#f2efe9", font: "16px/1.4 system-ui, sans-serif" },
  });
  if (name === "scanning" && target) screen.append(thumbnailOf(target));
  screen.append(Object.assign(document.createElement("span"), { textContent: error ? error.message : WORDS[name] }));
  if (!retry) return screen;
  const button = Object.assign(document.createElement("button"), { type: "button", textContent: "Try again", onclick: retry });
  Object.assign(button.style, { font: "inherit", whiteSpace: "nowrap", padding: "8px 14px", border: "0", borderRadius: "10px" });
  screen.append(button);
  return screen;
}

/** @param {Target} target */
function thumbnailOf({ texture }) {
  const scale = THUMBNAIL / Math.max(texture.width, texture.height);
  const [width, height] = [texture.width, texture.height].map((side) => Math.round(scale * side));
  const whole = Object.assign(document.createElement("canvas"), { width: texture.width, height: texture.height });
  whole.getContext("2d")?.putImageData(texture, 0, 0);
  const canvas = Object.assign(document.createElement("canvas"), { width: 2 * width, height: 2 * height });
  canvas.setAttribute("aria-hidden", "true");
  Object.assign(canvas.style, { width: `${width}px`, height: `${height}px`, flex: "none", borderRadius: "4px" });
  const context = canvas.getContext("2d");
  if (context) context.imageSmoothingQuality = "high";
  context?.drawImage(whole, 0, 0, 2 * width, 2 * height);
  return canvas;
}
