import { DeepSftError } from "../error.js";
import type { ImageInput } from "../frames/image-input.js";
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
 * @param {{ widthMm?: number, heightMm?: number, aroundMm?: number, copies?: number, signal?: AbortSignal }} options the size is that of the print, without the paper's margins
 * @returns {Promise<Extract<TargetSource, { kind: "picture" }>>}
 * @throws {DeepSftError} `target-unusable`, `image-unreadable`, `image-cross-origin`, `invalid-argument`
 */
export declare function pictureSource(image: ImageInput, { widthMm: given, heightMm, aroundMm: diameterMm, copies, signal }: {
    widthMm?: number;
    heightMm?: number;
    aroundMm?: number;
    copies?: number;
    signal?: AbortSignal;
}): Promise<Extract<TargetSource, {
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
