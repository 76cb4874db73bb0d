export type WebGpuProbe = {
    usable: boolean;
    /**
     * whether the adapter is emulated on the CPU
     */
    software: boolean;
    /**
     * empty where the browser does not say
     */
    adapterName: string;
    /**
     * a sentence when not usable, else empty
     */
    reason: string;
};
/**
 * @typedef {object} WebGpuProbe
 * @property {boolean} usable
 * @property {boolean} software whether the adapter is emulated on the CPU
 * @property {string} adapterName empty where the browser does not say
 * @property {string} reason a sentence when not usable, else empty
 */
/**
 * Asks for the adapter the engine would get.
 *
 * @returns {Promise<WebGpuProbe>}
 */
export declare function probeWebGpu(): Promise<WebGpuProbe>;
