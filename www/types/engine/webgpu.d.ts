/** Names under which CPU emulations of a GPU appear, to WebGL too. */
export declare const SOFTWARE_NAMES: RegExp;
/**
 * Asks for the adapter the engine would get. All adapters but those of the compatibility mode, which is not asked for, have at least the
 * limits that the engine's kernels lean on.
 *
 * @returns whether it is usable, why not in a sentence, whether it is emulated on the CPU, and its name where the browser says it
 */
export declare function probeWebGpu(): Promise<{
    usable: boolean;
    software: boolean;
    adapterName: string;
    reason: string;
}>;
