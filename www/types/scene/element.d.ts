import type { SceneView } from "./scene-view.js";
/** Servers that render pages have no elements. */
declare const Base: typeof HTMLElement;
/**
 * `<deepsft-view picture="poster.jpg" width-mm="420" print="film.mp4">`: a scene that runs while the element is in the page. It starts anew
 * where an attribute changes, and fires `started`, and the events `found`, `lost` and `error` of the scene, with their `detail`.
 */
export declare class DeepSftView extends Base {
    #private;
    static observedAttributes: string[];
    /** The scene that runs; null while there is none. @type {SceneView | null} */
    view: SceneView | null;
    connectedCallback(): void;
    disconnectedCallback(): void;
    attributeChangedCallback(): void;
}
export {};
