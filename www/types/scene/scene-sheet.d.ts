import { Sheet } from "../three/sheet.js";
import type { FlatPrint, FlattenOptions, Target } from "../index.js";
import type { PrintInput } from "./print.js";
/** @import { FlatPrint, FlattenOptions, Target } from "../index.js" */
/** @import { Print, PrintInput } from "./print.js" */
/** A tracked print in a scene. {@link Sheet} of `deepsft/three` has anchors and the light. */
export declare class SceneSheet extends Sheet {
    #private;
    /**
     * Use `view.sheet`.
     *
     * @param {Target} target
     * @param {{ light: boolean, place: HTMLElement, signal: AbortSignal, flatten: (options: FlattenOptions) => Promise<FlatPrint | null> }} options
     *   where its films lie in the page, what ends them, and what lays it flat
     */
    constructor(target: Target, { light, place, signal, flatten }: {
        light: boolean;
        place: HTMLElement;
        signal: AbortSignal;
        flatten: (options: FlattenOptions) => Promise<FlatPrint | null>;
    });
    /**
     * Prints something in the print's place, lit as its paper is; what lies before the paper covers it. Films play inline, muted, again and
     * again, while the print is found.
     *
     * @param {PrintInput | null} input null for the print as it is
     * @returns {Promise<void>} once it is there; a later call takes its place
     * @throws {DeepSftError} `image-unreadable`, `image-cross-origin`; once another was wanted, the signal's reason
     */
    print(input: PrintInput | null): Promise<void>;
    /**
     * Lays the print flat as the camera's newest picture shows it, without what the scene puts on it: for forms, labels, colouring books.
     *
     * @param {Pick<FlattenOptions, "width" | "unshaded" | "signal">} [options]
     * @returns {Promise<FlatPrint | null>} null where it is not found
     * @throws {DeepSftError} as `sft.flatten`
     */
    flatten(options?: Pick<FlattenOptions, "width" | "unshaded" | "signal">): Promise<FlatPrint | null>;
    /** The film that is printed on it; null for none. */
    get video(): HTMLVideoElement | null;
    /** Plays the film while the print is found, else pauses it. */
    playFilm(): void;
    /** A canvas may show something else by now; the view calls it before it draws. */
    refreshPrint(): void;
}
