import { Sheet } from "../three/sheet.js";
import type { Target } from "../targets/target.js";
import type { PrintInput } from "./print.js";
/** @import { Target } from "../targets/target.js" */
/** @import { Print, PrintInput } from "./print.js" */
/** A tracked print in a scene. {@link Sheet} of `deepsft/three` has anchors and the light. */
export declare class SceneSheet extends Sheet {
    #private;
    /**
     * Use `view.sheet`.
     *
     * @param {Target} target
     * @param {{ light: boolean, place: HTMLElement, signal: AbortSignal }} options where its films lie in the page, and what ends them
     */
    constructor(target: Target, { light, place, signal }: {
        light: boolean;
        place: HTMLElement;
        signal: AbortSignal;
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
    /** The film that is printed on it; null for none. */
    get video(): HTMLVideoElement | null;
    /** Plays the film while the print is found, else pauses it. */
    playFilm(): void;
    /** A canvas may show something else by now; the view calls it before it draws. */
    refreshPrint(): void;
}
