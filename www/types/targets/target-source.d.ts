import { DeepSftError } from "../error.js";
import type { ImageInput } from "../frames/image-input.js";
export type PictureOptions = {
    /**
     * width of the print, without the paper's margins; 5 to 20,000. Without it lengths are counted in that width,
     * and the target's `unit` is `width`.
     */
    widthMm?: number;
    /**
     * its height; by the picture's sides when absent
     */
    heightMm?: number;
    /**
     * diameter of the tin, bottle, mug or tube that the print goes around; it needs `widthMm`. A print longer
     * than one turn covers its own end. When absent the print lies flat at rest.
     */
    aroundMm?: number;
    /**
     * how many copies of the print `follow` follows at once, up to 16; each takes the finders about as long again.
     * Default 1
     */
    copies?: number;
    /**
     * for people; the file's own for a File and an address
     */
    name?: string;
    /**
     * rejects with its reason, and no target is added
     */
    signal?: AbortSignal;
};
export type TargetSource = {
    kind: "picture";
    pixels: ImageData;
    widthMm: number;
    heightMm: number;
    diameterMm: number | undefined;
    hasSize: boolean;
    copies: number;
} | {
    kind: "scan";
    files: Map<string, Uint8Array>;
    mmPerUnit: number;
} | {
    kind: "template";
    files: Map<string, Uint8Array>;
} | {
    kind: "model";
    files: Map<string, Uint8Array>;
};
export type TemplateInput = string | URL | Map<string, Uint8Array> | Iterable<File>;
/**
 * @param {ImageInput} image
 * @param {PictureOptions} options
 * @returns {Promise<Extract<TargetSource, { kind: "picture" }>>}
 * @throws {DeepSftError} `target-unusable`, `image-unreadable`, `image-cross-origin`, `invalid-argument`
 */
export declare function pictureSource(image: ImageInput, { widthMm: given, heightMm, aroundMm: diameterMm, copies, signal }: PictureOptions): Promise<Extract<TargetSource, {
    kind: "picture";
}>>;
/**
 * @param {TemplateInput} input
 * @returns {Promise<Extract<TargetSource, { kind: "template" | "model" }>>}
 * @throws {DeepSftError} `model-load`, `target-unusable`
 */
export declare function templateSource(input: TemplateInput): Promise<Extract<TargetSource, {
    kind: "template" | "model";
}>>;
/**
 * Whether two pictures have the same pixels.
 *
 * @param {TargetSource | undefined} one
 * @param {TargetSource} other
 */
export declare function isSamePicture(one: TargetSource | undefined, other: TargetSource): boolean;
/**
 * @param {string} message
 * @param {unknown} [cause]
 */
export declare function unusable(message: string, cause?: unknown): DeepSftError;
