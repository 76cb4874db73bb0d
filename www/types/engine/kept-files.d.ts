/**
 * Kept files of one folder. What cannot be kept is fetched each time: without Cache storage (insecure pages, sandboxed frames, some private windows),
 * without room, or where it is not wanted. No failure of the storage is an error.
 */
export declare class KeptFiles {
    #private;
    /** @param {URL} folder of the files */
    constructor(folder: URL);
    /** Opens the storage, before which nothing is there. */
    open(): Promise<void>;
    /**
     * A kept file; null where there is none, or one that is damaged, in whose place a good one is kept then.
     *
     * @param {string} name
     * @param {string} sha256 of its content, hexadecimal
     */
    take(name: string, sha256: string): Promise<Uint8Array<ArrayBuffer> | null>;
    /**
     * Keeps a file, if it is what it should be.
     *
     * @param {string} name
     * @param {string} sha256
     * @param {Uint8Array<ArrayBuffer>} bytes
     */
    keep(name: string, sha256: string, bytes: Uint8Array<ArrayBuffer>): Promise<void>;
    /**
     * Throws away what the model held before. Folders that it has no file in now may be another model's.
     *
     * @param {Map<string, { sha256: string | null }>} files that the model holds now, by name
     */
    dropOthers(files: Map<string, {
        sha256: string | null;
    }>): Promise<void>;
}
/**
 * @param {Uint8Array<ArrayBuffer>} bytes
 * @param {string} sha256 hexadecimal
 */
export declare function hasHash(bytes: Uint8Array<ArrayBuffer>, sha256: string): Promise<boolean>;
