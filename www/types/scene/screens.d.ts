import type { Target } from "../targets/target.js";
export type ScreenName = "loading" | "asking" | "scanning" | "interrupted" | "failed";
export type ScreenContents = {
    targets: Target[];
    error: Error | null;
    retry: (() => void) | null;
};
export type OwnScreens = Partial<Record<ScreenName, HTMLElement | ((contents: ScreenContents) => HTMLElement) | null>>;
/** One screen at a time over a scene. */
export declare class Screens {
    #private;
    /**
     * @param {HTMLElement} over the scene
     * @param {OwnScreens | false} own false for none at all
     */
    constructor(over: HTMLElement, own: OwnScreens | false);
    /**
     * @param {ScreenName | null} name null for none
     * @param {Partial<ScreenContents>} [contents]
     */
    show(name: ScreenName | null, { targets, error, retry }?: Partial<ScreenContents>): void;
}
