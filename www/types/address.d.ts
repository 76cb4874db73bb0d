/** @param {unknown} input @returns {input is string | URL} */
export declare function isAddress(input: unknown): input is string | URL;
/** @param {string | URL} address relative to the page */
export declare function addressOf(address: string | URL): URL;
/** @param {string | URL} address of a folder, relative to the page @returns {URL} ends in "/" */
export declare function folderOf(address: string | URL): URL;
/** A file in a folder: what signs the folder's address signs each of its files. @param {URL} folder @param {string} name */
export declare function fileIn(folder: URL, name: string): URL & {
    search: string;
};
