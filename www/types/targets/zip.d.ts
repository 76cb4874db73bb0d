/**
 * Unpacks what scans are made of. Paths are from the folder of the scan's own file; files elsewhere have their names alone.
 *
 * @param {string} name of the archive
 * @param {Uint8Array} bytes
 * @returns {Promise<[string, Uint8Array][]>}
 * @throws {import("../error.js").DeepSftError} `target-unusable` when it is broken, encrypted, ZIP64, packed in another way or too large
 */
export declare function unzipped(name: string, bytes: Uint8Array): Promise<[string, Uint8Array][]>;
