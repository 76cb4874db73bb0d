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
  /** Whether a start is due. */
  #isDue = false;

  /** The scene that runs; null while there is none. @type {SceneView | null} */
  view = null;

  connectedCallback() {
    if (getComputedStyle(this).display === "inline") this.style.display = "block";
    this.#restart();
  }

  disconnectedCallback() {
    this.#leaving.abort();
    this.view = null;
  }

  attributeChangedCallback() {
    if (this.isConnected) this.#restart();
  }

  /** Once for all attributes that change together. */
  #restart() {
    this.#leaving.abort();
    if (this.#isDue) return;
    this.#isDue = true;
    queueMicrotask(() => {
      this.#isDue = false;
      if (this.isConnected) void this.#start();
    });
  }

  async #start() {
    const { signal } = (this.#leaving = new AbortController());
    this.view = null;
    const [picture, width, print, facing, baseUrl] = ATTRIBUTES.map((name) => this.getAttribute(name) ?? undefined);
    const widthMm = width === undefined ? undefined : Number(width);
    const options = { picture, widthMm, facing: facing === "user" ? /** @type {const} */ ("user") : undefined, load: { baseUrl } };
    try {
      const view = await start(this, { ...options, signal });
      this.view = view;
      for (const name of EVENTS) view.addEventListener(name, (/** @type {CustomEvent} */ { detail }) => this.#tell(name, detail));
      this.#tell("started", { view });
      if (print !== undefined) await view.sheet().print(print);
    } catch (error) {
      if (!signal.aborted) this.#tell("error", { error });
    }
  }

  /**
   * @param {string} name
   * @param {unknown} detail
   */
  #tell(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }
}

globalThis.customElements?.define("deepsft-view", DeepSftView);
