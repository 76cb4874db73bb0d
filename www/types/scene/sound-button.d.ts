/** Is shown once a film has sound. */
export declare class SoundButton {
    #private;
    /** @param {HTMLElement} element that it is laid over */
    constructor(element: HTMLElement);
    /** Offers the sound of films that have one. @param {HTMLVideoElement[]} films that are printed now */
    offer(films: HTMLVideoElement[]): void;
}
