// `deepsft/element`: a scene as an element of HTML.

import { start } from "./index.js";

/** @import { SceneView } from "./scene-view.js" */

/** The attributes that a scene is started from. */
const ATTRIBUTES = ["picture", "width-mm", "print", "facing", "base-url"];
/** The events of a scene that the element fires too. */
const EVENTS = /** @type {const} */ (["found", "lost", "error"]);

/** Servers that render pages have no elements. */
const Base = /** @type {typeof HTMLElement} */ (globalThis.HTMLElement ?? class {});

/**
 * `<deepsft-view picture="poster.jpg" width-mm="420" print="film.mp4">`: a scene that runs while the element is in the page. It starts anew
 * where an attribute changes, and fires `started`, and the events `found`, `lost` and `error` of the scene, with their `detail`.
 */
export class DeepSftView extends Base {
  static observedAttributes = ATTRIBUTES;

  #leaving = new AbortController();

  /** The scene that runs; null while there is none. @type {SceneView | null} */
  view = null;

  connectedCallback() {
    if (getComputedStyle(this).display === "inline") this.style.display = "block";
    void this.#start();
  }

  disconnectedCallback() {
    this.#leaving.abort();
    this.view = null;
  }

  attributeChangedCallback() {
    if (this.isConnected) void this.#start();
  }

  async #start() {
    this.#leaving.abort();
    const { signal } = (this.#leaving = new AbortController());
    this.view = null;
    // Once for all attributes that change together.
    await null;
    if (signal.aborted) return;
    const tell = (/** @type {string} */ name, /** @type {unknown} */ detail) => this.dispatchEvent(new CustomEvent(name, { detail }));
    const [picture, width, print, facing, baseUrl] = ATTRIBUTES.map((name) => this.getAttribute(name) ?? undefined);
    const widthMm = width === undefined ? undefined : Number(width);
    const options = { picture, widthMm, facing: facing === "user" ? /** @type {const} */ ("user") : undefined, load: { baseUrl } };
    try {
      const view = await start(this, { ...options, signal });
      this.view = view;
      for (const name of EVENTS) view.addEventListener(name, (/** @type {CustomEvent} */ { detail }) => tell(name, detail));
      tell("started", { view });
      if (print !== undefined) await view.sheet().print(print);
    } catch (error) {
      if (!signal.aborted) tell("error", { error });
    }
  }
}

globalThis.customElements?.define("deepsft-view", DeepSftView);
