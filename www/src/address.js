// Addresses as pages give them.

/** @param {unknown} input @returns {input is string | URL} */
export function isAddress(input) {
  return typeof input === "string" || input instanceof URL;
}

/** @param {string | URL} address relative to the page */
export function addressOf(address) {
  return new URL(address, typeof document === "undefined" ? self.location.href : document.baseURI);
}

/** @param {string | URL} address of a folder, relative to the page @returns {URL} ends in "/" */
export function folderOf(address) {
  const folder = addressOf(address);
  if (!folder.pathname.endsWith("/")) folder.pathname += "/";
  return folder;
}

/** A file in a folder: what signs the folder's address signs each of its files. @param {URL} folder @param {string} name */
export function fileIn(folder, name) {
  return Object.assign(new URL(name, folder), { search: folder.search });
}
