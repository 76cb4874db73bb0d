import { Texture } from "three";
import type { ImageInput } from "../frames/image-input.js";
export type PrintInput = ImageInput | Texture;
export type Print = {
    texture: Texture;
    film: HTMLVideoElement | null;
    isLive: boolean;
    close: () => void;
};
/**
 * @param {PrintInput} input
 * @param {HTMLElement} place where a film lies in the page: iPhones play no other
 * @param {AbortSignal} signal
 * @throws {DeepSftError} `image-unreadable`, `image-cross-origin`
 */
export declare function printOf(input: PrintInput, place: HTMLElement, signal: AbortSignal): Promise<Print>;
/** In the page, but not seen: iPhones play no video that is not displayed. @param {HTMLVideoElement} video */
export declare function hide(video: HTMLVideoElement): void;
